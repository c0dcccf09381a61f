"""A node that Ctrl-C ended while it was still compiling is no failure of the node."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from gearsim_bringup.live import BadNodeError, LiveRun
from gearsim_bringup.processes import NodeSpec
from gearsim_bringup.ui import JobFailedError


def _graph(status):
    node = SimpleNamespace(
        spec=NodeSpec("simulator", "", {}), returncode=lambda: status, last_words=lambda: "simulator: no"
    )
    return SimpleNamespace(failed=lambda: node)


@pytest.mark.parametrize(
    ("status", "error"),
    [
        (130, KeyboardInterrupt),
        (-2, KeyboardInterrupt),
        (2, BadNodeError),
        (1, JobFailedError),
        (-11, JobFailedError),
    ],
)
def test_who_was_interrupted_did_not_fail(status, error):
    run = LiveRun(NodeSpec("simulator", "", {}), Path("nowhere"))
    with pytest.raises(error):
        run._check(_graph(status))
