"""Items of the study and their registration."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module

import pandas as pd
from matplotlib.figure import Figure

from axisight.errors import InputError
from axisight_thesis.context import Context


@dataclass(frozen=True)
class Claim:
    """A statement of the thesis and whether it holds here.

    id
        Short and unique, e.g. ``"8.3.1-symmetry"``.
    section
        Section of the thesis, e.g. ``"8.3.1"``.
    statement
        The statement, paraphrased.
    holds
        Whether the computation confirms the statement; None if the spread over realizations leaves it
        undecided.
    evidence
        The computed figures for the verdict.
    """

    id: str
    section: str
    statement: str
    holds: bool | None
    evidence: str

    @property
    def verdict(self) -> str:
        """``"yes"``, ``"no"`` or ``"undecided"``."""
        return "undecided" if self.holds is None else "yes" if self.holds else "no"


@dataclass(frozen=True)
class Item:
    """One table or figure of the thesis, computed.

    ``tables`` and ``figures`` map suffixes of the file name to their content, with ``""`` for the only
    or main one: ``{"": frame}`` of ``figure-8.4`` is ``figure-8.4.csv``.
    """

    name: str
    title: str
    tables: dict[str, pd.DataFrame] = field(default_factory=dict)
    figures: dict[str, Figure] = field(default_factory=dict)
    claims: tuple[Claim, ...] = ()


Make = Callable[[Context], Item]
Result = tuple[bool | None, str]
"""Whether a statement holds (None: undecided), and the evidence."""
Check = Callable[[Context], Result]


class Statements:
    """The statements of one section, each with the function that checks it, in order."""

    def __init__(self, section: str) -> None:
        """Start an empty list of statements."""
        self._section = section
        self._checks: list[tuple[str, str, Check]] = []

    def claim(self, id_: str, statement: str) -> Callable[[Check], Check]:
        """Add the decorated function as the check of a statement."""

        def add(check: Check) -> Check:
            self._checks.append((id_, statement, check))
            return check

        return add

    def computed(self, context: Context) -> list[Claim]:
        """Return all claims of the section."""
        return [Claim(i, self._section, text, *check(context)) for i, text, check in self._checks]


# Importing a module registers its items.
_MODULES: tuple[str, ...] = (
    "chapter3_claims",
    "chapter5_transients",
    "chapter5_claims",
    "chapter7_periods",
    "chapter7_signals",
    "chapter7_averages",
    "chapter7_sinusoid",
    "chapter7_conclusions",
    "chapter8_tables",
    "chapter8_sinusoid",
    "chapter8_figures",
    "chapter8_averages",
    "appendix_a",
    "chapter8_claims",
    "chapter9_tables",
    "chapter9_figures",
    "chapter9_claims",
    "appendix_a_claims",
)
_ITEMS: dict[str, Make] = {}


def item(name: str) -> Callable[[Make], Make]:
    """Register a function as the item of this name."""

    def register(make: Make) -> Make:
        if name in _ITEMS:
            raise ValueError(f"item {name!r} is registered twice")
        _ITEMS[name] = make
        return make

    return register


def registered() -> dict[str, Make]:
    """Return all items by name, in the order of the thesis."""
    for module in _MODULES:
        import_module(f"axisight_thesis.{module}")
    return dict(sorted(_ITEMS.items(), key=lambda entry: _order(entry[0])))


def item_names(name: str) -> list[str]:
    """Return the items that ``name`` selects: ``all``, one item, or a part such as ``figure-8``.

    Raises InputError with the known names for other names.
    """
    known = list(registered())
    if name == "all":
        return known
    found = [n for n in known if n == name or n.startswith(f"{name}.")]
    if not found:
        raise InputError(f"name: expected all or one of {', '.join(known)}, got {name!r}")
    return found


def _order(name: str) -> tuple[str, int, str]:
    """Return the sort key of a name: 8.2 before 8.10, appendices after chapters, claims last."""
    match = re.fullmatch(r"([a-z]+)-(\w+)(?:\.(\d+))?", name)
    if match is None:
        raise ValueError(f"item {name!r}: expected a name as figure-8.4 or claims-8")
    kind, chapter, number = match.groups()
    return chapter, int(number) if number else 10**6, kind
