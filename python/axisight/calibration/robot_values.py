"""A calibrated geometry as values of a robot file."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.calibration.geometry import errors_about, left_jacobian
from axisight.calibration.identify import Calibration
from axisight.errors import InputError
from axisight.robot_file import Identified, Provenance
from axisight.robot_values import noted, values_of

Array = NDArray[np.float64]

FRAMES = ("tool", "base")
UNCHANGED = 1e-9
"""A compliance changed by less than this share was not seen by the measurements."""


def identified_geometry(calibration: Calibration, provenance: Provenance) -> Identified:
    """Return a calibrated geometry in the terms of a robot file, for `write_identified`.

    ============== =====================================================================
    calibrated     robot file
    ============== =====================================================================
    ``origin``     ``<joint>.origin_x`` to ``_z`` [m]
    ``tilt``       ``<joint>.axis_x`` to ``_z``, unit vector
    ``compliance`` ``<joint>.stiffness``, its inverse [Nm/rad], of joints that have one
    ``offset``     none: zero positions belong to the controller
    ``tool``       none: the format has no tool frame
    ``base``       none: the format has no base frame
    ============== =====================================================================

    The file then has the calibrated geometry but for its offsets, which were found along with it:
    add ``offset_rad`` of the settings' ``"no_place"`` to the joint angles, or offset over gear ratio
    to the motor's zero, or angles are off by them. They cannot be put into the geometry, whose
    frames are parallel at angle zero, without turning every link beyond and its inertia.
    Frames of tool and base stand there too, as positions and rotation matrices; and
    compliances of joints that the file has no spring for.

    calibration
        Its deviations are written for all groups that were identified. Those that the
        measurements determine in combinations only have unknown standard errors; compliances that
        they do not see at all are left out.
    provenance
        Where the values come from.

    The covariance of the deviations is carried through to first order. Raises InputError for another
    type and for a compliance that is not positive: no spring has it.
    """
    if not isinstance(calibration, Calibration):
        raise InputError(f"calibration: expected a Calibration, got {type(calibration).__name__}")
    geometry, nominal = calibration.geometry, calibration.nominal
    names = [str(name) for name in calibration.table["parameter"].values]
    groups = _groups(names)
    rows: dict[str, tuple[float, Array]] = {}
    unplaced: dict[str, Any] = {}
    unit = np.eye(len(names))
    for j, joint in enumerate(geometry.joint_names):
        for k, x in enumerate("xyz"):
            own = f"{joint}.origin_{x}"
            if own in names:
                rows[own] = float(geometry.origin_m[j, k]), unit[names.index(own)]
        if "tilt" in groups:
            slopes = _axis_slopes(calibration, names, j)
            for k, x in enumerate("xyz"):
                rows[f"{joint}.axis_{x}"] = float(geometry.axis[j, k]), slopes[k]
        own = f"{joint}.compliance"
        if own in names:
            at = names.index(own)
            value, before = float(geometry.compliance_rad_nm[j]), nominal.compliance_rad_nm[j]
            if before == 0.0:
                if value:
                    unplaced.setdefault("compliance_rad_nm", {})[joint] = value
            elif not np.isclose(value, before, rtol=UNCHANGED, atol=0.0):
                if value < 0.0:
                    raise InputError(
                        f"calibration: expected a positive compliance of {joint}, got {value:.3g}: "
                        "measure under two payloads, or identify without compliance"
                    )
                rows[f"{joint}.stiffness"] = 1.0 / value, -unit[at] / value**2
    if "offset" in groups:
        unplaced["offset_rad"] = {
            joint: float(geometry.offset_rad[j])
            for j, joint in enumerate(geometry.joint_names)
            if f"{joint}.offset" in names
        }
    for frame in FRAMES:
        if frame in groups:
            unplaced[f"{frame}_position_m"] = getattr(geometry, f"{frame}_position_m").tolist()
            unplaced[f"{frame}_rotation"] = getattr(geometry, f"{frame}_rotation").tolist()
    notes = [f"search: {calibration.status}", *([calibration.advice] if calibration.advice else [])]
    if unplaced:
        notes.insert(0, f"not written, no place in a robot file: {', '.join(unplaced)}")
    return values_of(
        {name: value for name, (value, _) in rows.items()},
        np.array([slope for _, slope in rows.values()]).reshape(len(rows), len(names)),
        calibration.covariance,
        noted(provenance, notes, unplaced),
    )


def _groups(names: list[str]) -> set[str]:
    """Groups of the parameters called ``names``."""
    out = set()
    for name in names:
        owner, _, quantity = name.rpartition(".")
        out.add(owner if owner in FRAMES else quantity.split("_")[0])
    return out


def _axis_slopes(calibration: Calibration, names: list[str], joint: int) -> Array:
    """Derivatives (3, n_parameters) of a joint's axis by all deviations."""
    errors = errors_about(calibration.nominal, ["tilt"], rotation=False)
    deviation = calibration.table["deviation"].values
    own = [
        (names.index(name), errors.tangents[joint, part])
        for name, (_, j, part) in zip(errors.names, errors.kinds, strict=True)
        if j == joint
    ]
    turn = left_jacobian(np.sum([deviation[at] * tangent for at, tangent in own], axis=0))
    out = np.zeros((3, len(names)))
    for at, tangent in own:
        out[:, at] = np.cross(turn @ tangent, calibration.geometry.axis[joint])
    return out
