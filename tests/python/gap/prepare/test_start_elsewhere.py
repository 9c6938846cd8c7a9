"""One error at the start of every log, whatever the motion: the machine begins elsewhere than the simulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Log, Settings, diagnose
from axisight.fitting.divergence import must_hold
from axisight.gap.intake.start_of_logs import loops_of
from axisight.gap.prepare.start_elsewhere import begins_elsewhere, compared_later, said
from axisight.gap.views.closed_loop import ClosedLoopView
from gap_data import bare_axis, log_of, reference

ROBOT = bare_axis()
SETTINGS = Settings(threads=1)
FRICTION = Effect("coulomb_friction", 1, {"coulomb_nm": 0.4, "smoothing_rad_s": 0.1})
SECONDS = 6.0


def at_once(seed: int) -> np.ndarray:
    """A multisine that begins with its full speed, another one for each seed."""
    n = round(SECONDS / ROBOT.sample_time_s)
    return reference("multisine", seed, n + 1000, ROBOT.sample_time_s)[1000:] + 0.5 * seed


def swing(log: Log, size_nm: float, *, fades_s: float = 0.15) -> Log:
    """Return a log whose torque has a swing of 8 Hz that fades."""
    wave = size_nm * np.exp(-log.time_s / fades_s) * np.sin(2 * np.pi * 8.0 * log.time_s)
    return replace(log, torque_nm=log.torque_nm + wave[:, None])


def logs(effects: list[Effect], change: Callable[[Log, int], Log], count: int = 3) -> list[Log]:
    return [change(log_of(ROBOT, effects, at_once(k), k), k) for k in range(1, count + 1)]


CASES = {
    "one swing": (lambda log, _: swing(log, 2.0), True),
    "none": (lambda log, _: log, False),
    "that does not fade": (lambda log, _: swing(log, 2.0, fades_s=100.0), False),
    "another one in each log": (lambda log, k: swing(log, [2.0, -2.0, 0.7][k - 1]), False),
    "in one log": (lambda log, k: swing(log, 2.0 if k == 1 else 0.0), False),
    "within the scatter": (lambda log, _: swing(log, 1e-3), False),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("effects", [[], [FRICTION]], ids=["complete", "friction"])
def test_a_swing_that_all_logs_share_is_a_start_elsewhere(name, effects):
    change, expected = CASES[name]
    made = logs(effects, change)
    view = ClosedLoopView(ROBOT, made, SETTINGS)
    fitted = must_hold(view.fitter.fit([]))
    floor = view.floor.expected[fitted.axis] * fitted.samples
    assert begins_elsewhere(ROBOT, made, fitted, floor, SETTINGS) is expected
    # Two logs, or one reference in all of them, leave open whether the motion makes the error.
    assert not begins_elsewhere(ROBOT, made[:2], fitted.part([0, 1]), floor, SETTINGS)
    same = [replace(log, velocity_ref_rad_s=made[0].velocity_ref_rad_s) for log in made]
    assert not begins_elsewhere(ROBOT, same, fitted, floor, SETTINGS)


def test_a_log_of_one_block_tells_nothing():
    made = [log.part(0.0, 1.2) for log in logs([], CASES["one swing"][0])]
    view = ClosedLoopView(ROBOT, made, SETTINGS)
    fitted = must_hold(view.fitter.fit([]))
    floor = view.floor.expected[fitted.axis] * fitted.samples
    one = not any((fitted.log == k).sum() > 1 for k in range(len(made)))
    assert not (one and begins_elsewhere(ROBOT, made, fitted, floor, SETTINGS))


def test_logs_are_compared_where_the_start_is_forgotten():
    made = logs([], lambda log, _: log)
    later = compared_later(loops_of(ROBOT), made)
    assert later is not None
    for before, after in zip(made, later, strict=True):
        # Nothing is lost: what is not compared leads the simulation from rest.
        assert np.array_equal(after.led("torque_nm"), before.torque_nm)
        assert np.array_equal(after.led("velocity_ref_rad_s"), before.velocity_ref_rad_s)
        assert 0 < after.lead < before.n_samples / 2
    assert f"from {later[0].lead * ROBOT.sample_time_s:.4g} s" in said(later).message
    # Too little would be left.
    assert compared_later(loops_of(ROBOT), [log.part(0.0, 1.05) for log in made]) is None


def test_a_start_elsewhere_hides_no_cause():
    made = logs([FRICTION], lambda log, _: swing(log, 2.0), count=4)
    found = diagnose(ROBOT, made[:3], validation=made[3], settings=SETTINGS)
    assert [c.label for c in found.causes][:1] == ["coulomb_friction@1"]
    assert found.verdict == "explained"
    assert "begins_elsewhere" in {f.name for f in found.findings}
    value = found.causes[0].parameters["coulomb_nm"]
    assert value.low <= 0.4 <= value.high
