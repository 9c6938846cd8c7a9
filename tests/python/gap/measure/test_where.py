"""Where the gap lies: bands and regimes found where an error was put."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Settings
from axisight.gap.fit.tolerance_edges import parameters_at_edge
from axisight.gap.measure.gap_figures import Stages, gap_figures, gap_reduction, stage
from axisight.gap.measure.where import ErrorLog, band_map, findings, led_by_weight, regime_maps
from axisight.gap.verdict.remainder import refit_worse, remainder_of
from axisight.logs import Log

T = 1e-3
N = 20_000


def a_log(torque: np.ndarray, position: np.ndarray) -> Log:
    return Log(
        name="log",
        source=Path("log.parquet"),
        sample_time_s=T,
        time_s=np.arange(len(torque)) * T,
        velocity_ref_rad_s=None,
        torque_nm=torque,
        position_rad=position,
    )


@pytest.fixture
def base() -> tuple[Log, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    time = np.arange(N) * T
    position = np.stack(
        [20 * np.sin(2 * np.pi * 0.3 * time), 10 * np.cos(2 * np.pi * 0.2 * time)], 1
    )
    torque = rng.normal(size=(N, 2)) + np.sin(2 * np.pi * 0.3 * time)[:, None]
    noise = 0.01 * rng.normal(size=(N, 2))
    error = 0.01 * rng.normal(size=(N, 2))
    return a_log(torque, position), error, noise


def test_a_tone_is_found_on_its_axis_and_in_its_band(base):
    log, error, noise = base
    error[:, 1] += 0.2 * np.sin(2 * np.pi * 9.0 * log.time_s)
    bands = band_map([ErrorLog(log, error, noise)], 1.0)
    assert float(bands.share.sel(axis=2, band="6-15 Hz")) > 0.95
    assert float(bands.significance.sel(axis=2, band="6-15 Hz")) > 10
    places = findings(bands, regime_maps([ErrorLog(log, error, noise)], 100.0, 1.0), 3.0)
    assert [p.axis for p in places] == [2]
    assert places[0].band_hz == (6.0, 15.0)


def test_the_axis_leads_whose_residual_is_far_above_noise(base):
    """A slow drift holds most of the plain error; what stands out of the noise is elsewhere."""
    log, error, noise = base
    error[:, 0] += 0.2 * np.sin(2 * np.pi * 0.2 * log.time_s)
    error[:, 1] += 0.03 * np.sin(2 * np.pi * 9.0 * log.time_s)
    bands = band_map([ErrorLog(log, error, noise)], 1.0)
    maps = (bands, regime_maps([ErrorLog(log, error, noise)], 100.0, 1.0), 3.0)
    places = findings(*maps)
    assert places[0].axis == 1
    assert led_by_weight(places, *maps, np.array([10.0, 25.0])) == places
    led = led_by_weight(places, *maps, np.array([10.0, 90.0]))
    assert [p.axis for p in led] == [2, 1]
    assert led[0].band_hz == (6.0, 15.0)
    assert "90 times the floor" in led[0].evidence
    assert sum(p.share for p in led) == pytest.approx(1.0)


def test_an_unknown_gap_has_its_axis_where_no_band_shows_it_steadily(base):
    log, error, noise = base
    error[:, 1] += np.where(log.time_s < 2.0, 1.0, 0.0)
    maps = (
        band_map([ErrorLog(log, error, noise)], 1.0),
        regime_maps([ErrorLog(log, error, noise)], 100.0, 1.0),
        30.0,
    )
    assert findings(*maps) == ()
    (place,) = led_by_weight((), *maps, np.array([0.0, 50.0]))
    assert (place.axis, place.band_hz, place.share) == (2, None, 1.0)


@pytest.mark.filterwarnings("error")
def test_a_log_of_a_single_block_is_sure_of_nothing(base):
    log, error, noise = base
    short = a_log(log.torque_nm[:1500], log.position_rad[:1500])
    bands = band_map([ErrorLog(short, error[:1500] + 0.5, noise[:1500])], 1.0)
    assert not bands.significance.any()
    assert float(bands.excess.sel(axis=1).isel(band=0)) > 100


def test_noise_alone_is_no_finding(base):
    log, error, noise = base
    bands = band_map([ErrorLog(log, error, noise)], 1.0)
    # 14 cells: three standard errors happen once in 700, so four is asked for here.
    assert float(bands.significance.max()) < 4.0
    # The lowest band holds two lines of each of ten blocks: a chi-square of 20 degrees over
    # another, which stays within a factor 3 in all but one case of a hundred.
    assert float(bands.excess.max()) < 3.0
    assert float(bands.excess.min()) > 1 / 3


def test_an_error_around_reversals_is_found_there(base):
    log, error, noise = base
    speed = np.gradient(log.position_rad[:, 0], T)
    error[np.abs(speed) < 0.5, 0] += 0.5
    maps = regime_maps([ErrorLog(log, error, noise)], 100.0, 1.0)
    assert float(maps["direction"].share.sel(axis=1, bin="around reversals")) > 0.8


def test_a_drift_is_found_in_time(base):
    log, error, noise = base
    error[:, 0] += 0.3 * (log.time_s > 14.0)
    maps = regime_maps([ErrorLog(log, error, noise)], 100.0, 1.0)
    assert float(maps["time"].share.sel(axis=1, bin="last third")) > 0.9


def test_shares_of_an_axis_sum_to_one(base):
    log, error, noise = base
    error += 0.1
    for data in regime_maps([ErrorLog(log, error, noise)], 100.0, 1.0).values():
        np.testing.assert_allclose(data.share.sum("bin"), 1.0)


def test_gap_is_the_root_mean_square_over_axes_and_logs(base):
    log, _, _ = base
    variance = log.torque_nm.var(axis=0)
    errors = [np.sqrt(variance) * np.array([0.3, 0.4]) * np.ones((N, 2))]
    given = stage([log], errors, 1.0)
    zero = stage([log], [np.zeros((N, 2))], 1.0)
    gap = gap_figures(Stages(given, given, zero, zero))
    assert gap.before == pytest.approx(np.sqrt((0.09 + 0.16) / 2))
    np.testing.assert_allclose(gap.before_per_axis, [0.3, 0.4])
    assert gap.after == 0.0


def test_pooled_is_the_norm_of_the_errors_over_that_of_the_torques(base):
    log, error, _ = base
    other = a_log(3.0 + log.torque_nm[:7000], log.position_rad[:7000])
    logs, errors = [log, other], [error, 2 * error[:7000]]
    every = np.vstack(errors)
    torque = np.vstack([x.torque_nm for x in logs])
    given = stage(logs, errors, 1.0)
    filtered = [0.5 * x.torque_nm for x in logs]
    half = stage(logs, errors, 1.0, filtered)
    zero = stage(logs, [0 * e for e in errors], 1.0)
    gap = gap_figures(Stages(given, half, zero, zero))
    # As papers give it: the Frobenius norms, with the mean torque in.
    assert gap.pooled.before == pytest.approx(np.linalg.norm(every) / np.linalg.norm(torque))
    assert gap.pooled.refitted == pytest.approx(2 * gap.pooled.before)
    assert (gap.pooled.after, gap.pooled.floor) == (0.0, 0.0)
    assert gap_figures(Stages(given, half, zero, zero), one_unit=False).pooled is None


def test_a_remainder_has_its_place(base):
    log, error, noise = base
    error[:, 1] += 0.2 * np.sin(2 * np.pi * 9.0 * log.time_s)
    given, floor = (stage([log], [x], 1.0) for x in (error, noise))
    stages = Stages(given, given, given, floor)
    gap = gap_figures(stages)
    left = remainder_of(stages, gap, [ErrorLog(log, error, noise)], Settings())
    assert left.gap == pytest.approx(np.sqrt(gap.after**2 - gap.floor**2))
    # The sine alone: 0.2 / sqrt(2) over the deviation of the torque.
    assert left.per_axis[1] == pytest.approx(0.2 / np.sqrt(2) / log.torque_nm[:, 1].std(), rel=0.02)
    assert left.per_axis[0] < 0.01
    assert [(w.axis, w.band_hz) for w in left.where] == [(2, (6.0, 15.0))]


def test_a_remainder_says_what_it_varies_with(base):
    log, error, noise = base
    error[:, 0] += 0.3 * (log.position_rad[:, 0] > 10.0)
    given, floor = (stage([log], [x], 1.0) for x in (error, noise))
    stages = Stages(given, given, given, floor)
    left = remainder_of(stages, gap_figures(stages), [ErrorLog(log, error, noise)], Settings())
    assert left.varies_with == "position"
    assert left.where[0].regime == "position: high"


@pytest.mark.parametrize("shared", [0.0, 1.0], ids=["own", "shared"])
def test_a_remainder_says_that_it_follows_another_axis(base, shared: float):
    """Friction of the sum of two speeds, as in a wrist whose drives share a gear; or of its own speed alone."""
    log, error, noise = base
    first, second = np.gradient(log.position_rad, T, axis=0).T
    error[:, 0] += 0.3 * np.tanh((first + shared * 3.0 * second) / 0.5)
    given, floor = (stage([log], [x], 1.0) for x in (error, noise))
    stages = Stages(given, given, given, floor)
    left = remainder_of(stages, gap_figures(stages), [ErrorLog(log, error, noise)], Settings())
    follows = left.varies_with is not None and "the speed of axis 2" in left.varies_with
    assert follows == bool(shared)


def test_a_remainder_in_a_few_stretches_has_its_axis_at_least(base):
    log, error, noise = base
    error[:, 0] += 0.5 * (log.time_s > 18.0)
    given, floor = (stage([log], [x], 1.0) for x in (error, noise))
    stages = Stages(given, given, given, floor)
    left = remainder_of(stages, gap_figures(stages), [ErrorLog(log, error, noise)], Settings())
    (place,) = left.where
    assert (place.axis, place.band_hz) == (1, None)
    assert place.share > 0.99
    assert "in no band steadily" in place.evidence


def test_noise_leaves_no_remainder(base):
    log, error, noise = base
    left, floor = (stage([log], [x], 1.0) for x in (error, noise))
    stages = Stages(left, left, left, floor)
    found = remainder_of(stages, gap_figures(stages), [ErrorLog(log, error, noise)], Settings())
    assert found.where == () and found.varies_with is None
    assert found.gap < 0.005


def test_a_refit_that_held_out_logs_contradict_is_said(base):
    log, error, noise = base
    given = stage([log, log], [3 * error, 3 * error], 1.0)
    worse = stage([log, log], [3 * error, 5 * error], 1.0)
    floor = stage([log, log], [noise, noise], 1.0)
    (found,) = refit_worse(Stages(given, worse, worse, floor), ["one", "other"])
    assert (found.name, found.log, found.severity) == ("refit_worse", "other", "flag")
    assert refit_worse(Stages(given, given, given, floor), ["one", "other"]) == ()
    assert refit_worse(Stages(worse, given, given, floor), ["one", "other"]) == ()


def test_a_simulation_that_broke_off_has_no_place(base):
    log, error, noise = base
    error[-10:] = np.nan
    broken, floor = (stage([log], [x], 1.0) for x in (error, noise))
    stages = Stages(broken, broken, broken, floor)
    found = remainder_of(stages, gap_figures(stages), [ErrorLog(log, error, noise)], Settings())
    assert np.isnan(found.gap) and found.where == ()
    # Nor where the run that tells the noise broke off.
    error[:] = 0.1
    left = stage([log], [error], 1.0)
    stages = Stages(left, left, left, floor)
    short = [ErrorLog(log, error, noise[:-500])]
    assert remainder_of(stages, gap_figures(stages), short, Settings()).where == ()


@pytest.mark.parametrize(
    ("change", "bound", "words"),
    [
        (0.02, False, None),
        (-0.046, False, "3.1 times its tolerance of 1.5 %"),
        (0.01, True, "at the bound of the fit"),
    ],
)
def test_a_parameter_at_the_edge_is_a_finding(change, bound, words):
    fitted = SimpleNamespace(
        robot_values={"axis1.mass": 100 * (1 + change), "axis2.mass": 50.0},
        ended_at_bound=((None, "axis1.mass"), (0, "coulomb_nm")) if bound else (),
    )
    nominal = {"axis1.mass": 100.0, "axis2.mass": 50.0}
    found = parameters_at_edge(fitted, nominal, {"mass": 0.015})
    assert [(f.name, f.field) for f in found] == (
        [("parameter_at_edge", "axis1.mass")] if words else []
    )
    assert all(words in f.message and f"{100 * change:+.3g} %" in f.message for f in found)


def test_gap_reduction_is_the_share_of_the_explainable_gap(base):
    log, _, _ = base
    rng = np.random.default_rng(5)
    wave = rng.normal(size=(N, 2))
    given, half, floor = (stage([log], [k * wave], 1.0) for k in (1.0, 0.5, 0.2))
    found = gap_reduction(given, half, given, floor, draws=300, seed=1)
    # (1 - 0.25) / (1 - 0.04); all blocks alike, so the interval is narrow.
    assert found.value == pytest.approx(0.75 / 0.96, rel=1e-9)
    assert found.low <= found.value <= found.high
    assert found.high - found.low < 0.01
    again = gap_reduction(given, half, given, floor, draws=300, seed=1)
    assert again == found
