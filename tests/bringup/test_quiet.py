"""When a graph may be ended: not before all diagnostic nodes have judged what they received."""

from __future__ import annotations

from types import SimpleNamespace

from gearsim_bringup import live
from gearsim_bringup.quiet import Quiet


def say(quiet, node, batches, unfinished, task="stream"):
    quiet.status(f"{node}: {task}", {"batches": str(batches), "batches not analysed yet": str(unfinished)})


def test_two_like_reports_of_each_node_are_the_end():
    quiet = Quiet(("envelope", "kurtosis"))
    for _ in range(2):
        assert not quiet.reached
        say(quiet, "envelope", 40, 0)
        say(quiet, "kurtosis", 40, 0)
    assert quiet.reached
    assert quiet.words == ""


def test_a_node_that_still_analyses_is_waited_for_however_long_it_is_silent():
    quiet = Quiet(("envelope",))
    for _ in range(9):
        say(quiet, "envelope", 40, 1)  # one long window, and nothing new arrives
        assert not quiet.reached
    assert quiet.words == "envelope (1 batches left)"
    say(quiet, "envelope", 40, 0)
    assert not quiet.reached  # more may have waited for the thread that receives
    say(quiet, "envelope", 41, 0)
    assert not quiet.reached
    say(quiet, "envelope", 41, 0)
    assert quiet.reached


def test_what_one_node_tells_another_has_to_judge():
    quiet = Quiet(("envelope", "trend"))
    for _ in range(3):
        say(quiet, "trend", 10, 0)
        say(quiet, "envelope", 40, 1)
    say(quiet, "envelope", 40, 0)
    say(quiet, "envelope", 40, 0)
    assert not quiet.reached  # what the trend node said was said before
    say(quiet, "trend", 12, 0)
    say(quiet, "envelope", 40, 0)
    say(quiet, "trend", 12, 0)
    assert not quiet.reached
    say(quiet, "envelope", 40, 0)
    assert quiet.reached


def test_what_was_said_while_the_source_ran_does_not_count():
    quiet = Quiet(("envelope",))
    for _ in range(5):
        say(quiet, "envelope", 40, 0)
    quiet.restart()
    assert not quiet.reached


def test_other_nodes_and_tasks_do_not_matter():
    quiet = Quiet(("envelope",))
    for _ in range(3):
        say(quiet, "envelope", 0, 0, "alarms")
        say(quiet, "recorder", 0, 0, "recording")
    assert quiet.words == "envelope (not heard of)"
    assert Quiet(()).reached


class Reports:
    """Stands for the watcher: one report after the other, about one a second."""

    def __init__(self, quiet, rows):
        self.quiet, self.rows, self.seconds = quiet, rows, 0

    def spin(self, seconds, until):
        while not until() and self.seconds < seconds:
            say(self.quiet, *next(self.rows))
            self.seconds += 1


def drained(rows):
    graph = SimpleNamespace(failed=lambda: None)
    quiet = Quiet(("envelope",))
    reports = Reports(quiet, rows)
    return live._drain(reports, graph, quiet), reports.seconds


def test_the_end_waits_for_a_slow_node():
    def slow():
        for left in range(30, 0, -1):
            yield "envelope", 100, left
        while True:
            yield "envelope", 100, 0

    assert drained(slow()) == ("", 32)


def test_the_end_needs_words_said_after_it():
    quiet = Quiet(("envelope",))
    for _ in range(5):
        say(quiet, "envelope", 40, 0)
    assert quiet.reached  # a source with long breaks
    reports = Reports(quiet, iter([("envelope", 41, 1), ("envelope", 41, 0), ("envelope", 41, 0)]))
    assert live._drain(reports, SimpleNamespace(failed=lambda: None), quiet) == ""
    assert reports.seconds == 3


def test_the_end_does_not_wait_for_ever_and_says_who_was_late():
    def stuck():
        while True:
            yield "envelope", 100, 7

    late, seconds = drained(stuck())
    assert late == "envelope (7 batches left)"
    assert seconds < 15
    assert "alarms may be missing: envelope (7 batches left)" in live.Outcome(late=late).warning

    def ever():
        left = 0
        while True:
            left += 1
            yield "envelope", 100 + left, left

    late, seconds = drained(ever())
    assert late == "envelope (60 batches left)"
    assert seconds == 60
