"""Makes, judges and scores one case, and prints the result as one JSON object.

python -m blind.one SEED INDEX [--rig NAME] [--workers N] [--cache DIR] [--limit SECONDS]
"""

from __future__ import annotations

import argparse
import json
import secrets
import sys
import tempfile
import time
import traceback
from dataclasses import asdict
from pathlib import Path
from typing import Any

from blind.detector import largest_db
from blind.judging import judge
from blind.making import make, write
from blind.plan import Planned, drawn, planned
from blind.rigs import RIGS
from blind.scoring import score


def run(plan: Planned, workers: int, cache: Path | None, limit_s: float) -> dict[str, Any]:
    """The result of a case; what goes wrong is told as `failed`."""
    result: dict[str, Any] = {**asdict(plan), "severity": plan.severity}
    with tempfile.TemporaryDirectory(prefix="records-") as name:
        folder = Path(name) if cache is None else cache / "-".join(_words(plan))
        began = time.process_time()
        places, truth, secret = _records(plan, folder)
        result |= {"truth": truth, "made_s": round(time.process_time() - began, 1)}
        before = sorted(folder.glob("before_*"))
        judged = judge(places, RIGS[plan.rig], [secret], workers, limit_s, before)
        result |= {"wall_s": round(judged.wall_s, 1), "cpu_s": round(judged.cpu_s, 1)}
        if judged.verdict is None:
            return {**result, "failed": judged.said}
        result["score"] = score(truth, plan.kind, judged.verdict)
        result["verdict"] = judged.verdict
        if before and plan.compared:
            alone = judge(places, RIGS[plan.rig], [secret], workers, limit_s)
            result["without_healthy"] = score(truth, plan.kind, alone.verdict) if alone.verdict else None
        result["detector"] = {"largest_db": largest_db(places, RIGS[plan.rig])}
    return result


def _words(plan: Planned) -> list[str]:
    """What tells one case from all others."""
    return [str(plan.seed), str(plan.index), *filter(None, [plan.only])]


def _records(plan: Planned, folder: Path) -> tuple[list[Path], dict[str, Any], Path]:
    """Records, the truth, and the folder where that is kept: apart, under a name that nobody is told."""
    done = sorted(folder.parent.glob(f".{folder.name}-*/truth.json")) if folder.exists() else []
    if done:
        return sorted(folder.glob("run_*")), json.loads(done[0].read_text(encoding="utf-8")), done[0].parent
    made = make(*drawn(plan.rig, plan.effects, (plan.seed, plan.index)), healthy=plan.healthy)
    folder.mkdir(parents=True, exist_ok=True)
    places = write(made, folder)
    secret = folder.parent / f".{folder.name}-{secrets.token_hex(8)}"
    secret.mkdir(mode=0o700)
    truth = json.loads(json.dumps(made.truth))
    (secret / "truth.json").write_text(json.dumps(truth), encoding="utf-8")
    return places, truth, secret


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser()
    parser.add_argument("seed", type=int)
    parser.add_argument("index", type=int)
    parser.add_argument("--rig", choices=sorted(RIGS), default="")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--cache", type=Path)
    parser.add_argument("--limit", type=float, default=900.0)
    given = parser.parse_args()
    plan = planned(given.seed, given.index, given.rig)
    try:
        result = run(plan, given.workers, given.cache, given.limit)
    except Exception as error:
        traceback.print_exc(file=sys.stderr)
        result = {**asdict(plan), "failed": f"{type(error).__name__}: {error}"}
    print(json.dumps(result))


if __name__ == "__main__":
    main()
