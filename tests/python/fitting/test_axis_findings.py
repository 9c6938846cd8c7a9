"""What fits of an axis say against themselves: starts, units, errors, weights, curvature."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal, stats

from axis_data import RATIO, SAMPLE_S, START, TRUTH, TWO, record, torque
from axisight import _core
from axisight.errors import InputError
from axisight.graybox import (
    AxisData,
    AxisModel,
    FitSettings,
    axis_findings,
    fit_axis,
    multistart_axis,
)
from axisight.graybox.axis_checks import check_data, check_start, initial_speed
from axisight.graybox.axis_findings import scale_words, slow_share, start_findings
from axisight.graybox.axis_search import Point, Task
from axisight.identifiability import identifiability, of_covariance

POSITION = replace(TWO, output="position")
DIFFERENCE = replace(TWO, output="velocity_difference")
# From the truth the rough searches find nothing new.
NEAR = FitSettings(gradual=())
POLE = np.poly([0.95, 0.6])


def said(fit, words):
    return [text for text in fit.warnings if words in text]


def measured(model, position, u, name=""):
    """A record of positions and their backward differences."""
    velocity = np.diff(position, prepend=position[:1]) / SAMPLE_S
    return AxisData(u, velocity, position, sample_time_s=SAMPLE_S, name=name)


def clean(n, seed, model=POSITION):
    u = torque(n, seed)
    return u, model.simulate(TRUTH, u, SAMPLE_S).output.values


def cut(model, begin, n=3000, noise=1e-5):
    """A record that starts at sample ``begin`` of a motion, and the true speed there."""
    u, position = clean(n, 1)
    speed = POSITION.simulate(TRUTH, u, SAMPLE_S).states.values[:, 2]
    position = position + noise * np.random.default_rng(0).normal(size=n)
    # The first difference of a log is none.
    velocity = np.r_[0.0, np.diff(position[begin:])] / SAMPLE_S
    if model.output == "velocity":
        velocity = speed[begin:] + 0.05 * np.random.default_rng(0).normal(size=n - begin)
    data = AxisData(u[begin:], velocity, position[begin:], sample_time_s=SAMPLE_S, name="cut")
    return data, speed[begin]


@pytest.mark.parametrize("model", [TWO, DIFFERENCE, POSITION], ids=lambda m: m.output)
def test_start_in_motion_is_refused(model):
    data, speed = cut(model, 777)
    found, error = initial_speed(model, data, model.complete(TRUTH))
    # Four standard errors of noise, and what the unknown deflection of the spring bends the line:
    # speeds swing at up to 130 rad/s, (130 * 4 ms)^2 / 12 of the speed.
    assert abs(speed) > 3 and error < 0.1
    assert found == pytest.approx(speed, abs=4 * error + 0.03 * abs(speed))
    with pytest.raises(InputError, match=r"cut: expected a start at rest.*initial='free'"):
        fit_axis(model, data, START)
    with pytest.raises(InputError, match="expected a start at rest"):
        multistart_axis(model, data, START, n_starts=1)
    assert fit_axis(replace(model, initial="free"), data, TRUTH, settings=NEAR).converged


def test_speed_at_the_start_has_the_error_it_says():
    u, y = clean(1500, 1, TWO)
    rng = np.random.default_rng(1)
    values, found = TWO.complete(TRUTH), []
    for _ in range(400):
        noisy = AxisData(u, y + 0.05 * rng.normal(size=1500), sample_time_s=SAMPLE_S)
        found.append(initial_speed(TWO, noisy, values))
    speeds, errors = np.transpose(found)
    # Least squares by hand: the first of a line through 8 samples, (4 n - 2) / (n (n + 1)).
    exact = 0.05 * np.sqrt(30 / 72)
    # 400 draws show a standard deviation to 3.5 %; the larger of two noises is above the true one.
    assert np.std(speeds) == pytest.approx(exact, rel=4 * 0.035)
    assert exact < np.mean(errors) < 1.25 * exact
    assert abs(np.mean(speeds)) < 4 * exact / 20


def test_starts_at_rest_are_let_pass():
    # Torque jumps at the first sample, starts of the search up to a fifth off.
    for seed in range(60):
        rng = np.random.default_rng(seed)
        values = {n: v * 2 ** rng.uniform(-0.25, 0.25) for n, v in TRUTH.items()}
        # Torque held for a while, or for two samples only.
        u = torque(1200, seed, hold=40 if seed % 2 else 2)
        position = POSITION.simulate(TRUTH, u, SAMPLE_S).output.values
        velocity = TWO.simulate(TRUTH, u, SAMPLE_S).output.values
        step = 2 * np.pi / 4000
        for noise in (0.0, 1e-5, 1e-3):
            noisy = position + noise * rng.normal(size=1200)
            for one in (noisy, step * np.round(noisy / step)):
                for model in (POSITION, DIFFERENCE):
                    record = measured(model, one, u)
                    assert check_start(model, [record], model.complete(values)) == ()
        for noise in (0.0, 0.05, 3.0):
            data = AxisData(u, velocity + noise * rng.normal(size=1200), sample_time_s=SAMPLE_S)
            assert check_start(TWO, [data], TWO.complete(values)) == ()


def test_doubtful_starts_are_judged_by_a_free_start():
    long = record(n=4000, seed=1)
    slow = signal.lfilter([1], POLE, 0.05 * np.random.default_rng(3).normal(size=4500))[500:]
    # Slow noise looks like a speed at the first samples, but a free start does not fit better.
    noisy = AxisData(long.torque_nm, long.velocity_rad_s + slow, sample_time_s=SAMPLE_S)
    assert len(check_start(TWO, [noisy], TWO.complete(TRUTH))) == 1
    assert not said(fit_axis(TWO, noisy, TRUTH, settings=NEAR), "start in motion")
    # A tenth of the motion at the start does.
    size = np.std(long.velocity_rad_s)
    begin = 100 + int(np.argmin(np.abs(long.velocity_rad_s[100:1000] - 0.1 * size)))
    moving = AxisData(
        long.torque_nm[begin:], (long.velocity_rad_s + slow)[begin:], sample_time_s=SAMPLE_S
    )
    fit = fit_axis(TWO, moving, TRUTH, settings=NEAR)
    assert said(fit, "data set 1 seems to start in motion") and said(fit, "initial='free'")
    free = fit_axis(replace(TWO, initial="free"), moving, TRUTH, settings=NEAR)
    assert f"lowers the loss to {free.loss / fit.loss:.2g}" in said(fit, "start in motion")[0]


def test_doubts_stay_when_the_free_start_fails(monkeypatch):
    def diverges(*_):
        raise InputError("start: expected a motion that stays finite")

    task = Task(
        TWO, (record(n=100),), TWO.parameters, frozenset(TRUTH), {}, NEAR, doubts=("a", "b")
    )
    monkeypatch.setattr(axis_findings, "search", diverges)
    words = start_findings(task, Point(()), _core.CancelToken())
    why = "could not be judged: the free start failed (start: expected a motion that stays finite)"
    assert words == (f"a; {why}", f"b; {why}")


@pytest.mark.parametrize("model", [TWO, DIFFERENCE, POSITION], ids=lambda m: m.output)
def test_records_too_short_for_a_start_are_refused(model):
    _, position = clean(12, 1)
    short = measured(POSITION, position, torque(12, 1))

    def first(n):
        arrays = (short.torque_nm[:n], short.velocity_rad_s[:n], short.position_rad[:n])
        return AxisData(*arrays, sample_time_s=SAMPLE_S)

    with pytest.raises(InputError, match="data set 1: expected at least 9 samples, got 8"):
        fit_axis(model, first(8), TRUTH)
    assert np.isfinite(initial_speed(model, first(9), model.complete(TRUTH))).all()
    assert check_data(model, first(9))


@pytest.mark.parametrize("start", [START, TRUTH], ids=["start", "truth"])
@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (180 / np.pi, "degrees instead of radians"),
        (30 / np.pi, "revolutions per minute instead of rad/s"),
        (1 / (2 * np.pi), "revolutions instead of radians"),
        (RATIO, "the joint's side of the gear instead of the motor's"),
        (RATIO * 180 / np.pi, "degrees on the joint's side"),
    ],
)
def test_wrong_units_are_named(factor, words, start):
    good = noisy(4000, 1)
    wrong = replace(good, velocity_rad_s=factor * np.asarray(good.velocity_rad_s))
    fit = fit_axis(TWO, wrong, start, settings=NEAR)
    assert said(fit, words), fit.warnings
    assert said(fit, "as large as it is")
    assert not said(fit_axis(TWO, good, start, settings=NEAR), "as large as")


@pytest.mark.parametrize(("off", "seen"), [(1.1, True), (1.15, False)])
def test_how_far_the_start_may_be_off_for_degrees_on_the_joint(off, seen):
    good, factor = noisy(4000, 1), RATIO * 180 / np.pi
    wrong = replace(good, velocity_rad_s=factor * np.asarray(good.velocity_rad_s))
    start = TRUTH | {name: off * TRUTH[name] for name in ("J_m", "J_a")}
    # 0.2554 times 1.1186 is 1 / 3.5.
    assert bool(said(fit_axis(TWO, wrong, start, settings=NEAR), "degrees on the joint")) is seen


def noisy(n, seed, size=0.05, gain=6.0):
    return record(
        n=n, seed=seed, noise=size * np.random.default_rng([2, seed]).normal(size=n), size=gain
    )


def test_low_fit_is_told_unless_it_is_noise():
    good = noisy(4000, 1)
    missing = AxisModel(gear_ratio=RATIO, torque_offset=True)
    u = np.asarray(good.torque_nm)
    y = missing.simulate({**TRUTH, "u_0": 1.0}, u, SAMPLE_S).output.values
    fit = fit_axis(TWO, AxisData(u, y, sample_time_s=SAMPLE_S, name="loaded"), START)
    assert 5 < fit.fit_percent[0] < 50
    assert said(fit, f"does not fit: loaded {fit.fit_percent[0]:.1f} %")
    # Noise of 1.5 times the motion, from a model that is right.
    loud = fit_axis(TWO, noisy(4000, 1, size=18.0), TRUTH, settings=NEAR)
    assert loud.fit_percent[0] < 50 and not said(loud, "does not fit")


def test_factors_without_a_name_are_only_numbers():
    assert "?" not in scale_words(1e4, 1.0) and "about 1e+04 times" in scale_words(1e4, 1.0)
    assert "gear" not in scale_words(57.0, 1.0).split("?")[0]


def test_power_at_low_frequency_is_that_of_the_closed_form():
    rng = np.random.default_rng(5)
    data = [record(n=60_000)]
    for pole, wanted in ((0.0, 1.0), (0.8, 9.0), (-0.5, 1 / 3)):
        x = signal.lfilter([1], [1, -pole], rng.normal(size=60_000))
        # 500 lags of 60,000: sqrt(4 * 500 / (3 * 60,000)) = 10 %; the window takes 2 % at most.
        assert slow_share(data, [x]) == pytest.approx(wanted, rel=0.35)


def test_coloured_errors_move_the_trust_to_the_sandwich():
    settings = replace(NEAR, block_s=0.1)
    inside, white = [], []
    u, y = clean(8000, 3, TWO)
    for seed in range(25):
        slow = 0.02 * signal.lfilter([1], POLE, np.random.default_rng(seed).normal(size=8500))[500:]
        data = AxisData(u, y + slow, sample_time_s=SAMPLE_S)
        fit = fit_axis(TWO, data, TRUTH, settings=settings)
        assert fit.trusted == "sandwich" and said(fit, "prediction errors are not white")
        assert np.array_equal(fit.standard_error, np.sqrt(np.diag(fit.sandwich)))
        for name in fit.free:
            low, high = fit.interval(name)
            assert (low, high) == fit.interval(name, kind="sandwich")
            inside.append(low <= TRUTH[name] <= high)
            low, high = fit.interval(name, kind="white")
            white.append(low <= TRUTH[name] <= high)
    # 25 runs of seven correlated intervals: as good as 25 of them at worst, 95 +- 4.4 %.
    assert np.mean(inside) > 0.95 - 3 * 0.044 and np.mean(white) < 0.5
    # Student's quantile of 40 blocks less 7 parameters.
    low, high = fit.interval("k1")
    assert (high - low) / 2 == pytest.approx(stats.t.ppf(0.975, 33) * fit.standard_error[2])
    # Too few blocks, or blocks shorter than the correlation, tell nothing.
    for block_s in (0.5, 0.01):
        short = fit_axis(TWO, data, TRUTH, settings=replace(NEAR, block_s=block_s))
        assert short.trusted == "white" and said(short, "too short for blocks that tell")


def test_freedom_counts_everything_that_is_estimated():
    records = [noisy(3000, seed) for seed in range(3)]
    free = replace(TWO, initial="free")
    fit = fit_axis(free, records, TRUTH, settings=replace(NEAR, block_s=0.05))
    # Seven parameters and, for each record, one deflection and two speeds.
    assert fit.blocks == 90 and fit.sandwich_freedom == 90 - 7 - 9
    low, high = fit.interval("k1", kind="sandwich")
    half = stats.t.ppf(0.975, 74) * np.sqrt(fit.sandwich[2, 2])
    assert (high - low) / 2 == pytest.approx(half, rel=1e-9)


def test_variance_leaves_out_what_a_noise_filter_does():
    fit = fit_axis(TWO, coloured(0.005), TRUTH, noise_model="ar", settings=NEAR)
    (errors,) = fit.residuals
    order = len(fit.noise.whitening)
    assert order > 1 and not errors[:order].any()
    assert fit.error_std**2 == pytest.approx(errors @ errors / (4000 - order - 7), rel=1e-12)


def test_white_errors_are_trusted():
    for seed in range(12):
        fit = fit_axis(
            TWO, [noisy(6000, seed), noisy(6000, seed + 50, gain=3.0)], TRUTH, settings=NEAR
        )
        assert fit.warnings == () and fit.trusted == "white"
        assert np.array_equal(fit.standard_error, fit.std)
    # Variances 1 : 1.4 are more than chance, but cost nothing.
    mild = [noisy(6000, 1, size=0.05), noisy(6000, 2, size=0.06)]
    assert fit_axis(TWO, mild, TRUTH, settings=NEAR).warnings == ()


def test_unequal_noise_is_told_and_weighted():
    records = [noisy(4000, 1, size=0.02), noisy(4000, 2, size=0.2, gain=3.0)]
    fit = fit_axis(TWO, records, TRUTH, settings=NEAR)
    words = said(fit, "the residuals of data set 2 have")
    assert words and "weights='residuals'" in words[0]
    # Four blocks for each parameter by themselves; 8 are too few.
    assert fit.trusted == "sandwich" and 21 <= fit.blocks <= 28
    few = fit_axis(TWO, records, TRUTH, settings=replace(NEAR, block_s=0.5))
    assert few.trusted == "white" and np.isnan(few.sandwich).all()
    one, small = fit.noise_weights()
    # A variance from 4000 samples is known to 2.2 %, twice.
    assert one == 1 and small == pytest.approx(0.01, rel=4 * 0.032)
    assert f"the records the weights 1, {small:.3g}" in words[0]
    own = fit_axis(TWO, records, TRUTH, weights="residuals", settings=NEAR)
    given = fit_axis(
        TWO, [replace(d, weight=w) for d, w in zip(records, own.weights, strict=True)], TRUTH
    )
    assert own.weights == pytest.approx((1, 0.01), rel=4 * 0.032)
    assert np.allclose(own.values, given.values, rtol=1e-6)
    assert np.allclose(own.std, given.std, rtol=1e-6)
    assert not said(own, "residuals of") and own.std[3] < fit.std[3] / 2


def test_estimated_weights_give_right_intervals():
    signals = [(torque(3000, s, size=g), s) for s, g in ((1, 6.0), (2, 3.0))]
    outputs = [TWO.simulate(TRUTH, u, SAMPLE_S).output.values for u, _ in signals]
    distance, runs = 0.0, 60
    for run in range(runs):
        records = [
            AxisData(
                u,
                y + size * np.random.default_rng([run, s]).normal(size=3000),
                sample_time_s=SAMPLE_S,
            )
            for (u, s), y, size in zip(signals, outputs, (0.02, 0.2), strict=True)
        ]
        fit = fit_axis(TWO, records, TRUTH, weights="residuals", settings=NEAR)
        off = fit.values - [TRUTH[n] for n in fit.free]
        distance += off @ np.linalg.solve(fit.covariance, off)
    low, high = stats.chi2.ppf([5e-4, 1 - 5e-4], 7 * runs)
    assert low < distance < high


def test_differenced_positions_point_to_the_position():
    records, noise = [], 1.2e-5
    for seed, gain in ((1, 6.0), (2, 3.0)):
        u = torque(6000, seed, size=gain)
        position = POSITION.simulate(TRUTH, u, SAMPLE_S).output.values
        position = position + noise * np.random.default_rng(seed).normal(size=6000)
        records.append(measured(POSITION, position, u))
    fit = fit_axis(DIFFERENCE, records, TRUTH, settings=NEAR)
    assert said(fit, "differences of position noise") and said(fit, "AxisModel(output='position')")
    assert fit.trusted == "sandwich"
    direct = fit_axis(POSITION, records, TRUTH, settings=NEAR)
    assert direct.trusted == "white" and direct.warnings == ()
    # What the words promise: white errors, and narrower than either of the others.
    assert np.all(direct.std < fit.standard_error) and np.all(fit.standard_error < fit.std / 3)
    truth = np.array([TRUTH[n] for n in fit.free])
    for one in (fit, direct):
        assert np.all(np.abs(one.values - truth) < 4 * one.standard_error)


def coloured(size, n=4000, seed=6):
    white = np.random.default_rng(seed).normal(size=n + 500)
    return record(n=n, seed=3, noise=size * signal.lfilter([1], POLE, white)[500:])


def test_rounds_that_do_not_agree_are_a_status():
    hasty = replace(NEAR, ar_rounds=1)
    fit = fit_axis(TWO, coloured(0.005), TRUTH, noise_model="ar", settings=hasty)
    assert fit.status == "noise_rounds" and not fit.converged
    assert said(fit, "did not agree within FitSettings.ar_rounds")
    fit = fit_axis(TWO, coloured(0.005), TRUTH, noise_model="ar", settings=NEAR)
    assert fit.converged and not said(fit, "did not agree")
    # One more round changes nothing that counts.
    more = fit_axis(TWO, coloured(0.005), fit.parameters, noise_model="ar", settings=NEAR)
    assert np.all(np.abs(more.values - fit.values) < 0.1 * fit.std)


def test_a_loss_that_bends_is_told():
    small = fit_axis(TWO, coloured(0.001), TRUTH, noise_model="ar", settings=NEAR)
    assert not said(small, "linear model says")
    # Where the search stalls on the rough loss there are no such words, but a status.
    large = [
        fit_axis(TWO, coloured(0.05, seed=seed), TRUTH, noise_model="ar", settings=NEAR)
        for seed in (5, 6, 12)
    ]
    assert sum(f.converged and bool(said(f, "linear model says")) for f in large) >= 2


def test_information_of_a_real_fit_is_its_own():
    fit = fit_axis(TWO, noisy(4000, 1), TRUTH, settings=NEAR)
    found = identifiability(
        of_covariance(fit.covariance, dict(zip(fit.free, fit.values, strict=True)))
    )
    # The inverse of a matrix of this condition, twice.
    rtol = 1e-13 * fit.condition
    assert found.names == fit.free and found.rank == 7
    assert np.allclose(found.std, fit.std, rtol=rtol)
    assert np.allclose(found.correlation, fit.correlation, atol=rtol)
    # Its scales are the values, those of the fit the diagonal: the same inverse otherwise.
    relative = fit.covariance / np.outer(fit.values, fit.values)
    assert found.condition**2 == pytest.approx(np.linalg.cond(relative), rel=1e-6)
    unit = 1 / np.sqrt(np.diag(np.linalg.inv(relative)))
    scaled = identifiability(
        of_covariance(fit.covariance, dict(zip(fit.free, fit.values * unit, strict=True)))
    )
    assert scaled.condition**2 == pytest.approx(fit.condition, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "text"),
    [({"weights": "equal"}, "weights: expected given or residuals, got 'equal'")],
)
def test_misuse_is_named(change, text):
    with pytest.raises(InputError, match=text):
        fit_axis(TWO, record(n=200), START, **change)


def test_kind_of_interval_is_checked():
    with pytest.raises(InputError, match="kind: expected trusted, white or sandwich, got 'both'"):
        fit_axis(TWO, record(n=600), TRUTH, settings=NEAR).interval("k1", kind="both")
