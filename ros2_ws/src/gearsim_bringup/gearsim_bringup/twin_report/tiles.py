"""The map of discrepancies: a tile per place and channel, before and after, coloured by how far off it is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gearsim_bringup.twin_report.numbers import domain_name
from gearsim_twin.compare.discrepancy import Comparison, significant
from gearsim_twin.compare.merged import base
from gearsim_twin.compare.places import DOMAINS, Place, hz_text
from gearsim_twin.exhibit import Exhibit
from gearsim_twin.words import LEAST_DB, LEAST_Z

__all__ = ["Tile", "TileRow", "legend", "tile_rows"]

_MOST_PER_DOMAIN = 8
_QUIET_PER_DOMAIN = 2
_FULL_DB = 20.0


@dataclass(frozen=True, slots=True)
class Tile:
    """The place of a row that is furthest off on one channel; `style` is its colour."""

    label: str
    style: str
    sure: bool
    detail: str


@dataclass(frozen=True, slots=True)
class TileRow:
    """What is compared, and its tiles: those of the first model, then those of the last."""

    domain: str
    what: str
    channels: tuple[str, ...]
    before: tuple[Tile, ...]
    after: tuple[Tile, ...]


def tile_rows(exhibit: Exhibit) -> list[TileRow]:
    """Rows by domain: what differs for sure in either model, and a little of what agrees."""
    first, last = exhibit.steps[0].comparison, exhibit.steps[-1].comparison
    sure = [_sure(each) for each in (first, last)]
    found: list[TileRow] = []
    # Last what has columns of its own.
    for domain in sorted(DOMAINS, key=lambda name: name == "torsional"):
        groups = _groups(first, domain)
        ranked = sorted(groups.items(), key=lambda item: -_worst((first, last), sure, item[1]))
        certain = [item for item in ranked if any(bool(s[item[1]].any()) for s in sure)]
        quiet = [item for item in ranked if item not in certain and bool(first.counted[item[1]].any())]
        channels = tuple(dict.fromkeys(p.channel for p in first.places if p.domain == domain))
        chosen = [rows for _, rows in (*certain[:_MOST_PER_DOMAIN], *quiet[:_QUIET_PER_DOMAIN])]
        if domain == "psd":
            chosen.sort(key=lambda rows: first.places[rows[0]].at)
        for rows in chosen:
            tiles = [
                tuple(_tile(side, known, rows, channel) for channel in channels)
                for side, known in zip((first, last), sure, strict=True)
            ]
            found.append(TileRow(domain_name(domain), _what(first, rows), channels, *tiles))
    return found


def _sure(comparison: Comparison) -> np.ndarray:
    """Places that differ for sure, by more than a good model errs by: what counts in the verdict."""
    large = (np.abs(comparison.difference_db) >= LEAST_DB) & (np.abs(comparison.z) >= LEAST_Z)
    return np.asarray(large & significant(comparison))


def _worst(sides: Sequence[Comparison], sure: Sequence[np.ndarray], rows: list[int]) -> float:
    return max(
        float(np.max(np.where(known[rows], np.abs(side.z[rows]), 0.0)))
        for side, known in zip(sides, sure, strict=True)
    )


def _groups(comparison: Comparison, domain: str) -> dict[tuple[object, ...], list[int]]:
    """Places of a domain that belong together, in whatever channel and band."""
    groups: dict[tuple[object, ...], list[int]] = {}
    for k, place in enumerate(comparison.places):
        if place.domain == domain:
            groups.setdefault(_key(place), []).append(k)
    return groups


def _key(place: Place) -> tuple[object, ...]:
    if place.domain == "psd":
        return ("band", round(2 * np.log2(max(place.at, 1.0))))
    if place.domain in ("statistics", "transient"):
        return (place.kind, place.label)
    if place.kind in ("tone", "half"):
        return (place.kind, place.unit, round(place.at / max(place.width, 1e-9)))
    return (place.kind in ("ratio", "floor") and place.kind, base(place.label))


def _what(comparison: Comparison, rows: list[int]) -> str:
    """The group in words."""
    places = [comparison.places[k] for k in rows]
    first = places[0]
    if first.domain == "psd":
        low = min(place.at - 0.5 * place.width for place in places)
        high = max(place.at + 0.5 * place.width for place in places)
        return f"{hz_text(max(low, 0.0))} to {hz_text(high)}"
    if first.domain in ("statistics", "transient") or first.kind in ("ratio", "floor", "tone", "half"):
        return first.what(comparison.speed_hz)
    lowest = min(places, key=lambda place: place.at)
    hz = lowest.hz(comparison.speed_hz)
    at = hz_text(hz) if hz == hz else f"order {lowest.at:.4g}"
    several = " and multiples" if len({round(place.at, 6) for place in places}) > 1 else ""
    return f"{base(first.label) or first.kind} ({at}{several})"


def _tile(comparison: Comparison, sure: np.ndarray, rows: list[int], channel: str) -> Tile:
    mine = [k for k in rows if comparison.places[k].channel == channel and comparison.counted[k]]
    if not mine:
        return Tile("", "", False, "nothing to compare")
    k = max(mine, key=lambda row: abs(float(comparison.z[row])))
    size, z = float(comparison.difference_db[k]), float(comparison.z[k])
    detail = f"{comparison.places[k].words(comparison.speed_hz)}: {size:+.1f} dB, z {z:+.1f}"
    label = "0" if abs(size) < 0.5 else f"{size:+.0f}".replace("-", "−")
    return Tile(label, _style(size, bool(sure[k])), bool(sure[k]), detail)


def _style(size_db: float, sure: bool) -> str:
    """Red where the record has more than the model, blue where it has less; pale where it may be chance."""
    if not sure:
        return "background: #eef0f3; color: #5b6472"
    share = min(abs(size_db) / _FULL_DB, 1.0) ** 0.7
    end = (176, 42, 33) if size_db > 0 else (30, 85, 150)
    colour = ", ".join(str(round(245 + share * (each - 245))) for each in end)
    return f"background: rgb({colour}); color: {'#fff' if share > 0.55 else '#1f2937'}"


def legend() -> Iterator[tuple[str, str]]:
    """Labels and colours that explain the tiles."""
    for size in (-20.0, -6.0, 6.0, 20.0):
        yield f"{size:+.0f} dB".replace("-", "−"), _style(size, sure=True)
    yield "may be chance, or small", _style(0.0, sure=False)
