"""A position that stops following its target is refused from that time on; late, soft and resting ones are not."""

from pathlib import Path

import numpy as np
import pytest
import scipy.signal
from numpy.typing import NDArray

from axisight import Log
from axisight.gap.gate.by_controller.stopped_following import check_stopped_following
from axisight.logs import lowpass

Array = NDArray[np.float64]

RATE_HZ = 200.0
TIME = np.arange(4000) / RATE_HZ
TARGET = 0.8 * np.sin(2.0 * TIME) + 0.3 * np.sin(5.3 * TIME)
OFF_S = 12.0


def log_with(position: Array, target: Array = TARGET, *, as_speed: bool = False) -> Log:
    rng = np.random.default_rng(2)
    given = np.gradient(target, TIME) if as_speed else target
    return Log(
        name="run",
        source=Path("run.parquet"),
        sample_time_s=1 / RATE_HZ,
        time_s=TIME,
        torque_nm=np.full((len(TIME), 1), np.nan),
        position_rad=position[:, None] + 1e-4 * rng.normal(size=(len(TIME), 1)),
        position_ref_rad=None if as_speed else given[:, None],
        velocity_ref_rad_s=given[:, None] if as_speed else None,
    )


def off_from(at_s: float, after: Array) -> Array:
    """Return positions that follow with a delay of 20 ms up to a time, and then ``after`` (n,) from where they are."""
    late = np.interp(TIME - 0.02, TIME, TARGET)
    k = int(at_s * RATE_HZ)
    return np.concatenate([late[:k], late[k] + after[: len(TIME) - k]])


FALLS = -0.9 * (1.0 - np.exp(-3.0 * TIME) * np.cos(6.0 * TIME))


@pytest.mark.parametrize("after", [np.zeros(len(TIME)), FALLS], ids=["stays", "falls"])
@pytest.mark.parametrize("as_speed", [False, True])
def test_a_motor_that_goes_off_is_refused_with_its_time(after: Array, as_speed: bool) -> None:
    """The log is cut before that time, by less than two stretches of 0.6 s."""
    (finding,) = check_stopped_following(log_with(off_from(OFF_S, after), as_speed=as_speed))
    assert finding.name == "stopped_following"
    assert finding.severity == "refuse"
    assert finding.axis == 1
    cut = float(finding.message.split("--to ")[1].rstrip(")"))
    assert OFF_S - 1.2 <= cut <= OFF_S


def answered(target: Array, loop_hz: float) -> Array:
    """Return the position of a loop of second order (n,), damped by 0.7, for a target."""
    w, step = 2 * np.pi * loop_hz, 1 / RATE_HZ
    transfer = scipy.signal.cont2discrete(([w**2], [1.0, 1.4 * w, w**2]), step)
    return np.asarray(scipy.signal.lfilter(transfer[0].ravel(), transfer[1], target))


def sweep(first_hz: float, last_hz: float) -> Array:
    return 0.4 * np.asarray(scipy.signal.chirp(TIME, first_hz, TIME[-1], last_hz, phi=-90))


STEPPED = np.where(TIME < 12.0, 0.4 * np.sin(np.pi * TIME), 0.4 * np.sin(12 * np.pi * TIME))
BEND = np.where(TIME < OFF_S, TARGET, TARGET[int(OFF_S * RATE_HZ)])
FOLLOWED = {
    "exact": (TARGET, TARGET),
    "late by 0.2 s": (np.interp(TIME - 0.2, TIME, TARGET), TARGET),
    "soft": (np.asarray(lowpass(TARGET[:, None], 1 / RATE_HZ, 1.5))[:, 0], TARGET),
    "target rests, too": (BEND, BEND),
    "stands at a stop for a while": (np.clip(TARGET, -0.5, 0.5), TARGET),
    "off for two seconds": (np.where((TIME > 8) & (TIME < 10), TARGET[1600], TARGET), TARGET),
    "stuck all the time": (np.zeros(len(TIME)), TARGET),
    "elastic": (TARGET + 0.1 * np.sin(40.0 * TIME), TARGET),
    "a fast sine in the end": (answered(STEPPED, 3.0), STEPPED),
    "a sweep beyond the loop": (answered(sweep(0.1, 10.0), 2.0), sweep(0.1, 10.0)),
    "never moved": (np.zeros(len(TIME)), np.zeros(len(TIME))),
}


@pytest.mark.parametrize("kind", FOLLOWED)
def test_what_follows_to_the_end_is_taken(kind: str) -> None:
    position, target = FOLLOWED[kind]
    assert check_stopped_following(log_with(position, target)) == []


def test_logs_without_targets_are_taken() -> None:
    log = log_with(TARGET)
    bare = Log(
        name="run",
        source=log.source,
        sample_time_s=log.sample_time_s,
        time_s=log.time_s,
        torque_nm=log.torque_nm,
        position_rad=log.position_rad,
    )
    assert check_stopped_following(bare) == []
