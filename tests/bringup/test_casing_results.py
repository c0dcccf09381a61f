"""What docs/casing_results.md claims, on records of a few seconds; and the command that writes that page."""

from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from gearsim_bringup.casing_results import RESULTS
from gearsim_bringup.casing_results.envelopes import BANDS_HZ, envelope_of, expected_hz, lines_of
from gearsim_bringup.casing_results.extended import compared
from gearsim_bringup.casing_results.mesh_lines import MESH_HZ, case_signal, clarity_of, force_per_error
from gearsim_bringup.casing_results.page import make_results, result
from gearsim_bringup.casing_results.records import FAULTS, IN_CASING, RATE_HZ, Records, Run
from gearsim_bringup.casing_results.sizes import GOOD, run_of, sizing_of
from gearsim_bringup.casing_results.spectra import RIG_SEED, band_levels, misfit_db
from gearsim_bringup.method_figures.style import LARGEST_BYTES
from gearsim_io.errors import InputError
from gearsim_io.page_marks import put_into

DOCS = Path(__file__).parents[2] / "docs"
SECONDS = 4.0


class Short(Records):
    """Records of a few seconds, made once."""

    def signal(self, run):
        short = {name: getattr(run, name) for name in run.__dataclass_fields__}
        return super().signal(Run(**{**short, "seconds": min(run.seconds, SECONDS)}))


@pytest.fixture(scope="module")
def records():
    return Short()


@pytest.mark.parametrize(("model", "band"), list(zip(IN_CASING, BANDS_HZ, strict=True)))
def test_localised_faults_show_in_the_envelope(records, model, band):
    """Lines that noise reaches once in 1e9; sidebands of the shaft about those of the inner race alone.

    The cage lags by 1 %, so balls pass the outer race 1 % less often, and the inner one as many times more.
    """
    healthy = records.signal(Run(model, FAULTS["healthy"]))
    for race in ("inner", "outer"):
        samples = records.signal(Run(model, FAULTS[race]))
        one = lines_of(samples, healthy, race, band)
        lag = 0.01 * expected_hz("outer")
        slipped = expected_hz(race) + (lag if race == "inner" else -lag)
        assert one.found_hz == pytest.approx(slipped, rel=1e-3)
        assert envelope_of(samples, band).line(one.found_hz, 0.5).false_alarm < 1e-9
        assert min(one.harmonics) > 10
        assert one.healthy < 10
        if race == "inner":
            assert min(one.sidebands) > 10
        else:
            assert max(one.sidebands) < 10


def test_spectra_are_compared_by_their_levels():
    """Twice the amplitude above 2 kHz is 6 dB off there, and nothing below."""
    noise = np.random.default_rng(1).standard_normal(10 * round(RATE_HZ))
    lines = np.fft.rfft(noise)
    frequency = np.fft.rfftfreq(noise.size, 1 / RATE_HZ)
    louder = np.fft.irfft(np.where(frequency > 2015, 2 * lines, lines), noise.size)  # nothing leaks below
    assert misfit_db(louder, noise) == pytest.approx((0.0, 0.0, 20 * np.log10(2), 20 * np.log10(2)), abs=0.06)
    middles, levels = band_levels(noise)
    assert middles[:2].tolist() == [50.0, 150.0]
    assert np.mean(levels[5:-5]) == pytest.approx(
        10 * np.log10(2 / RATE_HZ), abs=0.05
    )  # white, unit variance


def test_the_casing_brings_what_the_lumped_model_misses(records):
    """From 2 to 4 kHz, against forces through the responses of all modes to 20 kHz, of another specimen."""
    full = records.signal(Run("cb182", FAULTS["inner"], seed=RIG_SEED, path="frf"))
    lumped, casing = (misfit_db(records.signal(Run(m, FAULTS["inner"])), full)[2] for m in ("lpm34", "cb182"))
    assert casing < 0.5 * lumped, (casing, lumped)


@pytest.mark.parametrize("model", IN_CASING)
@pytest.mark.parametrize("state", ["extended_inner", "extended_outer"])
def test_extended_faults_stand_out_once_the_gears_are_removed(records, model, state):
    """The power spectrum hides them, the slice at their cyclic frequency after DRS shows them."""
    healthy, faulty = (records.signal(Run(model, FAULTS[name])) for name in ("healthy", state))
    one = compared(faulty, healthy, state)
    assert one.after_db[1] > 10
    assert (
        one.after_db[1] > one.before_db[1] + 6
    )  # without the gears, four times the power and more (13 to 26 dB)


def test_lines_of_the_mesh_are_as_clear_in_both_models_without_white_noise(records):
    """They hold the power of both; of what (4.17) adds the finite-element shafts pass most."""
    shipped, noisy = (
        [clarity_of(case_signal(records, model, case)) for model in IN_CASING]
        for case in ("as shipped", "white noise in the transmission error, (4.17)")
    )
    assert min(one.share for one in shipped) > 0.85
    assert min(min(one.heights_db) for one in shipped) > 15
    assert noisy[0].share > 0.3
    assert noisy[1].share < 0.1


def test_finite_shafts_pass_what_lumped_ones_keep_from_the_bearings():
    """Alike where both are still: k e at low frequency, e the error; 20 times the force above 6 kHz."""
    low, high = ([force_per_error(finite, at) for finite in (False, True)] for at in ((5.0,), (7e3, 8e3)))
    assert low[1] == pytest.approx(low[0], rel=0.2)
    assert min(high[1] / high[0]) > 20


def test_clarity_is_what_was_put_in():
    """Ten lines of unit power in white noise of 1e-4 per hertz: 36 dB over it in 2.5 Hz."""
    t = np.arange(8 * round(RATE_HZ)) / RATE_HZ
    tones = sum(np.sqrt(2) * np.sin(2 * np.pi * k * MESH_HZ * t + k) for k in range(1, 11))
    noise = np.sqrt(1e-4 * RATE_HZ / 2) * np.random.default_rng(2).standard_normal(t.size)
    one = clarity_of(tones + noise)
    assert one.heights_db == pytest.approx([10 * np.log10(1 / (1e-4 * 2.5))] * 10, abs=0.5)
    assert one.share == pytest.approx(10 / (10 + 1e-4 * RATE_HZ / 2), rel=0.03)


@pytest.mark.parametrize(
    ("model", "race", "width_mm"), [("cb146", "inner", 1.6), ("cb146", "outer", 1.2), ("cb182", "outer", 1.6)]
)
def test_spalls_are_sized_through_the_casing(records, model, race, width_mm):
    """Through paths with few zeros 1.2 mm on the outer race are told as 0.7 mm."""
    sizing = sizing_of(records.signal(run_of(model, race, width_mm, 31)), race)
    assert sizing.width is not None, sizing.reason
    assert sizing.width.value_m == pytest.approx(width_mm * 1e-3, rel=GOOD)


def test_the_page_gets_pictures_and_tables(tmp_path, records):
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- envelopes: begin -->\nold\n<!-- envelopes: end -->\nafter\n")
    files = make_results(records, tmp_path / "new", page, ("envelopes",), lambda *_: None)
    assert files == [tmp_path / "new" / "envelopes.png", page]
    text = page.read_text()
    assert text.startswith("before\n<!-- envelopes: begin -->\n| fault")
    assert text.endswith("|\n<!-- envelopes: end -->\nafter\n")
    assert "old" not in text
    pixels = matplotlib.image.imread(files[0])[:, :, :3]
    assert ((pixels[..., 0] > 0.6) & (pixels[..., 1] < 0.4)).sum() > 500


def test_what_is_wrong_is_told(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("<!-- sizes: begin -->")
    with pytest.raises(InputError, match="sizes: end"):
        put_into(page, "sizes", [])
    with pytest.raises(InputError, match="spectra"):
        result("spectrum")
    with pytest.raises(InputError, match="--records DIR"):
        _ = Records().full_casing


@pytest.mark.parametrize("name", RESULTS)
def test_every_result_is_on_the_page(name):
    text = (DOCS / "casing_results.md").read_text(encoding="utf-8")
    assert f"](images/casing/{name}.png)" in text
    assert f"<!-- {name}: begin -->\n|" in text
    assert (DOCS / "images" / "casing" / f"{name}.png").stat().st_size <= LARGEST_BYTES
