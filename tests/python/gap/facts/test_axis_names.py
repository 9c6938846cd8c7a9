"""Axes by the names of their joints, at their floor, and within what a re-fit may do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from axisight.gap.facts.axis_names import (
    axis_label,
    own_name,
    removed_by_refit,
    verdict_word,
    with_joints,
)
from axisight.gap.facts.result import AxisVerdict, Interval
from axisight.gap.verdict.headline import Facts, headline
from axisight.report.page import render_report
from diagnosis_data import explained, gap, of

UR = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint")
PLAIN = ("axis1", "joint_2", "J3")


def test_numbers_are_no_names():
    assert [own_name(i, PLAIN) for i in (1, 2, 3, 4)] == [""] * 4
    # Another number than that of the axis is worth telling.
    assert own_name(1, ("joint_2",)) == "joint_2"
    assert axis_label(3, UR) == "3 (elbow_joint)"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("on axis 3, on axis 3", "on axis 3 (elbow_joint), on axis 3"),
        ("Axis 3: backlash. Axis 3", "Axis 3 (elbow_joint): backlash. Axis 3"),
        ("on axes 1 and 3.", "on axes 1 (shoulder_pan_joint) and 3 (elbow_joint)."),
        ("axes 1, 2, 3 and 4", "axes 1, 2, 3 and 4"),
        ("on axis 3 and 2 more effects", "on axis 3 (elbow_joint) and 2 more effects"),
        ("on axis 3, 2 others", "on axis 3 (elbow_joint), 2 others"),
        (
            "on axes 1 and 3 and 2 more effects",
            "on axes 1 (shoulder_pan_joint) and 3 (elbow_joint) and 2 more effects",
        ),
        (
            "on axes 1 and 3 and 12 others",
            "on axes 1 (shoulder_pan_joint) and 3 (elbow_joint) and 12 others",
        ),
        ("3 % on axis 30", "3 % on axis 30"),
    ],
)
def test_a_joint_stands_behind_the_first_mention_of_its_axis(text, told):
    assert with_joints(text, UR) == told
    assert with_joints(text, PLAIN) == text


def test_an_axis_without_a_gap_is_at_the_floor():
    assert verdict_word("explained", (1.18, 1.18, 1.18, 1.15)) == "at the floor"
    assert verdict_word("explained", (1.18, 1.4, 1.18, 1.15)) == "explained"
    assert verdict_word("explained", (1.18, float("nan"), 1.18, 1.15)) == "explained"
    assert verdict_word("unknown", (1.18, 1.18, 1.18, 1.15)) == "unknown"


def quiet():
    """The first axis at its floor, with a cause that acts on it."""
    found, axis = explained(), AxisVerdict(1, "explained", 0.0, 0.0, (0,))
    of_axes = replace(
        found.gap,
        before_per_axis=np.array([0.0118, 0.46, 0.3]),
        refitted_per_axis=np.array([0.0118, 0.43, 0.3]),
        floor_per_axis=np.array([0.0115, 0.05, 0.05]),
    )
    names = {**found.provenance, "axis_names": list(UR)}
    return replace(found, gap=of_axes, axes=(axis, *found.axes[1:]), provenance=names)


def test_tables_have_the_words_and_the_verdict_has_its_keys():
    found = quiet()
    assert next(row[1] for row in found.axis_rows()) == "at the floor"
    for page in (render_report(found), found._repr_html_()):
        assert "at the floor" in page
        assert "1 (shoulder_pan_joint)" in page
    assert found.to_verdict()["axes"][0]["verdict"] == "explained"


def test_what_a_refit_removes():
    floor = [0.1, 0.0129, 0.0577, 0.05]
    before = [0.095, 0.0525, 0.216, 0.2]
    # The last one keeps most of its gap.
    assert removed_by_refit(before, [0.093, 0.0125, 0.0532, 0.15], floor) == [3, 2]
    # 1.7 % above a floor of 1 % nobody sees.
    assert removed_by_refit([0.02], [0.01], [0.01]) == []


def refitted_gap():
    return replace(
        gap(0.169, 0.145, 0.145, 0.142, 3),
        before_per_axis=np.array([0.095, 0.0525, 0.216]),
        refitted_per_axis=np.array([0.093, 0.0125, 0.0532]),
        floor_per_axis=np.array([0.1, 0.0129, 0.0577]),
    )


def test_a_gap_within_tolerances_is_said():
    refit = {
        "elbow_joint.mass": Interval(0.03, 0.0076, 0.052),
        "other.mass": Interval(0.09, -0.1, 0.28),
    }
    text = headline(Facts("none", refitted_gap(), refit=refit, joints=UR))
    assert text == (
        "No unmodelled effect found. The gap of 21.6 % of the torque on axis 3 (elbow_joint), like that of axis 2 "
        "(shoulder_lift_joint), lies within the tolerances of the simulator's own parameters. Re-fitted "
        "(elbow_joint.mass +3 %), they leave 5.32 % there (noise alone: 5.77 %)."
    )
    page = render_report(replace(of("none"), gap=refitted_gap()))
    assert "within their tolerances removes the gap" in page
    assert "The simulator has no gap above the floor" not in page
    assert "The simulator has no gap above the floor" in render_report(of("none"))
    assert "tolerances" not in headline(Facts("none", of("none").gap))
