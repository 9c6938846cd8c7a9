"""Says which parameters of drives least squares can tell from the bodies of the arm."""

from __future__ import annotations

from axisight.errors import AxisightError, InputError
from axisight.robot import Robot


def told_from_bodies(robot: Robot, names: frozenset[str]) -> frozenset[str]:
    """Return those of the own parameters ``names`` that are base parameters by themselves.

    The rotor of a first axis turns as the bodies behind it do: only their sum shows in torques. Empty for a robot that
    is nearly degenerate, whose base parameters are not clear.
    """
    # Only diagnoses by inverse dynamics ask, and these modules load slowly.
    from axisight.rigid_body import USUAL_TERMS, base_parameters  # noqa: PLC0415

    try:
        base = base_parameters(robot, terms=USUAL_TERMS, locked=True)
    except InputError:
        raise
    except AxisightError:
        return frozenset()
    return names & {base.model.names[column] for column in base.columns}
