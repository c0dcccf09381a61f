"""The page of a verdict: what is on it, in which order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from gearsim_bringup.pages.assembled import assembled, shown
from gearsim_bringup.pages.plot import FOUND, Plot
from gearsim_bringup.twin_report import words
from gearsim_bringup.twin_report.ladder import draw_bands, draw_domains
from gearsim_bringup.twin_report.numbers import (
    cause_name,
    decibels,
    domain_name,
    parameter_name,
    quantity,
    span,
)
from gearsim_bringup.twin_report.overlays import draw_density, draw_envelope, draw_orders, draw_waveforms
from gearsim_bringup.twin_report.sides import Sides
from gearsim_bringup.twin_report.tiles import legend, tile_rows
from gearsim_twin.verdict import Found, Verdict

__all__ = ["make_twin_page"]

_OVERLAYS: tuple[tuple[str, Callable[[Sides], Plot]], ...] = (
    ("Envelope spectra", draw_envelope),
    ("Order spectra", draw_orders),
    ("Power spectra", draw_density),
    ("Waveforms", draw_waveforms),
)
_MOST_REJECTED = 20


@dataclass(frozen=True, slots=True)
class _CauseCard:
    """A cause on the page."""

    name: str
    colour: str
    probability: str
    gain: str
    gain_span: str
    domain: str
    signature: str
    instead_of: str
    parameters: list[tuple[str, str, str]]
    deciding: list[words.Row]


def make_twin_page(verdict: Verdict) -> str:
    """The whole page as HTML; it needs nothing besides itself.

    Raises
    ------
    InputError
        When the verdict was judged without `show`.
    """
    sides = Sides(verdict)
    exhibit = sides.exhibit
    state, title, below = words.headline(verdict)
    differences, more = words.difference_rows(verdict)
    tiles = tile_rows(exhibit)
    rest, more_rest = words.rest(verdict)
    domains, steps = words.step_rows(exhibit)
    plots = [shown(f"plot-{n}", name, partial(draw, sides)) for n, (name, draw) in enumerate(_OVERLAYS)]
    return assembled(
        "gearsim_bringup.twin_report",
        "page.html.j2",
        machine=exhibit.machine.name,
        below_name=words.case_line(exhibit),
        state=state,
        title=title,
        below=below,
        finding=words.finding(verdict),
        rest=rest,
        more_rest=more_rest,
        ladder=shown("ladder", "How far each model is from the records", partial(draw_domains, exhibit)),
        bands=shown("bands", "By band", partial(draw_bands, exhibit)),
        domains=domains,
        steps=steps,
        tuning=words.tuning_line(verdict),
        tiles=tiles,
        widest=max((len(row.channels) for row in tiles), default=0),
        last="extended" if len(exhibit.steps) > 2 else "tuned",
        legend=list(legend()),
        causes=[
            _card(each, FOUND[k % len(FOUND)])
            for k, each in enumerate(verdict.causes)
            if each.name != "unknown"
        ],
        plots=plots,
        differences=differences,
        more=more,
        rejected=[
            (each.name.replace("_", " "), each.why, decibels(each.heldout_gain_db), f"{each.probability:.2g}")
            for each in verdict.rejected[:_MOST_REJECTED]
        ],
        remarks=verdict.remarks,
        records=list(words.record_rows(exhibit)),
        extended="" if verdict.extended_model is None else verdict.extended_model.name,
    )


def _card(found: Found, colour: str) -> _CauseCard:
    return _CauseCard(
        name=cause_name(found),
        colour=colour,
        probability=f"{100 * found.probability:.0f} %",
        gain=decibels(found.heldout_gain_db),
        gain_span=span(found.heldout_ci95_db),
        domain=domain_name(found.domain),
        signature=found.signature,
        instead_of=found.instead_of.replace("_", " "),
        parameters=[
            (
                parameter_name(each.name),
                quantity(each),
                f"{each.ci95[0]:.4g} to {each.ci95[1]:.4g} {'' if each.unit == '1' else each.unit}",
            )
            for each in found.parameters
        ],
        deciding=words.deciding(found),
    )
