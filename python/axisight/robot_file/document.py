"""Write robots with identified values, and read them again.

The robot file describes the robot with its effects only, because its format refuses unknown keys. The
uncertainty is stored in two other places:

- For people: a comment ``# identified: ...`` in the robot file above the line of each value.
- For programs: a JSON file ``<name>.identified.json`` beside it, schema ``axisight.identified/2``, with
  values, standard errors, covariance and provenance.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticSerializationError

from axisight.effects import Effect, effect_info
from axisight.errors import InputError, RobotError
from axisight.robot import Robot, load_robot
from axisight.robot_file.checks import check_agreement, check_effects, checked_covariance
from axisight.robot_file.earlier import with_earlier_effects
from axisight.robot_file.effect_tables import changed_numbers, stated, stated_effects
from axisight.robot_file.identified import Identified, Provenance
from axisight.robot_file.sidecar import Sidecar, read_sidecar, sidecar_path, text_hash
from axisight.robot_file.text import Key, at, edited, same
from axisight.storage import write_whole

Array = NDArray[np.float64]

INERTIA = ("inertia_xx", "inertia_yy", "inertia_zz", "inertia_xy", "inertia_xz", "inertia_yz")
_PLACES: dict[str, tuple[tuple[str | int, ...], str]] = {
    **{f"origin_{x}": (("origin", k), "m") for k, x in enumerate("xyz")},
    **{f"axis_{x}": (("axis", k), "1") for k, x in enumerate("xyz")},
    "mass": (("link", "mass"), "kg"),
    **{f"com_{x}": (("link", "com", k), "m") for k, x in enumerate("xyz")},
    **{name: (("link", "inertia", k), "kg m^2") for k, name in enumerate(INERTIA)},
    "stiffness": (("stiffness",), "Nm/rad"),
    "damping": (("damping",), "Nm s/rad"),
    "motor_inertia": (("drive", "motor_inertia"), "kg m^2"),
    "viscous_friction": (("drive", "viscous_friction"), "Nm s/rad"),
}
# Units of the gains that a fit can find, by kind of controller; gains are not parameters of the robot.
_GAINS: Mapping[str, Mapping[str, str]] = {
    "pd_position": {"kp": "Nm/rad", "kd": "Nm s/rad"},
    "cascade_position": {"kv": "1/s", "kp": "Nm s/rad", "ki": "Nm/rad"},
}
_OF_COMPUTED_TORQUE = {"kp": "1/s^2", "kd": "1/s"}
_MARK = "# identified: "
_HEADER = "# identified by axisight"


def hash_file(path: Path | str) -> str:
    """Return the SHA-256 of a file in hexadecimal; raise InputError if the file cannot be read."""
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(f"path: expected a readable file, got {path}: {error}") from error


def write_identified(
    source: Robot | Path | str,
    target: Path | str,
    found: Identified,
    *,
    overwrite: bool = False,
) -> Path:
    """Write a robot with identified values and a sidecar with their uncertainty; return the sidecar's path.

    source
        The robot of the values: a file, the name of a preset, or a Robot. All text without a new value stays,
        with comments and number formats; a value equal to the old one also keeps its text. Effects become
        tables ``[[effect]]``, and a file with effects becomes ``axisight.robot/2``. Effects found replace the
        robot's effects of the same name and axis; ``found.removed`` are left out.
    target
        File to write; the sidecar is ``<stem>.identified.json`` in the same folder.
    found
        Values from `identified`. ``<joint>.inertia_scale`` multiplies the inertia in ``source``.
    overwrite
        Whether to replace files that exist.

    Each file is written whole or not at all, the sidecar first. The sidecar holds the hash of the robot file,
    which shows whether both belong together.

    Raises RobotError for values that no body has: mass or stiffness that is not positive, negative damping or
    friction (Coulomb friction of effects included), an inertia that is not positive definite or breaks the
    triangle inequality. Raises InputError for unknown names, axes that the robot does not have, values that
    differ from their effect, an invalid covariance, and files that exist.
    """
    robot = source if isinstance(source, Robot) else load_robot(source)
    check_effects(_all_effects(robot, found), robot.n_axes)
    check_agreement(found.names, found.values, found.effects)
    if found.covariance is not None:
        checked_covariance(found.covariance, len(found.names))
    path = Path(target)
    sidecar = sidecar_path(path)
    for file in (path, sidecar):
        if file.exists() and not overwrite:
            raise InputError(f"target: {file} exists: choose another name or pass overwrite=True")
    stamped = replace(
        found.provenance,
        created=found.provenance.created or datetime.now(UTC),
        axisight_version=found.provenance.axisight_version or version("axisight"),
    )
    found = replace(found, provenance=stamped)
    text = render(robot, found, sidecar.name)
    report = Sidecar.of(found, robot, text, path.name)
    try:
        dumped = report.model_dump_json(indent=1, by_alias=True)
    except PydanticSerializationError as error:
        raise InputError(f"provenance: expected settings of JSON types: {error}") from None
    write_whole(sidecar, dumped + "\n")
    write_whole(path, text)
    return sidecar


def render(robot: Robot, found: Identified, sidecar_name: str) -> str:
    """Return the text of ``robot`` with the values ``found``, verified by reading it back.

    The head comment refers to ``sidecar_name``.
    """
    effects = _all_effects(robot, found)
    text = stated(robot.toml, effects)
    document = tomllib.loads(text)
    changes, notes = _changes(robot, document, found)
    changes |= changed_numbers(document, effects)
    text = edited(text, changes, notes)
    text = _headed(_without_old(text, found), found, sidecar_name)
    _check(text, document, changes, effects)
    return text


def _all_effects(robot: Robot, found: Identified) -> list[Effect]:
    """Return the effects found, and those that the robot keeps, updated by the values found."""
    gone = {effect.label for effect in (*found.effects, *found.removed)}
    kept = []
    for effect in robot.effects:
        if effect.label not in gone:
            own = f"{effect.label}."
            pairs = zip(found.names, found.values.tolist(), strict=True)
            kept.append(
                effect.with_values({n.removeprefix(own): v for n, v in pairs if n.startswith(own)})
            )
    return [*found.effects, *kept]


def _changes(
    robot: Robot, document: dict[str, Any], found: Identified
) -> tuple[dict[Key, float], dict[Key, list[str]]]:
    """Return new values and comments by their place in the document."""
    changes: dict[Key, float] = {}
    notes: dict[Key, list[str]] = {}
    stands = _effect_places(document)
    before = {
        f"{effect.label}.{name}": old
        for effect in robot.effects
        for name, old in (effect.parameters or {}).items()
    }
    for name, value, error in zip(found.names, found.values, found.standard_errors, strict=True):
        if name in stands:
            effect_key, unit = stands[name]
            text = _note(name, value, error, unit, before.get(name))
            notes.setdefault(effect_key, []).append(text)
            continue
        gain = _gain_place(robot, document, name)
        if gain is not None:
            gain_key, unit = gain
            changes[gain_key] = float(value)
            old = float(at(document, gain_key))
            notes.setdefault(gain_key, []).append(_note(name, value, error, unit, old))
            continue
        joint, quantity = _place(robot, document, name)
        base: Key = ("joint", joint)
        if quantity == "inertia_scale":
            inertia: Key = (*base, "link", "inertia")
            if any((*inertia, k) in changes for k in range(6)):
                raise InputError(
                    f"{name}: expected either a scale or moments of one link, got both"
                )
            if value <= 0:
                raise RobotError(f"{name}: expected a positive factor, got {value}")
            for k, old in enumerate(at(document, inertia)):
                changes[(*inertia, k)] = float(old) * float(value)
            notes.setdefault(inertia, []).append(_note(name, value, error, "1", 1.0))
            continue
        key, unit = _PLACES[quantity]
        full = (*base, *key)
        if full in changes:
            raise InputError(f"{name}: expected either a scale or moments of one link, got both")
        if document["joint"][joint].get("motion") == "prismatic":
            unit = {"Nm/rad": "N/m", "Nm s/rad": "N s/m"}.get(unit, unit) if len(key) == 1 else unit
        old = float(at(document, full))
        changes[full] = float(value)
        notes.setdefault(full, []).append(_note(name, value, error, unit, old))
        _refuse(name, quantity, float(value), rigid="stiffness" not in document["joint"][joint])
    for place in {int(key[1]) for key in changes if key[0] == "joint"}:
        _refuse_inertia(document, changes, place)
    return changes, notes


def _gain_place(robot: Robot, document: dict[str, Any], name: str) -> tuple[Key, str] | None:
    """Return place and unit of a gain of a position controller by name (``j1.kp``); None for other names."""
    joint, _, gain = name.rpartition(".")
    units = _OF_COMPUTED_TORQUE if robot.computed_torque else _GAINS.get(robot.controller_kind, {})
    # The document may lack the gain: a cascade without an integral need not state it.
    if gain not in units or gain not in document["controller"] or joint not in robot.axis_names:
        return None
    return ("controller", gain, robot.axis_names.index(joint)), units[gain]


def _effect_places(document: dict[str, Any]) -> dict[str, tuple[Key, str]]:
    """Return place and unit of every effect parameter by its name in `Identified`.

    The place of a parameter that the file leaves out, as it is neutral, is the name of its effect.
    """
    out: dict[str, tuple[Key, str]] = {}
    for i, effect in enumerate(stated_effects(document)):
        for p in effect_info(effect.name).parameters:
            key = p.name if p.name in (effect.parameters or {}) else "name"
            out[f"{effect.label}.{p.name}"] = (("effect", i, key), p.unit)
    return out


def _place(robot: Robot, document: dict[str, Any], name: str) -> tuple[int, str]:
    joint_name, _, quantity = name.rpartition(".")
    names = [joint["name"] for joint in document["joint"]]
    if joint_name in names and quantity in (*_PLACES, "inertia_scale"):
        joint = names.index(joint_name)
        key = _PLACES.get(quantity, (("link", "inertia"), ""))[0]
        try:
            at(document, ("joint", joint, *key))
            return joint, quantity
        except (KeyError, TypeError):
            pass
    known = ", ".join(robot.parameters())
    raise InputError(
        f"found: expected parameters among {known}, inertia_xx.., "
        f"origin_x.. and axis_x.., got {name!r}"
    )


def _refuse(name: str, quantity: str, value: float, *, rigid: bool) -> None:
    positive = ("mass", "stiffness") if rigid else ("mass", "stiffness", "motor_inertia")
    if quantity in positive and not value > 0:
        raise RobotError(f"{name}: expected a positive number, got {value}")
    if quantity in ("damping", "viscous_friction", "motor_inertia") and value < 0:
        raise RobotError(f"{name}: expected no negative number, got {value}")


def _refuse_inertia(document: dict[str, Any], changes: dict[Key, float], joint: int) -> None:
    place: Key = ("joint", joint, "link", "inertia")
    if not any((*place, k) in changes for k in range(6)):
        return
    xx, yy, zz, xy, xz, yz = (
        changes.get((*place, k), float(old)) for k, old in enumerate(at(document, place))
    )
    moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    name = document["joint"][joint]["name"]
    if moments[0] <= 0:
        raise RobotError(
            f"{name}.inertia: expected a positive definite inertia, got principal moments {moments}"
        )
    # For a thin rod both sides are equal, so rounding may break the inequality.
    if moments[2] > (moments[0] + moments[1]) * (1 + 1e-9):
        raise RobotError(
            f"{name}.inertia: expected no principal moment above the sum of the others (no mass is "
            f"distributed so), got {moments}"
        )


def _check(
    text: str, before: dict[str, Any], changes: dict[Key, float], effects: list[Effect]
) -> None:
    """Raise RobotError unless the text, read back, has exactly the wanted values and effects."""
    wanted = before
    for key, value in changes.items():
        wanted = _replaced(wanted, key, value)
    own = Robot.from_toml(text).effects
    same_effects = {e.label: e for e in own} == {e.label: e for e in effects}
    if not same_effects or not _equal(tomllib.loads(text), wanted):
        raise RobotError(
            "source: its text cannot be edited faithfully; write it in plain TOML tables"
        )


def _equal(a: Any, b: Any) -> bool:
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_equal(a[k], b[k]) for k in a)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(_equal, a, b))
    if isinstance(a, float) or isinstance(b, float):
        return same(float(a), float(b))
    return bool(a == b)


def _replaced(node: Any, key: Key, value: float) -> Any:
    if not key:
        return value
    copy: Any = dict(node) if isinstance(node, dict) else list(node)
    copy[key[0]] = _replaced(node[key[0]], key[1:], value)
    return copy


def _note(name: str, value: float, error: float, unit: str, old: float | None) -> str:
    text = f"{_MARK}{name} = {value:.6g} {unit}"
    if np.isfinite(error):
        share = f" ({100 * error / abs(value):.2g} %)" if value else ""
        text += f", standard error {error:.2g}{share}"
    return text if old is None else f"{text}, before {old:.6g}"


def _without_old(text: str, found: Identified) -> str:
    """Return the text without the old head and without earlier comments on the same parameters."""
    kept, seen = [], set()
    names = set(found.names)
    # Upwards, because the comment nearest to the value is the new one.
    for line in reversed(text.splitlines(keepends=True)):
        bare = line.strip()
        if bare.startswith(_HEADER):
            continue
        if bare.startswith(_MARK):
            name = bare[len(_MARK) :].split(" = ")[0]
            if name in seen and name in names:
                continue
            seen.add(name)
        kept.append(line)
    return "".join(reversed(kept))


def _headed(text: str, found: Identified, sidecar_name: str) -> str:
    created = found.provenance.created
    when = created.date().isoformat() if created else "unknown date"
    method = " ".join(found.provenance.method.split())
    release = found.provenance.axisight_version
    return f"{_HEADER} {release}, {when}: {method}; see {sidecar_name}\n{text}"


def load_identified(path: Path | str, *, check: bool = True) -> Identified:
    """Return what `write_identified` wrote: values, uncertainty, provenance, and the robot.

    path
        The robot file, or its sidecar.
    check
        Whether to raise InputError if the robot file was edited after the sidecar was written.

    ``effects`` of the result are those of its ``robot``. A sidecar of version 1 holds effects that its robot
    file cannot state. The robot of the result has these effects as well, and `write_identified` states them
    in the robot file.

    Raises InputError for files that are missing, of another schema, or do not belong together. Raises
    RobotError for a faulty robot and for impossible effects.
    """
    given = Path(path)
    sidecar = given if given.name.endswith(".identified.json") else sidecar_path(given)
    report = read_sidecar(sidecar)
    if Path(report.robot).name != report.robot:
        raise InputError(f"{sidecar}: robot: expected a file beside it, got {report.robot!r}")
    robot = load_robot(sidecar.with_name(report.robot))
    if check and text_hash(robot.toml) != report.robot_sha256:
        raise InputError(_changed(sidecar, report.robot))
    source = report.provenance
    robot = with_earlier_effects(robot, report)
    names = tuple(p.name for p in report.parameters)
    values = np.array([p.value for p in report.parameters])
    errors = [np.nan if p.standard_error is None else p.standard_error for p in report.parameters]
    return Identified(
        names=names,
        values=values,
        standard_errors=np.array(errors),
        covariance=None
        if report.covariance is None
        else checked_covariance(report.covariance, len(names)),
        effects=robot.effects,
        robot=robot,
        provenance=Provenance(
            source.method,
            source.data,
            source.settings,
            _created(source.created, sidecar),
            source.axisight_version,
            source.notes,
        ),
    )


def _changed(sidecar: Path, robot: str) -> str:
    return (
        f"{sidecar}: the robot {robot} was changed after it was written: identify again, "
        "or pass check=False to take both as they are"
    )


def _created(text: str, sidecar: Path) -> datetime:
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        raise InputError(
            f"{sidecar}: provenance.created: expected an ISO date, got {text!r}"
        ) from None
