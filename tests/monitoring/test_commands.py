"""The commands' side: which nodes run, where stacks are, and the settings that are written out."""

from __future__ import annotations

import re

import pytest
from ruamel.yaml import YAML

from gearsim_bringup.cli import main
from gearsim_bringup.monitoring.choice import ALL_MONITORS, MONITORS, Choice, choose
from gearsim_bringup.monitoring.files import FILES, read_file, write_files
from gearsim_io.errors import InputError


def test_what_runs_follows_from_the_options(tmp_path):
    usual = choose(",".join(MONITORS), "none", None, None)
    assert usual == Choice()
    assert [spec.name for spec in usual.specs()] == list(MONITORS)
    assert usual.listeners == 2
    every = choose("all", "error", "0.0.0.0:9000", "broker.local", tmp_path, 30.0)
    assert every.monitors == ALL_MONITORS
    assert [spec.name for spec in every.specs()] == [
        "exporter",
        "mqtt",
        "trend",
        "envelope",
        "kurtosis",
        "gear",
    ]
    assert every.listeners == 3  # the trend node takes no samples
    nodes = {spec.name: spec for spec in every.specs()}
    assert nodes["exporter"].parameters == {"host": "0.0.0.0", "port": 9000}
    assert nodes["mqtt"].parameters == {"host": "broker.local", "port": 1883}
    assert nodes["envelope"].parameters == {"latch": "error"}
    assert nodes["gear"].parameters == {"latch": "error", "baseline_dir": str(tmp_path), "learn_s": 30.0}
    # recorder and command line, exporter and MQTT, and the two learning nodes hear every alarm from the first
    waiting = {spec.name: spec.parameters.get("alarm_listeners") for spec in every.specs(alarm_listeners=2)}
    assert waiting == {"exporter": None, "mqtt": None, "trend": None, "envelope": 6, "kurtosis": 6, "gear": 6}


def test_a_twin_runs_where_it_is_given_a_model(tmp_path):
    scenario = tmp_path / "extended.yaml"
    scenario.write_text("machine: unsw_parallel\n")
    usual = ",".join(MONITORS)
    for given, model in (("lpm34", "lpm34"), (str(scenario), str(scenario))):
        found = choose(usual, "none", None, None, tmp_path, 30.0, given)
        assert found.monitors == (*MONITORS, "twin")
        assert found.listeners == 3
        (spec,) = [each for each in found.specs(alarm_listeners=1) if each.name == "twin"]
        assert spec.module == "gearsim_twin.nodes.twin"
        learning = {"baseline_dir": str(tmp_path), "learn_s": 30.0}
        assert spec.parameters == {"latch": "none", "alarm_listeners": 2, **learning, "model": model}
    assert "twin" not in choose("all", "none", None, None).monitors  # it needs a model
    with pytest.raises(InputError, match=re.escape("got nonsense")):
        choose(usual, "none", None, None, twin="nonsense")


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("9812", ("127.0.0.1", 9812)),
        ("here", ("here", 9812)),
        ("here:1", ("here", 1)),
        (":5", ("127.0.0.1", 5)),
    ],
)
def test_addresses_mean_this_computer_unless_told(text, address):
    assert choose("all", "none", text, None).prometheus == address


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("envelope,wrong", "none", None, None), "--monitors: got wrong, expected all, or some of envelope"),
        (("all", "none", "here:x", None), "--prometheus: got here:x, expected a port"),
        (("all", "none", None, "here:70000"), "--mqtt: got here:70000"),
    ],
)
def test_what_cannot_be_is_told(arguments, words):
    with pytest.raises(InputError, match=re.escape(words)):
        choose(*arguments)


def test_a_wrong_node_ends_the_command_with_status_2(capsys):
    assert main(["run", "healthy", "--monitors", "nonsense"]) == 2
    assert "--monitors: got nonsense" in capsys.readouterr().err


def test_settings_are_written_out_and_nothing_is_overwritten_unasked(tmp_path, capsys):
    assert main(["monitoring", "--out", str(tmp_path / "m")]) == 0
    assert {path.name for path in (tmp_path / "m").iterdir()} == set(FILES)
    assert main(["monitoring", "--out", str(tmp_path / "m")]) == 2
    assert "it exists already" in capsys.readouterr().err
    assert main(["monitoring", "--out", str(tmp_path / "m"), "--overwrite", "--json"]) == 0
    assert '"files"' in capsys.readouterr().out
    assert write_files(tmp_path / "n")[0].read_text() == read_file("prometheus.yml")


# The rules of diagnostic_aggregator's GenericAnalyzer: regex (the whole name), expected and name (equal),
# startswith, contains; a status goes to every analyzer that matches, and to "Other" if none does.


def analyzers():
    """{path: parameters} of all analyzers, those in groups too."""
    top = YAML(typ="safe").load(read_file("diagnostic_aggregator.yaml"))["analyzers"]["ros__parameters"]

    def walk(entries, stem):
        for entry in entries.values():
            if not isinstance(entry, dict):
                continue
            path = f"{stem}/{entry['path']}"
            if entry["type"] == "diagnostic_aggregator/AnalyzerGroup":
                yield from walk(entry["analyzers"], path)
            else:
                assert entry["type"] == "diagnostic_aggregator/GenericAnalyzer"
                yield path, entry

    return dict(walk(top, top["path"]))


def matches(entry, name):
    return (
        any(re.fullmatch(r, name) for r in entry.get("regex", ()))
        or name in (*entry.get("expected", ()), *entry.get("name", ()))
        or name.startswith(tuple(entry.get("startswith", ())))
        or any(part in name for part in entry.get("contains", ()))
    )


TASKS = {
    "simulator": ("pacing", "stream"),
    "player": ("playing",),
    "recorder": ("recording",),
    "viewer": ("drawing",),
    "exporter": ("serving",),
    "mqtt": ("broker",),
    **dict.fromkeys(MONITORS, ("stream", "machine", "alarms")),
    **dict.fromkeys(("gear", "trend", "twin"), ("stream", "machine", "alarms", "baseline")),
}


def test_every_status_of_ours_has_exactly_one_analyzer():
    found = analyzers()
    for node, tasks in TASKS.items():
        for task in tasks:
            places = [path for path, entry in found.items() if matches(entry, f"{node}: {task}")]
            assert len(places) == 1, (node, task, places)
    for path, entry in found.items():
        assert any(matches(entry, f"{n}: {t}") for n, tasks in TASKS.items() for t in tasks), path
        assert entry["timeout"] >= 2.0  # statuses come once a second
        for name in entry.get("expected", ()):
            node, task = name.split(": ")
            assert task in TASKS[node]
    assert not any(matches(entry, "camera: driver") for entry in found.values())


def test_the_list_of_tasks_is_that_of_the_sources():
    """All tasks that the nodes' code reports, so that the test above cannot fall behind."""
    from pathlib import Path

    sources = Path(__file__).resolve().parents[2] / "ros2_ws" / "src"
    told = set()
    for path in sources.glob("gearsim_*/gearsim_*/**/nodes/*.py"):
        told |= set(re.findall(r"health\.report\(\s*\"([a-z ]+)\"", path.read_text()))
    assert told == {task for tasks in TASKS.values() for task in tasks}
