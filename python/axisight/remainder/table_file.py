"""A remainder as tables in TOML, which any simulator can read: a file of its own, or a part of a robot file."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
import tomlkit
from tomlkit.items import AoT, Table

from axisight.errors import InputError
from axisight.remainder.model import Remainder
from axisight.remainder.terms import Term
from axisight.remainder.variables import ACTS, VARIABLES, Acts
from axisight.storage import check_target, write_whole

SCHEMA = "axisight.remainder/1"
"""Schema of the file."""

_HEAD = """\
Torque that the simulator lacks, motor side: of each axis the sum of its terms, cut to +- limits_nm.
A term is value(x) times what it acts as: torque 1; direction v / sqrt(v^2 + corner_rad_s^2); way the sign of
the last motion; speed v; load the torque through the gear. v is the speed of the axis. value is linear between
the points of x and keeps its end values beyond them; with a period it repeats. Axes count from 1.\
"""
_PLAIN = ("axis", "acts", "variable", "of_axis", "unit", "x_unit", "corner_rad_s")
_ARRAYS = ("x", "value", "standard_error")
_FIGURES = ("gain", "significance")


def save_remainder(remainder: Remainder, path: Path | str, *, overwrite: bool = False) -> None:
    """Write a remainder as TOML (``axisight.remainder/1``); the file appears whole or not at all.

    `load_remainder` returns the same numbers bit by bit. ``overwrite``: replace an existing file. Raises InputError
    if it exists otherwise.
    """
    check_target(Path(path), overwrite=overwrite)
    document = tomlkit.document()
    _fill(document, remainder, {"schema": SCHEMA})
    write_whole(Path(path), tomlkit.dumps(document))


def remainder_table(remainder: Remainder) -> Table:
    """Return a remainder as the table of a TOML document, without the schema of a file of its own."""
    table = tomlkit.table()
    _fill(table, remainder, {})
    return table


def _fill(
    table: Table | tomlkit.TOMLDocument, remainder: Remainder, first: Mapping[str, str]
) -> None:
    for line in _HEAD.splitlines():
        table.add(tomlkit.comment(line))
    table.update(first)
    for name in ("limits_nm", "held_out_nm"):
        table[name] = getattr(remainder, name).tolist()
    if remainder.terms:
        table["term"] = _terms(remainder)


def _terms(remainder: Remainder) -> AoT:
    terms = tomlkit.aot()
    for term in remainder.terms:
        table = tomlkit.table()
        table.comment(term.words)
        for name in _PLAIN:
            table[name] = getattr(term, name)
        if term.period is not None:
            table["period"] = term.period
        for name in _FIGURES:
            table[name] = float(getattr(term, name))
        table["hint"] = term.hint
        for name in _ARRAYS:
            table[name] = getattr(term, name).tolist()
        terms.append(table)
    return terms


def load_remainder(path: Path | str) -> Remainder:
    """Return the remainder in a file that `save_remainder` wrote.

    Raises InputError that names the key for a file that cannot be read, or that is no such table.
    """
    try:
        given = tomllib.loads(Path(path).read_text("utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path}: expected a remainder table in TOML: {error}") from None
    if given.get("schema") != SCHEMA:
        raise InputError(f"{path}: schema: expected {SCHEMA!r}, got {given.get('schema')!r}")
    return remainder_of(given, path)


def remainder_of(given: Mapping[str, Any], path: Path | str) -> Remainder:
    """Return the remainder of a table that was read; ``path``: what errors call its file.

    Raises InputError that names the key.
    """
    limits, held_out = (_numbers(path, given, name) for name in ("limits_nm", "held_out_nm"))
    if limits.shape != held_out.shape:
        raise InputError(f"{path}: held_out_nm: expected as many numbers as limits_nm")
    terms = given.get("term", [])
    if not isinstance(terms, list):
        raise InputError(f"{path}: term: expected [[term]] tables, got {type(terms).__name__}")
    return Remainder(tuple(_term(path, one, len(limits)) for one in terms), limits, held_out)


def _term(path: Path | str, given: Mapping[str, Any], n_axes: int) -> Term:
    acts, variable = given.get("acts"), given.get("variable")
    for name, value, known in (("acts", acts, ACTS), ("variable", variable, VARIABLES)):
        if value not in known:
            raise InputError(f"{path}: {name}: expected one of {', '.join(known)}, got {value!r}")
    x, value, error = (_numbers(path, given, name) for name in _ARRAYS)
    if not len(x) == len(value) == len(error) or not np.all(np.diff(x) > 0) or not len(x):
        raise InputError(f"{path}: x: expected rising points, as many as value and standard_error")
    axes = [given.get(name) for name in ("axis", "of_axis")]
    for name, axis in zip(("axis", "of_axis"), axes, strict=True):
        if not isinstance(axis, int) or not 1 <= axis <= n_axes:
            raise InputError(f"{path}: {name}: expected an axis from 1 to {n_axes}, got {axis!r}")
    return Term(
        axis=int(given["axis"]),
        acts=cast("Acts", acts),
        variable=str(variable),
        of_axis=int(given["of_axis"]),
        x=x,
        value=value,
        standard_error=error,
        corner_rad_s=_number(path, given, "corner_rad_s"),
        gain=_number(path, given, "gain"),
        significance=_number(path, given, "significance"),
        period=None if "period" not in given else _number(path, given, "period"),
        hint=str(given.get("hint", "")),
    )


def _number(path: Path | str, given: Mapping[str, Any], key: str) -> float:
    value = given.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"{path}: {key}: expected a finite number, got {value!r}")
    return float(value)


def _numbers(path: Path | str, given: Mapping[str, Any], key: str) -> np.ndarray[Any, Any]:
    values = given.get(key)
    if not isinstance(values, list):
        raise InputError(f"{path}: {key}: expected a list of numbers, got {values!r}")
    return np.array([_number(path, {key: value}, key) for value in values], dtype=np.float64)
