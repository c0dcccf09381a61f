"""`python -m gearsim_sim.verify accuracy` or `energy`: measures, and prints or publishes the table.

With `--into docs/accuracy.md` the table replaces that between the two marks of the page.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"


def accuracy_rows(models: Sequence[str]) -> Iterator[str]:
    """The table of errors, line by line."""
    from gearsim_sim.verify.accuracy import all_cases, measure

    yield "| model | fault | component | error | effect |"
    yield "|---|---|---|---|---|"
    for model, kind in all_cases():
        if models and model not in models:
            continue
        one = measure(model, kind)
        effect = f"{one.effect:.2g}" if one.component else ""
        yield f"| {one.model} | {one.kind} | {one.component} | {one.error:.1e} | {effect} |"


def energy_rows(models: Sequence[str]) -> Iterator[str]:
    """The table of balances, line by line."""
    from gearsim_sim.verify.energy import balance, energy_cases

    yield "| run | throughput | dissipated | unexplained at 2x | at 4x | at 8x |"
    yield "|---|---|---|---|---|---|"
    for case in energy_cases():
        if models and case.model not in models:
            continue
        found = [balance(case, oversampling) for oversampling in (2, 4, 8)]
        lost = sum(found[1].integral(power) for power in found[1].dissipated_w.values())
        parts = " | ".join(f"{one.relative_residual:.1e}" for one in found)
        yield f"| {case} | {found[1].throughput_j * 1e3:.3g} mJ | {lost * 1e3:.3g} mJ | {parts} |"


TABLES: dict[str, Callable[[Sequence[str]], Iterator[str]]] = {
    "accuracy": accuracy_rows,
    "energy": energy_rows,
}


def put_into(page: Path, lines: Sequence[str]) -> None:
    """Replace what stands between the marks."""
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    after = rest.split(END)[1]
    text = "\n".join(lines)
    page.write_text(f"{before}{BEGIN}\n{text}\n{END}{after}", encoding="utf-8")


def main(argv: Sequence[str] | None = None) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m gearsim_sim.verify", description=__doc__)
    parser.add_argument("table", choices=sorted(TABLES))
    parser.add_argument("--model", action="append", default=[], help="only this model (may be repeated)")
    parser.add_argument("--into", type=Path, help="page whose table is replaced")
    given = parser.parse_args(argv)
    lines = []
    for line in TABLES[given.table](given.model):
        print(line, flush=True)
        lines.append(line)
    if given.into is not None:
        put_into(given.into, lines)
    return 0


if __name__ == "__main__":
    sys.exit(main())
