"""Read the name of a column: quantity, measurement or target, unit, axis, motor or joint."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from axisight.logs.guessing.series import Series

_TOKEN = re.compile(r"[mk]Nm|m[AV](?![a-z])|[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")
_BRACKET = re.compile(r"[\[(]\s*(1/min|[^\])\d][^\])]*?)\s*[\])]")
# In A1 and J1 the letter means the axis, not ampere.
_AXIS_LETTER = re.compile(r"(?<![A-Za-z])[AaJj](?=\d|#)")


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


WORDS = {
    "error": "error err deviation",
    "acceleration": "acc accel acceleration accelerations ddq qdd qddot",
    "temperature": "temp temps temperature temperatures",
    "torque": "tau torque torques effort efforts eff moment moments trq torq force forces",
    "current": "current currents cur curr i iq amps",
    "voltage": "voltage voltages volt volts",
    "velocity": "dq qd qdot vel velocity velocities speed speeds omega dtheta qvel",
    "position": "q qm qpos pos position positions angle angles theta phi enc encoder",
    "time": "time times timestamp timestamps stamp t ts tm clock ipoc sec secs seconds ms msec us usec ns nsec",
}
"""Words for each quantity; if a name has words of several quantities, the first quantity wins."""
_QUANTITIES = {word: quantity for quantity, words in WORDS.items() for word in words.split()}
# Words that mean a position if the name has no word of a quantity; LeRobot has states and actions.
_PLACES = {"joint", "joints", "axis", "state", "action"}
_MEASURED = _words("actual act measured meas feedback fb present real ist")
_WANTED = _words(
    "target ref reference cmd command commanded des desired set setpoint goal soll planned action computed cmptd "
    "calc calculated"
)
# Signals that do not belong to an axis or are not measured: of the tool, computed by a model, bounds.
_OTHER = _words(
    "ext external tcp ee pose cartesian tool wrench hat gripper finger min max limit std var mode status "
    "ff grav gravity coriolis friction model init kin"
)
_MOTOR = _words("motor motors mot rotor")
_JOINT = _words("joint joints link gear arm se secondary output")

_UNITS = {
    "rad": "rad", "radian": "rad", "radians": "rad",
    "deg": "deg", "degs": "deg", "degree": "deg", "degrees": "deg", "°": "deg",
    "rev": "rev", "revs": "rev", "turns": "rev",
    "counts": "counts", "ticks": "counts", "inc": "counts", "incs": "counts",
    "mm": "mm",
    "rad s": "rad/s", "rad per s": "rad/s", "rad per sec": "rad/s", "radps": "rad/s",
    "deg s": "deg/s", "deg per s": "deg/s", "deg per sec": "deg/s", "degps": "deg/s", "° s": "deg/s",
    "rpm": "rpm", "rev s": "rev/s", "rev per s": "rev/s", "rps": "rev/s",
    "mm s": "mm/s", "mm per s": "mm/s", "m per s": "m/s",
    "nm": "Nm", "n m": "Nm", "newtonmeter": "Nm",
    "amp": "A", "amps": "A", "ampere": "A", "volt": "V", "volts": "V",
    "deg c": "degC", "degc": "degC", "celsius": "degC", "° c": "degC", "kelvin": "K",
    "sec": "s", "secs": "s", "seconds": "s",
    "ms": "ms", "msec": "ms", "millis": "ms", "milliseconds": "ms",
    "us": "us", "usec": "us", "micros": "us", "µs": "us", "microseconds": "us",
    "ns": "ns", "nsec": "ns", "nanos": "ns", "nanoseconds": "ns", "nanosec": "ns",
}  # fmt: skip
# Units that maps do not support: the user must state a scale for such a column.
_FOREIGN = _words("mnm knm ncm kn mrad mdeg arcmin arcsec ma mv cm krpm percent pct hz")
# A single letter is a unit only in brackets, or at the end of a name of its quantity.
_LETTERS = {"m": "m", "n": "N", "a": "A", "v": "V", "s": "s", "c": "degC", "k": "K", "m s": "m/s"}
_LETTER_OF = {"s": "time", "a": "current", "v": "voltage", "m s": "velocity", "c": "temperature"}


@dataclass(frozen=True)
class Meaning:
    """What a name says; a field is None if the name does not say it.

    ``quantity`` is "" if unknown, "other" for signals that do not belong to an axis. ``wanted`` is True for a
    target, False for a measurement. ``unit`` may be one that maps do not support. ``axis`` is the number in
    the name, the joint, or the rest of the name. ``stem`` is the same for all axes of one family.
    """

    quantity: str
    wanted: bool | None
    unit: str | None
    side: str | None
    axis: int | str
    stem: str


def meaning_of(series: Series, joints: Sequence[str] = ()) -> Meaning:
    """Return what the name of a signal says; ``joints`` are the joint names that may stand for the axis."""
    name = series.name
    bracket = next((m for m in _BRACKET.finditer(name) if _bracket_unit(m[1])), None)
    unit = _bracket_unit(bracket[1]) if bracket is not None else None
    bare = name if bracket is None else name[: bracket.start()] + name[bracket.end() :]
    axis, stem = _axis(bare, series.row, joints)
    text = stem if isinstance(axis, str) and axis else bare
    parts = _TOKEN.findall(_AXIS_LETTER.sub("", text))
    words = [part.lower() for part in parts if not part.isdigit()]
    quantity, used = _quantity(words)
    if unit is None:
        unit, words = _word_unit(words, quantity)
    if quantity not in ("", "error") and set(words) & _OTHER:
        quantity = "other"
    if axis == "":
        known = used | _MEASURED | _WANTED | _MOTOR | _JOINT
        rest = [w for w in words if w not in known]
        axis = "_".join(rest)
        stem = bare if not rest else " ".join(w for w in words if w not in rest)
    return Meaning(quantity, _wanted(words), unit, _side(words), axis, f"{stem} {unit}")


def _bracket_unit(text: str) -> str | None:
    key = " ".join(re.findall(r"[a-zµ°]+", text.lower()))
    if text == "1/min":
        return "rpm"
    foreign = text.strip() == "%" or bool(set(key.split()) & _FOREIGN)
    return text.strip() if foreign else _UNITS.get(key) or _LETTERS.get(key)


def joint_in(name: str, joints: Sequence[str]) -> tuple[str, re.Match[str]] | None:
    """Return the joint that a signal is named after and the match in its name; None without one.

    Exact names win over names in another case or without the word `joint` (`Elbow_angle` for `elbow_joint`).
    Among several matches, the longest wins.
    """
    ways: list[tuple[dict[str, str], re.RegexFlag]] = [
        ({joint: joint for joint in joints}, re.NOFLAG),
        (_bare(joints), re.IGNORECASE),
    ]
    for called, flags in ways:
        for words in sorted(called, key=len, reverse=True):
            pattern = rf"(?<![A-Za-z0-9]){re.escape(words)}(?![A-Za-z0-9])"
            if match := re.search(pattern, name, flags):
                return called[words], match
    return None


def called_after(joints: Sequence[str], names: Iterable[str]) -> list[str]:
    """Return the joints that occur in any of the names, in the order of ``joints``."""
    found = {match[0] for name in names if (match := joint_in(name, joints))}
    return [joint for joint in joints if joint in found]


def _bare(joints: Sequence[str]) -> dict[str, str]:
    """Return joints by lower-case name, whole and without `joint`, except names that two joints share."""
    found: dict[str, set[str]] = {}
    for joint in joints:
        whole = joint.lower()
        bare = whole.removesuffix("_joint").removeprefix("joint_")
        # A lone number or letter is too ambiguous to name a joint.
        enough = len(bare) > 1 and any(c.isalpha() for c in bare)
        for words in {whole, bare} if enough else {whole}:
            found.setdefault(words, set()).add(joint)
    return {words: own.pop() for words, own in found.items() if len(own) == 1}


def _axis(name: str, row: int | None, joints: Sequence[str]) -> tuple[int | str, str]:
    """Return the number or joint of the axis ("" if there is none), and the name with `#` in its place."""
    if row is not None:
        return row, name
    if found := joint_in(name, joints):
        joint, match = found
        return joint, f"{name[: match.start()]}#{name[match.end() :]}"
    numbers = list(re.finditer(r"\d+", name))
    if not numbers:
        return "", name
    last = numbers[-1]
    return int(last[0]), f"{name[: last.start()]}#{name[last.end() :]}"


def _quantity(words: Sequence[str]) -> tuple[str, set[str]]:
    """Return the quantity that the words name, and the words that name it."""
    named = {word: _QUANTITIES[word] for word in words if word in _QUANTITIES}
    for quantity in WORDS:
        if quantity in named.values():
            return quantity, {word for word, own in named.items() if own == quantity}
    places = set(words) & _PLACES
    return ("position", places) if places else ("", set())


def _word_unit(words: list[str], quantity: str) -> tuple[str | None, list[str]]:
    """Return the unit among the words, or None, and the other words."""
    for size in (3, 2, 1):
        for start in range(0 if len(words) == size else 1, len(words) - size + 1):
            key = " ".join(words[start : start + size])
            letter = _LETTER_OF.get(key) == quantity and start + size == len(words)
            unit = _LETTERS[key] if letter else key if key in _FOREIGN else _UNITS.get(key)
            if unit is not None:
                return unit, [*words[:start], *words[start + size :]]
    return None, words


def _wanted(words: Sequence[str]) -> bool | None:
    measured = bool(set(words) & _MEASURED) or words[:1] == ["ai"]
    # q_d, tau_J_d: desired; KUKA's ASPos is the set position.
    wanted = bool(set(words) & _WANTED) or words[:1] == ["as"] or words[-1:] == ["d"]
    return wanted if measured != wanted else None


def _side(words: Sequence[str]) -> str | None:
    motor, joint = bool(set(words) & _MOTOR), bool(set(words) & _JOINT)
    return None if motor == joint else "motor" if motor else "joint"
