"""Friction that yields before it slips: bristles that stick, and bristles that steps follow."""

import numpy as np
import pytest

from axisight import Effect, diagnose
from axisight.gap.prepare.stiff_bristles import with_bristles_followed
from gap_data import HELD, PLAN, bare_axis, logs_of, scattered

LUGRE = Effect(
    "presliding_friction",
    1,
    {
        "coulomb_nm": 0.4,
        "static_ratio": 2.0,
        "stribeck_speed_rad_s": 3.0,
        "presliding_rad": 0.05,
        "bristle_time_s": 1e-3,
    },
)
MACHINE = scattered(bare_axis(), 4)


def test_how_friction_breaks_away_is_found():
    """Recovery: without a break-away the bristles leave a part of what they explain that no other law mends."""
    out = diagnose(
        robot=bare_axis(),
        estimation=logs_of(MACHINE, [LUGRE], PLAN),
        validation=logs_of(MACHINE, [LUGRE], HELD),
    )
    assert (out.verdict, [c.label for c in out.causes]) == ("explained", [LUGRE.label])
    truth = LUGRE.parameters or {}
    found = out.causes[0].parameters
    for name in ("coulomb_nm", "static_ratio", "stribeck_speed_rad_s"):
        assert found[name].low <= truth[name] <= found[name].high, name
    # Four times what another rounding of the corner makes of a break-away.
    assert found["static_ratio"].low > 1.2
    assert out.gap.after < 1.05 * out.gap.floor


@pytest.mark.parametrize(("relaxation", "told"), [(0.0, True), (1e-4, True), (1e-3, False)])
def test_bristles_slip_no_faster_than_a_step(relaxation: float, told: bool):
    given = LUGRE.with_values({"relaxation_s": relaxation})
    robot, findings = with_bristles_followed(bare_axis().with_effects([given]))
    (effect,) = robot.effects
    step = robot.sample_time_s
    assert (effect.parameters or {})["relaxation_s"] == max(relaxation, step)
    assert [f.name for f in findings] == ["bristles_slowed"] * told
    others = {k: v for k, v in (effect.parameters or {}).items() if k != "relaxation_s"}
    assert others == {k: v for k, v in (given.parameters or {}).items() if k != "relaxation_s"}


def test_a_simulator_of_fast_bristles_is_diagnosed():
    """Over 4 mrad at 40 rad/s they slip five times faster than a step of Runge-Kutta stands."""
    fast = LUGRE.with_values({"presliding_rad": 0.004, "bristle_time_s": 1e-4})
    out = diagnose(
        robot=bare_axis().with_effects([fast]),
        estimation=logs_of(MACHINE, [fast], PLAN),
        validation=logs_of(MACHINE, [fast], HELD),
    )
    assert out.verdict == "none"
    assert "bristles_slowed" in [f.name for f in out.findings]
    assert np.isfinite(out.gap.after)
