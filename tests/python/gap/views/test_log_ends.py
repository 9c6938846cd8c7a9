"""Logs that begin or end in motion: no low-pass knows the torque before and after them."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, diagnose
from axisight.gap.facts.settings import Settings
from axisight.gap.signals.motion import Filtering
from axisight.gap.views.inverse_dynamics import InverseView
from gap_data import PLAN, bare_axis, logs_of, scattered

HELD = {"fresh": ("multisine", 9), "other": ("multisine", 4)}
CUTOFF_HZ = 3.0


def part(log, start, stop=None):
    """Return a part of a log without its references, which nothing simulates."""
    names = ("time_s", "torque_nm", "position_rad")
    cut = {name: getattr(log, name)[start:stop] for name in names}
    return replace(log, velocity_ref_rad_s=None, **cut)


@pytest.fixture(scope="module")
def logs():
    return logs_of(scattered(bare_axis(), 4), [], PLAN | HELD)


def test_a_log_from_rest_to_rest_counts_as_a_whole(logs):
    still = logs[0].position_rad
    held = [np.repeat(still[[i]], 1000, axis=0) for i in (0, -1)]
    n = len(still) + 2000
    rests = replace(
        part(logs[0], 0),
        time_s=np.arange(n) * logs[0].sample_time_s,
        torque_nm=np.zeros((n, 1)),
        position_rad=np.concatenate([held[0], still, held[1]]),
    )
    np.testing.assert_array_equal(Filtering(CUTOFF_HZ).counted(rests), np.ones(n))


def test_an_end_in_motion_counts_for_nothing_until_it_is_forgotten(logs):
    log = part(logs[0], 1000)
    counts = Filtering(CUTOFF_HZ).counted(log)
    period = round(1 / (CUTOFF_HZ * log.sample_time_s))
    assert not counts[: int(1.5 * period)].any() and not counts[-int(1.5 * period) :].any()
    assert (counts[2 * period : -2 * period] == 1).all()
    assert ((counts >= 0) & (counts <= 1)).all()
    # Of a short log not more than a fifth is lost at either end.
    short = Filtering(CUTOFF_HZ).counted(part(logs[0], 1000, 3000))
    assert (short[540:-540] == 1).all()


def test_what_counts_of_a_part_is_what_the_whole_log_has_there(logs):
    """The end of the padding that is left is a thirtieth of it, which is about as large as the torque."""
    settings = Settings(cutoff_hz=CUTOFF_HZ)
    whole = replace(logs[0], velocity_ref_rad_s=None)
    cut = part(logs[0], 2000, 9000)
    torques = [
        InverseView(bare_axis(), [log], settings).measured(log)[:, 0] for log in (whole, cut)
    ]
    counts = Filtering(CUTOFF_HZ).counted(cut)
    off = np.abs(torques[1] - torques[0][2000:9000])
    size = np.abs(torques[0][2000:9000]).max()
    assert off[counts == 1].max() < size / 30
    # And it is needed: padded ends that counted would be off by as much as the torque itself.
    low = Filtering(CUTOFF_HZ).compared(cut.torque_nm, cut.sample_time_s)[:, 0]
    assert np.abs(low - torques[0][2000:9000]).max() > 0.5 * size


def test_nothing_is_unknown_in_logs_that_begin_and_end_in_motion(logs):
    cut = [part(log, 1000) for log in logs]
    said = diagnose(robot=bare_axis(), estimation=cut[:-2], validation=cut[-2:])
    assert (said.mode, said.verdict) == ("inverse_dynamics", "none")
    assert said.gap.refitted < 0.015
    assert any("in motion" in check for check in said.checks)


def test_a_cause_is_named_in_logs_that_begin_and_end_in_motion():
    friction = Effect("coulomb_friction", 1, {"coulomb_nm": 2.0, "smoothing_rad_s": 0.05})
    logs = logs_of(scattered(bare_axis(), 4), [friction], PLAN | HELD)
    cut = [part(log, 1000) for log in logs]
    said = diagnose(robot=bare_axis(), estimation=cut[:-2], validation=cut[-2:])
    assert [c.label for c in said.causes] == ["coulomb_friction@1"]
    assert said.causes[0].parameters["coulomb_nm"].value == pytest.approx(2.0, rel=0.1)
