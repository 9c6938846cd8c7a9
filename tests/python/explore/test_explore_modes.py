"""The explorer's session where logs have no closed loop with torques: targets alone, and inverse dynamics."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_computed_torque import arm, moves

from axisight import Effect, Robot, simulate
from axisight.explore.answers import answer, rest
from axisight.explore.session import Session, Version
from axisight.logs import Log

MISSING = Effect("viscous_friction", 1, {"viscous_nm_s_rad": 0.02})
SAMPLE = 2e-3


def logs_of(robot: Robot, *, targets: bool) -> list[Log]:
    """Three moves of an arm with more friction: positions and targets alone, or positions and torques."""
    out = []
    for seed in range(3):
        reference = moves(2000, SAMPLE, seed)
        run = simulate(robot, reference, effects=[MISSING], noise_seed=seed)
        position, torque = run["position_rad"].values, run["torque_cmd_nm"].values
        target = np.vstack([np.zeros(2), np.cumsum(reference, axis=0)[:-1]]) * SAMPLE
        out.append(
            Log(
                name=f"move{seed}",
                sample_time_s=SAMPLE,
                time_s=np.arange(2000) * SAMPLE,
                torque_nm=np.full_like(torque, np.nan) if targets else torque,
                position_rad=position,
                source=Path(f"move{seed}"),
                position_ref_rad=target + run["motor_position_rad"].values[0] if targets else None,
            )
        )
    return out


@pytest.mark.parametrize("targets", [True, False], ids=["targets", "inverse dynamics"])
def test_a_cause_that_is_put_in_takes_its_gap_away(tmp_path: Path, targets: bool):
    robot = arm(tmp_path, sample=SAMPLE)
    logs = logs_of(robot, targets=targets)
    session = Session("moves", robot, logs[:2], logs[2:])
    assert session.view.compared == ("positions" if targets else "torques")
    assert session.view.mode == ("closed_loop" if targets else "inverse_dynamics")
    found = answer(session, 0, Version.of([MISSING]), {})
    assert found.now.gap[0] < 0.2 * found.given.gap[0]
    # Twice as much is as far off, the other way; under targets it moves otherwise, too.
    twice = replace(MISSING, parameters={"viscous_nm_s_rad": 0.04})
    off = session.see(0, Version.of([twice])).gap[0]
    assert off == pytest.approx(found.given.gap[0], rel=0.25 if targets else 0.05)
    for tab in ("against", "orders", "responses"):
        assert rest(session, found, 0, tab, "speed").problem == ""
