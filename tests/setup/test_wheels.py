"""Reading the lock files, and telling whole distributions from half-installed ones."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from gearsim_setup.wheels import block, clear_leftovers, damaged, missing, normal, pins

REQUIREMENT = re.compile(r"^([A-Za-z0-9._-]+)(\[[a-z,]+\])?\s*([=<>!]=?[^#\s]+)?\s*(?:#\s*(.+))?$")
LOCKS = ("requirements", "requirements-ros")


def put(site: Path, name: str, version: str, files: dict[str, str], record: bool = True) -> Path:
    """Install a made-up distribution the way pip does, RECORD last."""
    info = site / f"{name}-{version}.dist-info"
    info.mkdir(parents=True)
    rows = []
    for file, text in {**files, f"{info.name}/METADATA": f"Name: {name}\n"}.items():
        path = site / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        rows.append(f"{file},sha256=xyz,{len(text)}")
    if record:
        (info / "RECORD").write_text("\n".join([*rows, f"{info.name}/RECORD,,"]) + "\n")
    return info


def test_whole_distributions_are_left_alone(tmp_path: Path) -> None:
    put(tmp_path, "ruamel_yaml", "0.1", {"ruamel/yaml.py": "a = 1\n"})
    put(
        tmp_path,
        "ros_std_msgs",
        "5.0",
        {"share/x.cmake": "of the wheel", "__pycache__/x.pyc": "of the wheel"},
    )
    (tmp_path / "share/x.cmake").write_text("mended")
    (tmp_path / "__pycache__/x.pyc").unlink()
    put(tmp_path, "certifi", "2.0", {"cacert.pem": "theirs"})
    (tmp_path / "cacert.pem").write_text("theirs and those of this site")
    wanted = {"ruamel-yaml": "0.1", "ros-std-msgs": "5.0", "certifi": "2.0"}
    assert damaged(tmp_path, wanted) == []
    assert clear_leftovers(tmp_path, wanted) == 0
    assert missing(tmp_path, wanted) == []


def test_what_an_interrupted_pip_leaves_is_found_and_cleared(tmp_path: Path) -> None:
    put(tmp_path, "whole", "1.0", {"whole.py": "a"})
    put(tmp_path, "cut_off", "1.0", {"cut.py": "a"}, record=False)
    put(tmp_path, "empty_record", "1.0", {"e.py": "a"})
    (tmp_path / "empty_record-1.0.dist-info" / "RECORD").write_text("")
    put(tmp_path, "lost_file", "1.0", {"lost.py": "a"})
    (tmp_path / "lost.py").unlink()
    put(tmp_path, "short_file", "1.0", {"short.py": "abc"})
    (tmp_path / "short.py").write_text("a")
    (tmp_path / "~whole").mkdir()
    wanted = dict.fromkeys(("whole", "cut-off", "empty-record", "lost-file", "short-file", "absent"), "1.0")
    bad = ["cut_off", "empty_record", "lost_file", "short_file"]
    assert damaged(tmp_path, wanted) == [f"{name}-1.0.dist-info" for name in bad]
    assert clear_leftovers(tmp_path, wanted) == 5
    assert missing(tmp_path, wanted) == ["absent", "cut-off", "empty-record", "lost-file", "short-file"]
    assert (tmp_path / "whole.py").is_file()
    assert not (tmp_path / "~whole").exists()


def test_another_version_counts_as_missing_but_not_as_damaged(tmp_path: Path) -> None:
    put(tmp_path, "thing", "1.0", {"thing.py": "a"})
    (tmp_path / "thing.py").unlink()
    assert missing(tmp_path, {"thing": "2.0"}) == ["thing"]
    assert damaged(tmp_path, {"thing": "2.0"}) == []


def test_a_block_is_one_distribution_with_its_hashes(tmp_path: Path) -> None:
    lock = tmp_path / "x.lock"
    own = "set-up==2 \\\n    --hash=sha256:2 \\\n    --hash=sha256:3\n"
    lock.write_text(f"# head\na==1 \\\n    --hash=sha256:1\n{own}z==3 \\\n    --hash=sha256:4\n")
    assert block(lock, "set-up") == own


def requirements(root: Path, name: str) -> dict[str, tuple[str, str]]:
    found = {}
    for line in (root / f"{name}.in").read_text().splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        match = REQUIREMENT.match(line)
        assert match, line
        found[normal(match[1])] = (match[3] or "", match[4] or "")
    return found


@pytest.mark.parametrize("name", LOCKS)
def test_each_requirement_has_a_reason_and_a_fitting_pin(root: Path, name: str) -> None:
    from packaging.specifiers import SpecifierSet

    pinned = pins(root / f"{name}.lock")
    for distribution, (bounds, reason) in requirements(root, name).items():
        assert reason, f"{distribution} has no reason in {name}.in"
        assert distribution in pinned, f"{name}.lock lacks {distribution}: run gearsim_setup/relock.py"
        assert SpecifierSet(bounds).contains(pinned[distribution], prereleases=True)


@pytest.mark.parametrize("name", LOCKS)
def test_a_lock_is_a_plain_list_with_hashes_for_any_index(root: Path, name: str) -> None:
    text = (root / f"{name}.lock").read_text()
    lines = [line for line in text.splitlines() if line and not line.lstrip().startswith("#")]
    for line, following in zip(lines, [*lines[1:], ""], strict=True):
        if line.startswith(" "):
            assert re.fullmatch(r"    --hash=sha256:[0-9a-f]{64}( \\)?", line)
        else:
            assert re.fullmatch(r"[a-z0-9][a-z0-9.-]*==[A-Za-z0-9.+!]+ \\", line)
            assert following.startswith("    --hash=sha256:")
    assert "://" not in text


def test_both_locks_agree_where_they_meet(root: Path) -> None:
    program, ros = (pins(root / f"{name}.lock") for name in LOCKS)
    both = program.keys() & ros.keys()
    assert "numpy" in both
    assert {name: program[name] for name in both} == {name: ros[name] for name in both}


def test_what_the_lock_says_is_what_these_tests_run_on(root: Path) -> None:
    """Only where the tests run in the environment that set-up made from the locks."""
    import sys

    from gearsim_setup.main import is_ready
    from gearsim_setup.places import Places
    from gearsim_setup.route import find_route

    places = Places(root)
    if Path(sys.prefix) != places.venv or not is_ready(places, find_route(places)):
        pytest.skip("not running in the environment that ./gearsim made")
    wanted = {name: version for lock in LOCKS for name, version in pins(root / f"{lock}.lock").items()}
    assert missing(places.site_packages(), wanted) == []
