"""Options that may be `off` in YAML."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydantic import GetCoreSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema

from gearsim_io.quantities import Si


def is_off(raw: Any) -> bool:
    """Whether a value in YAML switches something off."""
    return raw is None or raw is False or raw == "off"


class SiOrOff(Si):
    """A physical number, or `off`."""

    @property
    def expected(self) -> str:
        """The accepted values in words."""
        return super().expected + ", or off"

    def _validate(self, raw: Any, info: ValidationInfo) -> Any:
        return None if is_off(raw) else super()._validate(raw, info)


@dataclass(frozen=True)
class OrOff:
    """Marks a field of a section that may be `off`; the rest is as its type says."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(
            lambda raw: None if is_off(raw) else raw, handler(source)
        )
