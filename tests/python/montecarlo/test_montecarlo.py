"""Monte Carlo statistics: against NumPy, against the exact response, and what goes wrong."""

import tracemalloc

import numpy as np
import pytest
import scipy.linalg

import axisight
from axisight import InputError, StudyError, _core, load_robot
from axisight import montecarlo as mc
from axisight.montecarlo.design import compute_block, core_study, freeze
from montecarlo_data import RIPPLE, ROBOT, relative, robot_file, same_bits, small_study

EPSILON = np.finfo(float).eps


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    out = tmp_path_factory.mktemp("kept") / "out"
    study = small_study(statistics=mc.Statistics(keep_responses=True, quantiles=[0, 0.3, 0.5, 1]))
    result = mc.run(study, out=out)
    return result, mc.responses(out)


def test_means_match_numpy(kept):
    result, g = kept
    values = g.values
    n = len(values)
    # Sums of n terms round by n epsilon at most, relative to the largest term.
    tolerance = 10 * n * EPSILON
    assert relative(result.arithmetic_mean.values, values.mean(0)) < tolerance
    log = np.exp(np.log(np.abs(values)).mean(0))
    # Logarithms of a few units: their absolute error is the relative one of the mean.
    assert np.allclose(np.abs(result.log_mean), log, rtol=10 * tolerance, atol=0)
    direction = np.angle((values / np.abs(values)).mean(0))
    turn = np.exp(1j * (np.angle(result.log_mean.values) - direction))
    # A mean direction is known to epsilon over its length.
    length = np.abs((values / np.abs(values)).mean(0))
    assert np.all(np.abs(turn - 1) < tolerance / length)
    inverse = np.linalg.inv(values)
    harmonic = np.linalg.inv(inverse.mean(0))
    condition = max(np.linalg.cond(values).max(), np.linalg.cond(inverse.mean(0)).max())
    assert relative(result.harmonic_mean.values, harmonic) < tolerance * condition
    assert (result["count"] == n).all()


def test_covariance_and_standard_errors_match_numpy(kept):
    result, g = kept
    values = g.values
    n = len(values)
    re, im = values.real, values.imag
    close = {"rtol": 1e-9, "atol": 0}
    assert np.allclose(result.variance_real, re.var(0, ddof=1), **close)
    assert np.allclose(result.variance_imag, im.var(0, ddof=1), **close)
    product = ((re - re.mean(0)) * (im - im.mean(0))).sum(0) / (n - 1)
    scale = np.sqrt(re.var(0, ddof=1) * im.var(0, ddof=1))
    assert np.all(np.abs(result.covariance.values - product) < 1e-10 * scale)
    spread = np.sqrt((re.var(0, ddof=1) + im.var(0, ddof=1)) / n)
    assert np.allclose(result.standard_error, spread, **close)
    log = np.log(np.abs(values)).std(0, ddof=1) / np.sqrt(n)
    assert np.allclose(result.log_standard_error, log, **close)


@pytest.mark.parametrize("accuracy", [0.01, 0.001])
def test_quantiles_are_within_their_accuracy(accuracy, kept):
    _, g = kept
    statistics = mc.Statistics(quantiles=[0, 0.3, 0.5, 1], relative_accuracy=accuracy)
    result = mc.run(small_study(statistics=statistics))
    exact = np.quantile(np.abs(g.values), [0, 0.3, 0.5, 1], axis=0, method="lower")
    error = np.abs(result.magnitude_quantile.values / exact - 1)
    assert error.max() <= accuracy * (1 + 1e-9)
    assert error.max() > accuracy / 10  # the bound is used, not met by chance


def test_recovers_the_exact_response():
    # Twenty seconds of waiting: the slowest pole of the loop decays by 1.6 / s, to 1e-14.
    study = small_study(
        runs=1,
        effect=[],
        measurement=mc.Measurement(noise=False, waiting_periods=40, output="velocity"),
    )
    result = mc.run(study)
    frequency = result.frequency_hz.values
    robot = load_robot(study.robot)
    omega = 2 * np.pi * frequency
    true = robot.zoh_response(frequency).values * (1j * omega)[:, None, None]
    # Rounding of the propagated state is amplified by the resolvent.
    a, _, _ = robot.linearize()
    held = scipy.linalg.expm(a * robot.sample_time_s)
    z = np.exp(1j * omega * robot.sample_time_s)
    # (positions in rad, speeds in rad per sample, so that they compare).
    unit = np.repeat([1.0, robot.sample_time_s], len(a) // 2)
    held = held * unit[:, None] / unit
    condition = max(np.linalg.cond(v * np.eye(len(a)) - held) for v in z)
    tolerance = 10 * EPSILON * condition
    assert tolerance < 1e-7
    error = np.linalg.norm(result.arithmetic_mean.values - true, axis=(1, 2))
    assert (error / np.linalg.norm(true, axis=(1, 2))).max() < tolerance


@pytest.mark.parametrize("output", ["position", "velocity"])
def test_outputs_are_powers_of_i_omega_apart(output):
    results = {
        o: mc.run(small_study(runs=2, measurement=mc.Measurement(output=o)))
        for o in (output, "acceleration")
    }
    omega = 2 * np.pi * results[output].frequency_hz.values[:, None, None]
    factor = (1j * omega) ** {"position": 2, "velocity": 1}[output]
    got = results[output].arithmetic_mean.values * factor
    assert relative(got, results["acceleration"].arithmetic_mean.values) < 1e-13


def test_t2_and_hadamard_directions():
    clean = {"effect": [], "measurement": mc.Measurement(noise=False, waiting_periods=40)}
    multisine = small_study().excitation.multisine
    t2 = [[1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, -1.0]]
    means = [
        mc.run(
            small_study(
                runs=1, excitation=mc.Excitation(multisine=multisine, directions=d), **clean
            )
        ).arithmetic_mean.values
        for d in ("identity", "t2", t2)
    ]
    assert relative(means[1], means[0]) < 1e-8
    assert np.array_equal(means[1], means[2])
    with pytest.raises(StudyError, match=r"directions.*power of two"):
        mc.run(
            small_study(excitation=mc.Excitation(multisine=multisine, directions="hadamard")),
            runs=1,
        )


def test_runs_have_phases_of_their_own():
    core = core_study(freeze(small_study()))
    first, again, other, seeded = (
        core.reference(*key, 0) for key in [(7, 0), (7, 0), (7, 1), (8, 0)]
    )
    assert np.array_equal(first, again)
    assert not np.allclose(first, other)
    assert not np.allclose(first, seeded)
    square = core.reference(7, 0, 0)[:, 1]
    assert np.isclose(np.abs(first[:, 0] - square).max(), 8.0)
    assert np.isclose(square.max(), 9.6)
    # Flat spectrum on the lines of the band, nothing beside them.
    spectrum = np.abs(np.fft.rfft((first[:, 0] - square)[:1000]))
    lines = np.arange(2, 21)
    assert np.allclose(spectrum[lines], spectrum[2], rtol=1e-9)
    assert np.delete(spectrum, lines).max() < 1e-9 * spectrum[2]


def test_a_run_can_be_repeated_alone():
    """Noise stream ``run * n_axes + experiment``, references from the study."""
    keep = mc.Statistics(keep_responses=True)
    plant = mc.Plant(model="nonlinear", method="rk4", substeps=2)
    design = freeze(small_study(runs=1, effect=[], plant=plant, statistics=keep))
    core, run, waiting = core_study(design), 5, 1000
    u, y = [], []
    for experiment in range(3):
        log = axisight.simulate(
            load_robot(ROBOT),
            core.reference(7, run, experiment),
            noise_seed=7,
            run=run * 3 + experiment,
            method="rk4",
            substeps=2,
        )
        position = log.position_rad.values
        late = np.arange(750, 1000)
        drift = (position[late + waiting] - position[late]).mean(axis=0)
        straight = position[waiting:] - drift * (np.arange(1000) / 1000)[:, None]
        u.append(np.fft.fft(log.torque_cmd_nm.values[waiting:], axis=0)[2:21])
        y.append(np.fft.fft(straight, axis=0)[2:21])
    omega = 2 * np.pi * core.frequency_hz
    g = np.stack(y, -1) @ np.linalg.inv(np.stack(u, -1)) * -(omega**2)[:, None, None]
    assert relative(compute_block(design, 7, run, 1)["responses"][0], g) < 1e-8


def test_nonlinear_plant_is_close_to_the_linear_one():
    changes = {"runs": 2, "effect": [], "measurement": mc.Measurement(noise=False)}
    linear = mc.run(small_study(**changes))
    plant = mc.Plant(model="nonlinear", tolerance=1e-6)
    nonlinear = mc.run(small_study(plant=plant, **changes))
    difference = relative(nonlinear.arithmetic_mean.values, linear.arithmetic_mean.values)
    assert 1e-6 < difference < 0.2


def test_nonlinear_response_does_not_depend_on_its_block():
    plant = mc.Plant(model="nonlinear")
    design = freeze(
        small_study(plant=plant, statistics=mc.Statistics(keep_responses=True), block_runs=2)
    )
    together = compute_block(design, 7, 0, 2)["responses"]
    alone = compute_block(design, 7, 1, 1)["responses"]
    assert together[1].tobytes() == alone[0].tobytes()


def test_spread_of_parameters():
    spread = [mc.Spread(parameter="axis1.motor_inertia", distribution="uniform", relative=0.2)]
    changes = {"effect": [], "measurement": mc.Measurement(noise=False, waiting_periods=20)}
    varied = mc.run(small_study(spread=spread, runs=16, **changes))
    plain = mc.run(small_study(runs=16, **changes))
    # Well above the modes the motor inertia alone decides: 1/J varies by 20 % at most.
    ratio = (varied.magnitude_quantile / np.abs(plain.arithmetic_mean)).isel(frequency_hz=-1)
    ratio = ratio.sel(output=1, input=1).values
    assert 0.75 < ratio.min() < 0.97
    assert 1.03 < ratio.max() < 1.3
    assert varied.standard_error.max() > 100 * plain.standard_error.max()


def test_impossible_draws_are_recorded_with_their_run():
    spread = [mc.Spread(parameter="axis1.stiffness", relative=1.0)]
    study = small_study(spread=spread, runs=40, statistics=mc.Statistics(keep_responses=True))
    result = mc.run(study)
    failed = mc.failures(result)
    assert 0 < len(failed) < 40
    assert set(failed.kind) == {"invalid_parameters"}
    assert (failed.seed == 7).all()
    assert (result["count"] == 40 - len(failed)).all()
    alone = compute_block(freeze(study), 7, int(failed.run[0]), 1)
    assert np.isnan(alone["responses"]).all()


def test_spread_of_an_effect():
    spread = [mc.Spread(parameter="torque_ripple@1.sine_1_nm", absolute=0.5)]
    base = mc.run(small_study())
    varied = mc.run(small_study(spread=spread))
    assert not np.array_equal(base.arithmetic_mean, varied.arithmetic_mean)
    with pytest.raises(StudyError, match=r"spread\.parameter.*axis1\.stiffness"):
        mc.run(small_study(spread=[mc.Spread(parameter="axis9.stiffness", relative=0.1)]))


def test_spread_of_an_effect_names_its_joint(tmp_path):
    path = robot_file(tmp_path, 'name = "axis1"', 'name = "shoulder"')

    def varied(parameter: str):
        spread = [mc.Spread(parameter=parameter, absolute=0.5)]
        return mc.run(small_study(robot=path, spread=spread)).arithmetic_mean

    named = varied("torque_ripple@shoulder.sine_1_nm")
    assert np.array_equal(named, varied("torque_ripple@1.sine_1_nm"))
    with pytest.raises(StudyError, match=r"expected 1 to \d or a joint name .*shoulder"):
        varied("torque_ripple@shuolder.sine_1_nm")


def test_unstable_loop_is_recorded_run_by_run(tmp_path):
    path = robot_file(tmp_path, "kp = [7.039,", "kp = [-7.039,")
    result = mc.run(small_study(robot=path, runs=5))
    failed = mc.failures(result)
    assert failed.run.tolist() == list(range(5))
    assert (failed.seed == 7).all()
    assert set(failed.kind) <= {"diverged", "unstable"}
    assert (result["count"] == 0).all()
    assert np.isnan(result.arithmetic_mean).all()


def test_slowly_unstable_loop_is_noticed(tmp_path):
    """Far from overflow at the end of the record, and still no response."""
    path = robot_file(tmp_path, "ki = [178.6,", "ki = [-60.0,")
    result = mc.run(small_study(robot=path, runs=3))
    assert set(mc.failures(result).kind) == {"unstable"}


def test_a_failing_run_leaves_its_neighbours_alone():
    """Some draws are out of bounds; the other runs keep their bits, in company or alone."""
    wild = mc.EffectEntry(name="torque_constant", axis=1, parameters={"relative_error": 0.0})
    spread = [mc.Spread(parameter="torque_constant@1.relative_error", absolute=1.2)]
    keep = mc.Statistics(keep_responses=True)
    study = small_study(effect=[wild], spread=spread, statistics=keep, runs=16)
    design = freeze(study)
    block = compute_block(design, 7, 0, 16)
    failed = sorted({int(r) for r in block["failures"][:, 0]})
    assert 0 < len(failed) < 16
    for run in range(16):
        alone = compute_block(design, 7, run, 1)
        assert alone["responses"][0].tobytes() == block["responses"][run].tobytes()
        assert (len(alone["failures"]) > 0) == (run in failed)


def test_huge_ripple_gives_a_status_not_a_crash():
    ripple = RIPPLE.model_copy(update={"parameters": {"order_1": 3.0, "sine_1_nm": 9e3}})
    result = mc.run(small_study(effect=[ripple], runs=3))
    counted = int(result["count"].max())
    assert counted + mc.failures(result).run.nunique() == 3
    mean = result.arithmetic_mean.values
    assert np.isfinite(mean).all() if counted else np.isnan(mean).all()


def test_merging_is_associative():
    design = freeze(small_study(effect=[]))
    parts = [compute_block(design, 7, first, 5) for first in (0, 5, 10)]
    names = ("count", "moments", "bucket_start", "bucket", "bucket_count")

    def merged(*order):
        out = _core.MonteCarloEnsemble(19, 3, 0.01)
        for i in order:
            out.merge(*(parts[i][n] for n in names))
        return out.summary([0.1, 0.5, 0.9])

    a, b = merged(0, 1, 2), merged(2, 0, 1)
    assert np.array_equal(a["count"], b["count"])
    # Integer counts: exactly the same in any order.
    assert np.array_equal(a["magnitude_quantile"], b["magnitude_quantile"])
    assert relative(a["arithmetic_mean"], b["arithmetic_mean"]) < 1e-14
    assert np.allclose(a["variance_real"], b["variance_real"], rtol=1e-12)
    with pytest.raises(InputError, match="moments: expected"):
        _core.MonteCarloEnsemble(18, 3, 0.01).merge(*(parts[0][n] for n in names))


@pytest.mark.parametrize("threads", [2, 3])
def test_same_bits_on_any_number_of_threads(threads):
    same_bits(mc.run(small_study(), threads=threads), mc.run(small_study(), threads=1))


def test_memory_does_not_grow_with_runs():
    """What is held is a few blocks, whatever the runs; one set of responses is 2.7 kB."""

    def peak(runs: int) -> int:
        tracemalloc.start()
        mc.run(small_study(runs=runs, block_runs=4, effect=[]), threads=1)
        top = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return top

    peak(40)  # imports and caches
    few, many = peak(40), peak(400)
    # The list of blocks costs some 200 bytes each; keeping responses would cost 985 kB.
    assert many - few < 150_000


def test_response_does_not_depend_on_its_lane():
    design = freeze(small_study(statistics=mc.Statistics(keep_responses=True)))
    together = compute_block(design, 7, 0, 8)["responses"]
    for run in (0, 3, 7):
        alone = compute_block(design, 7, run, 1)["responses"]
        assert together[run].tobytes() == alone[0].tobytes()
