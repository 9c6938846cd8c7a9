"""A machine on a clock of its own, as logs show by themselves."""

import numpy as np
import pytest

from axisight import Effect
from axisight.gap import check_inputs
from axisight.gap.controller.clock_drift import with_drift
from axisight.gap.controller.other_controllers import other_controllers
from axisight.gap.gate.by_controller.closed_loop import check_closed_loop
from gap_data import HELD, PLAN, bare_axis, logs_of, scattered

DRY = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.05})


def shown(effects):
    return other_controllers(bare_axis(), logs_of(scattered(bare_axis(), 4), effects, PLAN))


@pytest.mark.parametrize("rate", [4e-4, -3e-5, 5e-3])
def test_a_drift_is_found_whatever_the_machine_has_besides(rate):
    (found,) = shown([Effect("clock_drift", None, {"relative_rate": rate}), DRY])
    assert found.effect.label == "clock_drift"
    value = found.values["relative_rate"]
    # Noise of the sensor, which the command follows too, blurs a drift by a few parts in a million.
    assert value.value == pytest.approx(rate, rel=5e-3, abs=2e-6)
    assert found.explained > 0.98


@pytest.mark.parametrize(
    "other",
    [
        Effect("controller_gain", 1, {"relative_proportional": 0.3, "relative_integral": -0.2}),
        Effect("velocity_filter", 1, {"time_constant_s": 3e-3}),
        Effect("sensor_delay", 1, {"delay_s": 1e-3}),
    ],
    ids=lambda e: e.name,
)
def test_what_else_a_controller_may_have_is_no_drift(other):
    assert "clock_drift" not in {x.name for x in shown([other])}


def test_one_clock_is_no_drift():
    assert shown([DRY]) == ()


def test_a_simulator_that_has_the_drift_misses_none():
    drift = Effect("clock_drift", None, {"relative_rate": 4e-4})
    logs = logs_of(bare_axis(), [drift], PLAN)
    assert other_controllers(bare_axis().with_effects([drift]), logs) == ()


def test_a_drift_moves_references_by_what_it_says():
    (log, *_) = logs_of(bare_axis(), [], PLAN, seconds=1.0)
    moved = with_drift(log, 1e-3).velocity_ref_rad_s[:, 0]
    assert log.velocity_ref_rad_s is not None
    original = log.velocity_ref_rad_s[:, 0]
    # A thousandth of a thousand samples is one, of five hundred half of one.
    assert moved[1000] == pytest.approx(original[1001])
    assert moved[500] == pytest.approx(0.5 * (original[500] + original[501]))
    np.testing.assert_array_equal(with_drift(log, 0.0).velocity_ref_rad_s[:, 0], original)


def test_a_drift_is_no_mistake_of_units():
    """Along moves a drift looks like a torque in another unit; it is said to be none."""
    robot, drift = bare_axis(), [Effect("clock_drift", None, {"relative_rate": -3e-4})]
    logs = logs_of(robot, drift, PLAN)
    assert any(check_closed_loop(robot, log) for log in logs)
    findings = check_inputs(robot, logs, logs_of(robot, drift, HELD, seconds=5.0))
    assert not {f.name for f in findings} & {"torque_scaled", "torque_off_control_law"}
