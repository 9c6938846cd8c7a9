"""A part of a log: the samples asked for, and nothing shifted."""

from pathlib import Path

import numpy as np
import pytest

from axisight.errors import InputError
from axisight.logs import Log

T = 1e-3
N = 5000


def a_log(**more) -> Log:
    rng = np.random.default_rng(0)
    return Log(
        name="run",
        source=Path("run.parquet"),
        sample_time_s=T,
        time_s=T * np.arange(N),
        torque_nm=rng.normal(size=(N, 2)),
        position_rad=rng.normal(size=(N, 2)),
        velocity_ref_rad_s=rng.normal(size=(N, 2)),
        **more,
    )


def test_a_part_holds_the_samples_between():
    log = a_log(period_s=1.5, excitation="multisine", notes=("resampled",))
    part = log.part(0.75, 3.0)
    for name in ("torque_nm", "position_rad", "velocity_ref_rad_s"):
        np.testing.assert_array_equal(getattr(part, name), getattr(log, name)[750:3000])
    np.testing.assert_array_equal(part.time_s, T * np.arange(2250))
    assert part.velocity_rad_s is None
    assert (part.name, part.excitation, part.period_s) == ("run", "multisine", 1.5)
    assert part.notes == ("resampled", "from 0.75 s to 3 s")


def test_parts_put_together_are_the_log():
    log = a_log()
    # 2.3 s are 2299.9999999999995 sample times.
    parts = [log.part(0.0, 2.3), log.part(2.3)]
    np.testing.assert_array_equal(np.vstack([p.torque_nm for p in parts]), log.torque_nm)
    assert log.part(0.0, 60.0).n_samples == N


def test_a_part_shorter_than_the_period_is_not_periodic():
    log = a_log(period_s=2.0)
    assert log.part(0.5, 2.5).period_s == 2.0
    assert log.part(0.5, 2.4).period_s is None


@pytest.mark.parametrize(
    ("times", "words"),
    [
        ((-1.0, None), "start_s: expected a number not below zero, got -1.0"),
        ((np.nan, None), "start_s: expected a number not below zero, got nan"),
        (("now", None), "start_s: expected a number not below zero, got 'now'"),
        ((0.0, 0.0), "stop_s: expected a positive number, got 0.0"),
        ((3.0, 2.0), "start_s: expected less than 2 s, got 3 s"),
        ((5.0, None), "start_s: expected less than 5 s, got 5 s"),
        ((1.0, 1.9), "start_s, stop_s: expected at least 1 s between, got 0.9 s of the log"),
        ((4.5, 9.0), "start_s, stop_s: expected at least 1 s between, got 0.5 s of the log"),
    ],
)
def test_what_is_no_part_is_refused(times, words):
    with pytest.raises(InputError, match=f"^{words}$"):
        a_log().part(*times)
