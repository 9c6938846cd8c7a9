"""Gaps beyond any share of a torque are told in words, not as numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from axisight.cli.show import _percent
from axisight.gap.facts.result import Remainder, Where
from axisight.gap.facts.wording import percent
from axisight.gap.measure.gap_beyond_torque import beyond_torque
from axisight.gap.verdict.remainder import reversals_smeared
from axisight.report import wording
from diagnosis_data import gap
from gap_data import bare_axis, log_of, reference


@pytest.mark.parametrize(
    ("share", "sentence", "cell", "page"),
    [
        (0.5, "50 %", "50 %", "50 %"),
        (10.0, "1e+03 %", "1e+03 %", "1000 %"),
        (40.6, "more than 1,000 %", "> 1,000 %", "> 1,000 %"),
        (np.inf, "no share", "-", wording.percent(np.inf)),
        (np.nan, "no share", "-", wording.percent(np.nan)),
    ],
)
def test_what_is_no_share_is_not_told_as_one(share, sentence, cell, page) -> None:
    assert percent(share) == sentence
    assert _percent(share) == cell
    assert wording.percent(share) == page


def test_the_reason_is_looked_for_in_the_torque() -> None:
    robot = bare_axis()
    good = log_of(robot, [], reference("moves", 0, 4000, robot.sample_time_s), 0)
    torque = good.torque_nm
    constant = replace(good, torque_nm=np.full_like(torque, 3.0))
    cut = replace(good, torque_nm=np.clip(torque, -0.3 * torque.max(), 0.3 * torque.max()))
    wide = gap(20.0, 20.0, 20.0, 0.1, 1)
    for log, reason in (
        (good, "gear ratio"),
        (constant, "hardly changes"),
        (cut, "cut at a limit"),
    ):
        (finding,) = beyond_torque(wide, [log])
        assert finding.name == "gap_beyond_torque"
        assert finding.axis == 1
        assert reason in finding.message
    (told,) = beyond_torque(replace(wide, compared="positions"), [good])
    assert told.field == "position_1"
    assert "the torque that the gains command along the logged positions" in told.message
    broke_off = replace(wide, before_per_axis=np.array([np.nan]))
    assert "broke off" in beyond_torque(broke_off, [good])[0].message
    assert beyond_torque(gap(0.5, 0.4, 0.3, 0.1, 1), [good]) == ()


def test_what_a_low_pass_smears_is_told_with_a_better_one() -> None:
    place = Where(2, 0.9, (2.0, 6.0), None, "")
    slow = replace(place, regime="speed: slow")
    left = Remainder(0.1, np.array([0.0, 0.1]), (place,))
    (finding,) = reversals_smeared(left, (slow,), 3.5)
    assert (finding.name, finding.axis) == ("reversals_smeared", 2)
    assert "Try --cutoff-hz 7" in finding.message
    # Elsewhere, in closed loop, and where nothing remains there is nothing to smear.
    assert reversals_smeared(left, (replace(slow, regime="speed: fast"),), 3.5) == ()
    assert reversals_smeared(left, (replace(slow, axis=1),), 3.5) == ()
    assert reversals_smeared(left, (slow,), None) == ()
    assert reversals_smeared(Remainder(0.0, np.zeros(2)), (slow,), 3.5) == ()
