"""A wrong unit or sensitivity: one factor on everything that a channel shows."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_sensor
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.spectra_beside import Beside, CurveFit, by_channel

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context, Difference

__all__ = ["UnitOrGainError", "known_factor"]

_LEAST_DB = 0.8  # 10 %: within that the sensitivity of a sensor in the field is known
_DOUBTED_DB = 2.5  # of a gain that is needed for lines to agree
_FEWEST_LINES, _FEWEST_BANDS = 4, 8
_HIDDEN = 1.5  # where a model was tuned without it, part of a gain is in the tuning
_SIGMAS = 4.0
_MOST_SCATTER_DB = 6.0
_ALIKE_DB = 1.5
_CORRELATED = 4.0  # neighbouring bands, so that n bands are worth n / 4
_NAMED_DB = 0.4
_KNOWN = (
    (9.80665, "m/s^2 taken for g"),
    (1 / 9.80665, "g taken for m/s^2"),
    (math.sqrt(2), "peak values taken for rms values"),
    (math.sqrt(0.5), "rms values taken for peak values"),
    (2.0, "a factor of 2, as of peak-to-peak values or of a gain switch"),
    (0.5, "a factor of 1/2, as of a gain switch"),
    *((10.0**k, f"a factor of 1e{k}, as of a gain switch or a unit") for k in (-6, -3, -2, -1, 1, 2, 3, 6)),
)


def known_factor(factor: float) -> str:
    """What usually makes just that factor; empty if it is none of those."""
    off = [(abs(20 * math.log10(factor / known)), words) for known, words in _KNOWN]
    best = min(off)
    return best[1] if best[0] <= _NAMED_DB else ""


def _gain(data: Beside, sample_rate_hz: float) -> CurveFit | None:  # noqa: ARG001
    """The median ratio of the levels, and its standard deviation by their scatter."""
    ratio = data.ratio_db[data.heard]
    if ratio.size < _FEWEST_BANDS:
        return None
    gain = float(np.median(ratio))
    scatter = 1.4826 * float(np.median(np.abs(ratio - gain)))
    if scatter > _MOST_SCATTER_DB:  # another shape is no factor
        return None
    std = 1.2533 * max(scatter, 0.3) * (_CORRELATED / ratio.size) ** 0.5
    factor = 10 ** (gain / 20)
    known = data.std_db[data.heard]
    drop = float(np.sum((ratio / known) ** 2 - ((ratio - gain) / known) ** 2))
    return CurveFit(np.array([factor]), np.array([std]), gain, drop, 1.0)


class UnitOrGainError:
    """One factor on all levels of a channel, in every representation alike."""

    name = "unit_or_gain_error"
    scales = True
    of_chain = True
    parameters: tuple[Parameter, ...] = (Parameter("factor", "1", LogNormal(1.0, 4.0, 1e-7, 1e7), 0.1),)
    confused_with: tuple[tuple[str, str], ...] = (
        ("bearing_clearance", "a tap with a calibrated hammer: a gain is the sensor's own"),
        ("load_fluctuation", "a record at another load: a gain is the same at all loads"),
        (
            "transfer_path",
            "a tap with a calibrated hammer, or a shaker for sensors: a gain is the sensor's own",
        ),
    )

    def applies(self, context: Context) -> bool:
        """Only where the records state a unit: otherwise levels mean nothing."""
        return any(view.record.unit not in ("", "1") for view in context.views)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """All channels by one factor if they share it; else each channel that has its own.

        What sensors' noise covers tells no gain: where little stands out of it, the lines that do are asked.
        """
        found = by_channel(context, _gain, noisy=True)
        if not found:
            return self._by_lines(context)
        db = {name: fit.gain_db for name, fit in found.items()}
        std = {name: float(fit.std[0]) for name, fit in found.items()}
        middle = float(np.median(list(db.values())))
        shared = float(np.mean(list(std.values()))) / len(std) ** 0.5
        alike = all(abs(db[name] - middle) <= max(_ALIKE_DB, _SIGMAS * std[name]) for name in db)
        if alike:
            sure = abs(middle) >= max(_LEAST_DB, _SIGMAS * shared)
            return _starts(middle, "all") if sure else self._by_lines(context)
        odd = [name for name in db if abs(db[name]) >= max(_LEAST_DB, _SIGMAS * std[name])]
        odd.sort(key=lambda name: -abs(db[name]))
        return [start for name in odd[:2] for start in _starts(db[name], name)]

    @staticmethod
    def _by_lines(context: Context) -> list[dict[str, float | str]]:
        """The gain that lines ask for beyond what the chain was given, and more of it."""
        db = {}
        for name in context.views[0].record.channels:
            rest = [
                each.difference_db
                for each in context.differences("orders", name)
                if _stands_out(context, each)
            ]
            if len(rest) >= _FEWEST_LINES:
                db[name] = context.gains_db.get(name, 0.0) + float(np.median(rest))
        if not db:
            return []
        middle = float(np.median(list(db.values())))
        alike = len(db) == len(context.views[0].record.channels)
        alike &= all(abs(each - middle) <= _ALIKE_DB for each in db.values())
        asked = {"all": middle} if alike else db
        worst = sorted(asked, key=lambda name: -abs(asked[name]))[:2]
        return [
            start for name in worst if abs(asked[name]) >= _DOUBTED_DB for start in _starts(asked[name], name)
        ]

    def extend(self, content: Content, values: Values, context: Context) -> Content:
        """The content with that gain: an error of the sensitivity, or beyond twice a weight of the site."""
        factor, component = float(values["factor"]), str(values["component"])
        channels = context.views[0].record.channels if component == "all" else (component,)
        rows = content.get("sensors", {}).get("accelerometers", {}).get("each", {})
        for channel in channels:
            if factor <= 2.0:
                before = float(rows.get(channel, {}).get("gain_error", 0.0))
                content = with_sensor(content, channel, "gain_error", (1 + before) * factor - 1)
            else:
                site = rows.get(channel, {}).get("site", channel)
                sites = {site: 1.0} if isinstance(site, str) else dict(site)
                weighted = {name: float(weight) * factor for name, weight in sites.items()}
                content = with_sensor(content, channel, "site", weighted)
        return content

    def signature(self, values: Values) -> str:
        """In plain words."""
        factor = float(values["factor"])
        which = "all channels" if values["component"] == "all" else str(values["component"])
        words = known_factor(factor)
        return f"all levels of {which} are {factor:.3g} times those expected" + (
            f": {words}" if words else ""
        )


def _stands_out(context: Context, each: Difference) -> bool:
    """Whether both the record and the model are above their noise at a place."""
    k = context.measured[each.record].places.index(each.place)
    sides = context.measured[each.record], context.simulated[each.record]
    return bool(sides[0].stands_out[k] and sides[1].stands_out[k] and np.isfinite(each.difference_db))


def _starts(gain_db: float, component: str) -> list[dict[str, float | str]]:
    """As read beside a model whose tuning may have met it half way, and more of it."""
    return [{"factor": 10 ** (times * gain_db / 20), "component": component} for times in (1.0, _HIDDEN)]
