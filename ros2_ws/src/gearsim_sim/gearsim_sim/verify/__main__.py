"""`python -m gearsim_sim.verify accuracy` or `energy`: measures, and prints or publishes the table.

With `--into docs/accuracy.md` the table replaces that between the two marks of the page. With `--missing`
only rows that the page lacks are measured, each entered as soon as it is there, and those of things
that are no more are left out.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from gearsim_io.page_marks import put_into, standing

MARKS = "measured"  # of the table in its page


@dataclass(frozen=True)
class Table:
    """A table: its head, and what makes each row, by how the row begins."""

    head: tuple[str, str]
    rows: Callable[[Sequence[str]], Iterator[tuple[str, Callable[[], str]]]]


def accuracy_rows(models: Sequence[str]) -> Iterator[tuple[str, Callable[[], str]]]:
    """Of the table of errors: how each row begins, and what measures it."""
    from gearsim_sim.verify.accuracy import all_cases, measure

    def row(model: str, kind: str) -> str:
        one = measure(model, kind)
        effect = f"{one.effect:.2g}" if one.component else ""
        return f"| {one.model} | {one.kind} | {one.component} | {one.error:.1e} | {effect} |"

    for model, kind in all_cases():
        if not models or model in models:
            yield f"| {model} | {kind} |", partial(row, model, kind)


def energy_rows(models: Sequence[str]) -> Iterator[tuple[str, Callable[[], str]]]:
    """Of the table of balances: how each row begins, and what measures it."""
    from gearsim_sim.verify.energy import EnergyCase, balance, energy_cases

    def row(case: EnergyCase) -> str:
        found = [balance(case, oversampling) for oversampling in (2, 4, 8)]
        lost = sum(found[1].integral(power) for power in found[1].dissipated_w.values())
        parts = " | ".join(f"{one.relative_residual:.1e}" for one in found)
        return f"| {case} | {found[1].throughput_j * 1e3:.3g} mJ | {lost * 1e3:.3g} mJ | {parts} |"

    for case in energy_cases():
        if not models or case.model in models:
            yield f"| {case} |", partial(row, case)


TABLES = {
    "accuracy": Table(
        ("| model | fault | component | error | effect |", "|---|---|---|---|---|"), accuracy_rows
    ),
    "energy": Table(
        (
            "| run | throughput | dissipated | unexplained at 2x | at 4x | at 8x |",
            "|---|---|---|---|---|---|",
        ),
        energy_rows,
    ),
}


def measured(table: Table, models: Sequence[str]) -> Iterator[str]:
    """The table, line by line."""
    yield from table.head
    for _, measure in table.rows(models):
        yield measure()


def add_missing(table: Table, models: Sequence[str], page: Path) -> Iterator[str]:
    """Enter the rows that a page lacks, and yield them."""
    known = {start: "" for start, _ in table.rows(())}
    for line in standing(page, MARKS):
        known |= {start: line for start in known if line.startswith(start)}
    for start, measure in table.rows(models):
        if not known[start]:
            known[start] = measure()
            put_into(page, MARKS, [*table.head, *(line for line in known.values() if line)])
            yield known[start]


def main(argv: Sequence[str] | None = None) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m gearsim_sim.verify", description=__doc__)
    parser.add_argument("table", choices=sorted(TABLES))
    parser.add_argument("--model", action="append", default=[], help="only this model (may be repeated)")
    parser.add_argument("--into", type=Path, help="page whose table is replaced")
    parser.add_argument("--missing", action="store_true", help="only rows that the page lacks")
    given = parser.parse_args(argv)
    if given.missing and given.into is None:
        parser.error("--missing needs --into: the page that lacks them")
    table, lines = TABLES[given.table], []
    found = add_missing(table, given.model, given.into) if given.missing else measured(table, given.model)
    for line in found:
        print(line, flush=True)
        lines.append(line)
    if given.into is not None and not given.missing:
        put_into(given.into, MARKS, lines)
    return 0


if __name__ == "__main__":
    sys.exit(main())
