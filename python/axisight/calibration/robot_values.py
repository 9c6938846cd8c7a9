"""A calibrated geometry as values of a robot file."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.calibration.geometry import errors_about, left_jacobian
from axisight.calibration.identify import Calibration
from axisight.errors import InputError
from axisight.robot_file import Identified, Provenance
from axisight.robot_file.sidecar import known
from axisight.robot_file.values import noted, values_of

Array = NDArray[np.float64]

FRAMES = ("tool", "base")
UNCHANGED = 1e-9
"""The measurements did not see a compliance that changed by less than this share."""


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

    The file then has the calibrated geometry without its offsets. The settings hold values without a
    place in the format under ``"no_place"``, each with ``value``, ``standard_error`` (null: unknown),
    ``unit`` and ``meaning``:

    - ``<joint>.offset``: add it to the joint angles, or offset over gear ratio to the motor's zero.
      Otherwise angles are off by the offset. The geometry cannot hold it, because its frames are
      parallel at angle zero: every later link and its inertia would have to turn.
    - Tool and base frames: positions ``tool.x`` to ``tool.z`` and rotation vectors
      ``tool.rotation_x`` to ``_z``, and likewise for ``base``.
    - ``<joint>.compliance`` of joints without a spring in the file.

    calibration
        Deviations of all identified groups are written. Standard errors are unknown for parameters
        that the measurements determine in combinations only. Compliances that the measurements do
        not see at all are left out.
    provenance
        Source of the values.

    The covariance follows from that of the deviations to first order. Raises InputError for another
    type, and for a compliance that is not positive, because no spring has one.
    """
    if not isinstance(calibration, Calibration):
        raise InputError(f"calibration: expected a Calibration, got {type(calibration).__name__}")
    names = [str(name) for name in calibration.table["parameter"].values]
    groups = _groups(names)
    rows: dict[str, tuple[float, Array]] = {}
    for j, joint in enumerate(calibration.geometry.joint_names):
        if "origin" in groups:
            for k, x in enumerate("xyz"):
                own = f"{joint}.origin_{x}"
                rows[own] = float(calibration.geometry.origin_m[j, k]), _unit(names, own)
        if "tilt" in groups:
            slopes = _axis_slopes(calibration, names, j)
            for k, x in enumerate("xyz"):
                rows[f"{joint}.axis_{x}"] = float(calibration.geometry.axis[j, k]), slopes[k]
        if "compliance" in groups:
            stiffness = _stiffness(calibration, j)
            if stiffness is not None:
                slope = -(stiffness**2) * _unit(names, f"{joint}.compliance")
                rows[f"{joint}.stiffness"] = stiffness, slope
    unplaced = _unplaced(calibration, groups)
    notes = [f"search: {calibration.status}", *([calibration.advice] if calibration.advice else [])]
    if unplaced:
        notes.insert(0, f"not written, no place in a robot file: {', '.join(unplaced)}")
    return values_of(
        {name: value for name, (value, _) in rows.items()},
        np.array([slope for _, slope in rows.values()]).reshape(len(rows), len(names)),
        calibration.covariance,
        noted(provenance, notes, unplaced),
    )


def _unit(names: list[str], name: str) -> Array:
    return np.array([float(other == name) for other in names])


def _stiffness(calibration: Calibration, joint: int) -> float | None:
    """Return the stiffness of a joint, None without a spring or if the measurements do not see it."""
    value = float(calibration.geometry.compliance_rad_nm[joint])
    before = float(calibration.nominal.compliance_rad_nm[joint])
    if before == 0.0 or np.isclose(value, before, rtol=UNCHANGED, atol=0.0):
        return None
    if value <= 0.0:
        raise InputError(
            "calibration: expected a positive compliance of "
            f"{calibration.geometry.joint_names[joint]}, got {value:.3g}: measure under two "
            "payloads, or identify without compliance"
        )
    return 1.0 / value


def _unplaced(calibration: Calibration, groups: set[str]) -> dict[str, Any]:
    """Return identified values without a place in a robot file, with error, unit and meaning."""
    geometry, table = calibration.geometry, calibration.table
    error = dict(
        zip(table["parameter"].values, np.sqrt(np.diag(calibration.covariance)), strict=True)
    )
    unit = dict(zip(table["parameter"].values, table["unit"].values, strict=True))
    out: dict[str, Any] = {}

    def add(name: str, value: float, spread: float, meaning: str) -> None:
        out[name] = {
            "value": float(value),
            "standard_error": known(float(spread)),
            "unit": str(unit[name]),
            "meaning": meaning,
        }

    for j, joint in enumerate(geometry.joint_names):
        before = calibration.nominal.compliance_rad_nm[j]
        if "compliance" in groups and geometry.compliance_rad_nm[j] and not before:
            name = f"{joint}.compliance"
            add(name, geometry.compliance_rad_nm[j], error[name], "compliance of a rigid joint")
    for j, joint in enumerate(geometry.joint_names):
        name = f"{joint}.offset"
        if name in error:
            add(name, geometry.offset_rad[j], error[name], "to be added to the joint angle")
    for frame in FRAMES:
        for k, x in enumerate("xyz"):
            name = f"{frame}.{x}"
            if name in error:
                add(name, getattr(geometry, f"{frame}_position_m")[k], error[name], "position")
        if f"{frame}.rotation_x" in error:
            vector, spread = _rotation_vector(calibration, frame)
            for k, x in enumerate("xyz"):
                add(f"{frame}.rotation_{x}", vector[k], spread[k], "rotation vector")
    return out


def _rotation_vector(calibration: Calibration, frame: str) -> tuple[Array, Array]:
    """Return the rotation vector (3,) of a frame [rad], and its standard errors."""
    names = [str(name) for name in calibration.table["parameter"].values]
    own = [names.index(f"{frame}.rotation_{x}") for x in "xyz"]
    matrix = getattr(calibration.geometry, f"{frame}_rotation")
    vector = np.asarray(
        scipy.spatial.transform.Rotation.from_matrix(matrix).as_rotvec(), dtype=np.float64
    )
    # dR = [J(deviation) d(deviation)]x R = [J(vector) d(vector)]x R.
    deviation = calibration.table["deviation"].values[own]
    slope = np.linalg.solve(left_jacobian(vector), left_jacobian(deviation))
    spread = calibration.covariance[np.ix_(own, own)]
    if not np.isfinite(spread).all():
        return vector, np.full(3, np.nan)
    return vector, np.sqrt(np.diag(slope @ spread @ slope.T))


def _groups(names: list[str]) -> set[str]:
    """Return the groups of the parameters called ``names``."""
    out = set()
    for name in names:
        owner, _, quantity = name.rpartition(".")
        out.add(owner if owner in FRAMES else quantity.split("_")[0])
    return out


def _axis_slopes(calibration: Calibration, names: list[str], joint: int) -> Array:
    """Return the derivatives (3, n_parameters) of a joint's axis by all deviations."""
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
