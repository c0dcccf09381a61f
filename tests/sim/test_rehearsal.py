"""What a machine cannot do is refused before anything is compiled, also where it comes only later."""

import pytest

from gearsim_io.errors import InputError
from gearsim_sim.rehearsal import rehearse
from gearsim_sim.scenario import load_scenario, parse_scenario
from gearsim_sim.simulation import Simulation

POINT = {"speed": "10 Hz", "load": "50 N*m"}
WIDE = {"kind": "outer_race_spall", "component": "bearing_3", "params": {"width_m": 0.8}}


@pytest.fixture
def made(tmp_path):
    return lambda **content: parse_scenario({"operating_point": POINT, **content}, tmp_path / "mine.yaml")


@pytest.fixture
def uncompiled(monkeypatch):
    """An engine that nobody may make."""

    def forbidden(*_args, **_kwargs):
        raise AssertionError("compiled before it was checked")

    monkeypatch.setattr("gearsim_sim.engine.Engine.__init__", forbidden)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            {"faults": [WIDE]},
            r"mine\.yaml: fault bearing_3/outer_race_spall: width_m: got 800 mm",
        ),
        (
            {"timeline": [{"at": "5 s", "inject": WIDE}]},
            r"mine\.yaml: timeline, at 5 s: fault bearing_3/outer_race_spall: width_m: got 800 mm",
        ),
        (
            {"timeline": [{"at": "5 s", "set": {"speed": "400 Hz"}}]},
            r"mine\.yaml: timeline, at 5 s: operating point: speed_hz: got 400 Hz, expected 0 to",
        ),
        (
            {"timeline": [{"at": "5 s", "clear": {"id": "nothing"}}]},
            r"timeline, at 5 s: clear: fault_id: got nothing, expected a running fault \(there is none\)",
        ),
        ({"machine": "unsw_planetary"}, r"a scenario of this machine needs model: planetary18$"),
        ({"machine": "mfpt"}, r"a scenario of this machine needs model: bearing5$"),
        ({"model": "planetary18"}, r"as machine unsw_planetary has it; .* needs model: lpm34$"),
    ],
)
@pytest.mark.usefixtures("uncompiled")
def test_what_cannot_be_is_refused_before_compiling(made, content, words):
    scenario = made(**content)
    for refuse in (rehearse, Simulation):
        with pytest.raises(InputError, match=words):
            refuse(scenario)


@pytest.mark.parametrize("name", ["demo", "two_faults", "planetary_crack", "speed_ramp", "mfpt_outer"])
def test_what_can_be_is_left_alone(name):
    rehearse(load_scenario(name))
