"""The steps of a set-up in their order; each is skipped when the stamp says that it stands."""

from __future__ import annotations

import os
import shutil

from gearsim_setup import interpreter, system, wheels, workspace
from gearsim_setup.command import ask
from gearsim_setup.interpreter import Interpreter
from gearsim_setup.job import Job
from gearsim_setup.places import Places
from gearsim_setup.stamp import Stamp, expected_parts


def assemble(job: Job) -> None:
    """Do what the stamp does not know as complete.

    Raises
    ------
    SetupProblem
        When a step fails; what was completed before it stays.
    """
    places = job.places
    job.report.line(f"setting up gearsim in {places.root} (ROS: {job.route}); the first time takes minutes")
    shutil.rmtree(places.logs, ignore_errors=True)
    python = interpreter.choose(places)
    if system.provide(job, python):
        python = interpreter.probe(str(python.executable))
    stamp = Stamp(places.stamp)
    _see_to_venv(job, python, stamp)
    _see_to_wheels(job, stamp)
    _see_to_workspace(job, python, stamp)
    _keep_rerun_quiet(places)
    job.report.line(f"set up in {job.report.total():.0f} s; long outputs are in {places.short(places.logs)}")


def _see_to_venv(job: Job, python: Interpreter, stamp: Stamp) -> None:
    places = job.places
    known = stamp.has("venv", expected_parts(places, job.route)["venv"])
    if known and places.venv_minor() == python.minor and interpreter.standing_fits(places):
        return
    stamp.strike("venv")
    with job.report.step("virtual env") as step:
        if wheels.adoptable(job, python):
            step.done(f"Python {python.text}, taken over as it stood")
        else:
            wheels.make_venv(job, python)
            step.done(f"Python {python.text} ({python.executable})")
    stamp.complete("venv", expected_parts(places, job.route)["venv"])


def _see_to_wheels(job: Job, stamp: Stamp) -> None:
    wanted = expected_parts(job.places, job.route)["wheels"]
    if stamp.has("wheels", wanted):
        return
    stamp.strike("wheels")
    wheels.install(job)
    stamp.complete("wheels", wanted)


def _see_to_workspace(job: Job, python: Interpreter, stamp: Stamp) -> None:
    wanted = expected_parts(job.places, job.route)
    messages_stand = stamp.has("messages", wanted["messages"])
    stands = messages_stand and stamp.has("packages", wanted["packages"])
    if stands and (job.places.install / "setup.sh").is_file():
        return
    if job.on_wheels:
        workspace.mend_wheels(job, python)
    if messages_stand:
        stamp.strike("packages")
    else:
        # A message that was taken away, or a build cut off half-way, would live on in the old folders.
        stamp.strike("messages")
        workspace.clear(job.places)
    workspace.build(job, python)
    stamp.complete("messages", wanted["messages"])
    stamp.complete("packages", wanted["packages"])


def _keep_rerun_quiet(places: Places) -> None:
    """Opt out of the viewer's usage reports, unless the person has decided about them already."""
    home = os.environ.get("XDG_CONFIG_HOME") or os.path.expanduser("~/.config")
    if not os.path.exists(os.path.join(home, "rerun", "analytics.json")):
        ask([str(places.venv / "bin" / "rerun"), "analytics", "disable"], timeout_s=20)
