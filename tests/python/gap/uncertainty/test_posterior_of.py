"""The posterior of a whole diagnosis: intervals of the verdict, held-out torque, rivals, variation between runs."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Settings, diagnose
from axisight.errors import InputError
from axisight.gap import verdict_schema
from axisight.posterior import from_datatree, sampled_robot, to_datatree
from gap_data import HELD, bare_axis, log_of, logs_of, reference, scattered
from rigid_arm import COULOMB_NM, VISCOUS, arm
from rigid_arm import log_of as rigid_log

FRICTION = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.05})
COULOMB = "coulomb_friction@1.coulomb_nm"
PLAN = {"a": ("multisine", 1), "b": ("moves", 0), "c": ("multisine", 3), "d": ("moves", 5)}
SETTINGS = Settings(bootstrap=100)


def held_out(machine, effects, seconds):
    """Return the validation logs, with other noise than the estimation logs."""
    number = int(seconds / machine.sample_time_s)
    return [
        log_of(machine, effects, reference(*wave, number, machine.sample_time_s), 50 + k, name)
        for k, (name, wave) in enumerate(HELD.items())
    ]


def told(found):
    out = found.to_verdict()
    del out["provenance"]["seconds"]
    return out


@pytest.fixture(scope="module")
def case():
    """Return simulator, machine, logs and the diagnosis of short logs of an axis with dry friction."""
    robot = bare_axis()
    machine = scattered(robot, 4)
    estimation = logs_of(machine, [FRICTION], PLAN, seconds=4.0)
    validation = held_out(machine, [FRICTION], 4.0)
    given = {"robot": robot, "estimation": estimation, "validation": validation}
    return given, machine, diagnose(**given, settings=SETTINGS, posterior=True)


def test_the_verdict_stays_as_it_is_and_threads_change_nothing(case):
    given, _, found = case
    plain = diagnose(**given, settings=replace(SETTINGS, threads=1))
    assert plain.posterior is None
    assert told(plain) == told(found)
    again = diagnose(**given, settings=replace(SETTINGS, threads=1), posterior=True)
    one, other = (to_datatree(x.posterior, draws=3) for x in (found, again))
    assert one.identical(other)
    assert "posterior" not in verdict_schema()["properties"]


def check_intervals(found):
    """Standard errors are those of the verdict; values differ by what its fits left to the optimum.

    A fit ends where the loss falls by less than 1e-4, at most three standard errors from the optimum here.
    """
    known = found.posterior.gaussian()
    fit = found.posterior.gaussian(formula_error=False)
    for cause in found.causes:
        for name, interval in cause.parameters.items():
            label = f"{cause.label}.{name}"
            one, p = known.sel(parameter=label), found.posterior.parameter(label)
            assert abs(float(one.value) - interval.value) <= 3 * float(
                fit.deviation.sel(parameter=label)
            )
            reach = 1.96 * float(one.deviation)
            assert (interval.low, interval.high) == pytest.approx(
                (max(interval.value - reach, p.lower), min(interval.value + reach, p.upper)),
                rel=1e-9,
                abs=1e-15,
            )
    for name in set(found.refit) & set(found.posterior.best.names):
        change, nominal = found.refit[name], found.posterior.simulated.nominal[name]
        one = fit.sel(parameter=name)
        reach = 1.96 * float(one.deviation) / abs(nominal)
        moved = (float(one.value) - nominal) / abs(nominal) - change.value
        assert abs(moved) <= 3 * reach / 1.96 + 1e-12
        assert reach == pytest.approx((change.high - change.low) / 2, rel=1e-9)


def test_intervals_are_those_of_the_verdict(case):
    _, _, found = case
    assert found.causes and found.refit
    check_intervals(found)


def test_by_inverse_dynamics():
    """Six axes with friction that follows another formula; a balanced fit has standard errors of its own."""
    robot = arm()
    logs = [rigid_log(robot, seed, COULOMB_NM, VISCOUS, 20.0) for seed in range(3)]
    found = diagnose(
        robot=robot, estimation=logs[:2], validation=logs[2:], settings=SETTINGS, posterior=True
    )
    assert found.mode == "inverse_dynamics" and len(found.causes) == 12
    check_intervals(found)
    assert 0.93 < found.posterior.held_out[0].attrs["inside"] < 0.975
    assert not any(x.varies for x in found.posterior.between_runs)


def test_the_band_holds_held_out_torque(case):
    _, _, found = case
    inside = [log.attrs["inside"] for log in found.posterior.held_out]
    assert len(inside) == 2 and all(0.93 < share < 0.97 for share in inside)
    one = found.posterior.held_out[0]
    assert one.sizes["time_s"] <= 2000 and one.sizes["draw"] == 50
    # The draws with noise have the width of the band.
    half = (one.high_torque_nm - one.low_torque_nm).values / 2
    scatter = one.simulated_torque_nm.std("draw").values
    assert np.sqrt(np.mean(scatter**2)) == pytest.approx(np.sqrt(np.mean(half**2)) / 1.96, rel=0.1)


def test_a_wrong_machine_leaves_the_band(case):
    """The counterpart: the band of one machine does not hold the torque of another."""
    given, machine, found = case
    other = held_out(machine, [FRICTION.with_values({"coulomb_nm": 2.0})], 4.0)
    measured = other[0].torque_nm[:: len(other[0].torque_nm) // 2000 or 1]
    band = found.posterior.held_out[0]
    n = band.sizes["time_s"]
    out = (measured[:n] < band.low_torque_nm.values) | (measured[:n] > band.high_torque_nm.values)
    assert out.mean() > 0.3
    del given


def test_samples_hold_the_truth(case):
    given, machine, found = case
    truth = {**machine.parameters(), COULOMB: 0.5, "coulomb_friction@1.smoothing_rad_s": 0.05}
    known = found.posterior.gaussian()
    for name in set(truth) & set(found.posterior.best.names):
        one = known.sel(parameter=name)
        # Four deviations.
        assert abs(float(one.value) - truth[name]) < 4 * float(one.deviation), name
    drawn = found.posterior.samples(1)
    made = sampled_robot(found.posterior, given["robot"], drawn)
    assert made.parameters()["axis1.stiffness"] == float(drawn["axis1.stiffness"][0])
    assert [e.label for e in made.effects] == ["coulomb_friction@1"]


def test_the_bootstrap_is_near_the_gaussian(case):
    """Sixteen stretches: a standard deviation is known to 18 %, and correlated parameters amplify that."""
    _, _, found = case
    fit = found.posterior.gaussian(formula_error=False)
    ratio = [
        found.posterior.bootstrap_std[n] / float(fit.deviation.sel(parameter=n))
        for n in found.posterior.best.names
    ]
    assert 0.8 < np.median(ratio) < 1.25
    assert min(ratio) > 0.4 and max(ratio) < 2.5


def test_friction_that_differs_from_run_to_run_varies():
    robot = bare_axis()
    machine = scattered(robot, 4)
    logs = []
    for run, (name, (kind, seed)) in enumerate(PLAN.items()):
        effect = FRICTION.with_values({"coulomb_nm": (0.4, 0.55, 0.6, 0.45)[run]})
        wave = reference(kind, seed, int(4.0 / robot.sample_time_s), robot.sample_time_s)
        logs.append(log_of(machine, [effect], wave, run, name))
    held = held_out(machine, [FRICTION], 4.0)
    found = diagnose(
        robot=robot, estimation=logs, validation=held, settings=SETTINGS, posterior=True
    ).posterior
    varies = [x.parameter for x in found.between_runs if x.varies]
    assert varies == [COULOMB]
    # The four values have the standard deviation 0.091; the error of formulas is taken off.
    assert found.variation(COULOMB).std == pytest.approx(0.091, rel=0.3)
    # The validation logs are other runs, with friction amid that of the estimation logs.
    assert all(log.attrs["inside"] > 0.93 for log in found.held_out)
    wider = found.gaussian(between_runs=True).deviation.sel(parameter=COULOMB)
    assert float(wider) > float(found.gaussian().deviation.sel(parameter=COULOMB))


def test_without_causes_it_is_that_of_the_simulator():
    robot = bare_axis()
    machine = scattered(robot, 4)
    found = diagnose(
        robot=robot,
        estimation=logs_of(machine, [], PLAN, seconds=3.0),
        validation=held_out(machine, [], 3.0),
        settings=SETTINGS,
        posterior=True,
    )
    assert found.verdict == "none"
    assert found.posterior.best.causes == ()
    assert {p.kind for p in found.posterior.parameters} == {"own"}
    assert from_datatree(to_datatree(found.posterior, draws=2)).verdict == "none"


def test_rivals_that_stay_open_have_a_weight_and_values():
    """A delay of the drive and a second-order lag, which short logs of this kind do not tell apart."""
    robot = bare_axis()
    machine = scattered(robot, 4)
    effect = [Effect("input_delay", 1, {"delay_s": 1e-3})]
    logs = [log_of(machine, effect, lively(robot, k), k) for k in range(3)]
    found = diagnose(
        robot=robot, estimation=logs[:2], validation=logs[2:], settings=SETTINGS, posterior=True
    )
    posterior, (cause,) = found.posterior, found.causes
    assert found.verdict == "undecidable" and cause.effect == "input_delay"
    assert posterior.best.causes == (cause.label,)
    assert [h.causes for h in posterior.hypotheses[1:]] == [("current_loop@1",)]
    # Every rival has values, or a reason why it has none.
    assert set(cause.rivals) == {"current_loop@1", *posterior.without_values}
    first, second = (h.weight for h in posterior.hypotheses)
    assert first + second == pytest.approx(1) and 0.5 < first < 0.9
    # A lag of second order with the same delay of slow signals: 2 d T.
    lag = posterior.samples(400).where(lambda x: x.hypothesis == 1, drop=True)
    late = 2 * lag["current_loop@1.damping"] * lag["current_loop@1.time_constant_s"]
    assert float(late.mean()) == pytest.approx(1e-3, rel=0.1)
    assert 0.93 < posterior.held_out[0].attrs["inside"] < 0.985


def lively(robot, seed):
    """Return a velocity reference of 3 s: slow square wave and multisine, 1 to 8 Hz."""
    time = np.arange(int(3.0 / robot.sample_time_s)) * robot.sample_time_s
    lines = np.arange(1.0, 8.0, 0.5)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    wave = np.cos(2 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
    square = 3 * np.tanh(20 * np.sin(2 * np.pi * time / 3))
    return (np.minimum(time / 0.1, 1) * (wave / np.abs(wave).max() + square))[:, None]


def test_misuse(case):
    given, _, _ = case
    with pytest.raises(InputError, match="posterior: expected"):
        diagnose(**given, posterior="verdict.nc")
