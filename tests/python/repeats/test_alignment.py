"""Runs of one motion are brought to a common start; other motions are refused."""

from dataclasses import replace

import numpy as np
import pytest

from axisight.errors import InputError, LogError
from axisight.repeats import align
from repeat_data import SAMPLE_TIME_S, log, motion


@pytest.mark.parametrize("samples", [-37, 1, 60])
def test_shift_is_found(samples):
    late = log("late", seed=1, start_s=-samples * SAMPLE_TIME_S)
    found = align([log(), late])
    assert found.shift[1] - found.shift[0] == samples
    np.testing.assert_allclose(found.logs[1].position_rad, found.logs[0].position_rad, atol=1e-9)
    assert len(found.logs[0].time_s) == len(motion()[0]) - abs(samples)


def test_references_decide_the_shift_if_all_runs_have_them():
    """The servo of the second run lags by 0.6 samples: its positions alone fit a shift of one sample."""
    _, v, _ = motion()
    logs = [log(), log("other", seed=1, start_s=-0.6 * SAMPLE_TIME_S)]
    assert align(logs).shift.tolist() == [0, 1]
    assert align([replace(x, velocity_ref_rad_s=v) for x in logs]).shift.tolist() == [0, 0]


def test_of_the_lags_of_a_periodic_motion_the_smallest_is_taken():
    """Two periods and a half of 2 pi / 1.6 s: a shift by a whole period fits as well."""
    t = SAMPLE_TIME_S * np.arange(2000)[:, None]
    rng = np.random.default_rng(0)
    periodic = [
        replace(
            log("x", seconds=10.0, seed=i),
            position_rad=40 * np.sin(1.6 * t + [0.3, 1.0]) + 1e-3 * rng.normal(size=(2000, 2)),
        )
        for i in range(2)
    ]
    assert align(periodic).shift.tolist() == [0, 0]


def test_axis_that_stands_still_is_no_other_motion():
    rng = np.random.default_rng(0)
    logs = [log("a"), log("b", seed=1)]
    held = [
        replace(x, position_rad=np.c_[x.position_rad[:, 0], 1e-5 * rng.normal(size=len(x.time_s))])
        for x in logs
    ]
    found = align(held)
    assert (found.difference[:, 1] == 0).all()


@pytest.mark.parametrize("axis", [0, 1])
def test_another_motion_is_refused(axis):
    other = log("other", seed=1)
    q = other.position_rad.copy()
    q[:, axis] *= 1.05
    with pytest.raises(InputError, match=f"other.csv: expected the motion.* on axis {axis + 1} "):
        align([log(), replace(other, position_rad=q)])


def test_what_cannot_be_compared_is_refused():
    with pytest.raises(InputError, match="two runs or more"):
        align([log()])
    with pytest.raises(InputError, match="different runs"):
        align([log("a"), log("b")])
    with pytest.raises(LogError, match="rates_differ"):
        align([log(), replace(log("b", seed=1), sample_time_s=0.004)])
    with pytest.raises(InputError, match="expected a logged torque"):
        align([log(), replace(log("b"), torque_nm=np.full((1600, 2), np.nan))])
    with pytest.raises(InputError, match="share 80 %"):
        align([log(), log("b", seed=1, start_s=3.0)])
    with pytest.raises(InputError, match="cutoff_hz"):
        align([log(), log("b", seed=1)], cutoff_hz=200.0)
