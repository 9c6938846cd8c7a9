"""The rooms that decide ask the table of effects for a property, never for an effect or a family by name."""

import ast
from collections.abc import Iterator
from pathlib import Path

from axisight.effects import effect_table

TABLE = effect_table()
FAMILIES = {info.family for info in TABLE.values()}
# Rooms that may: where fits of each effect begin, and what measures, states or mistakes are by name.
NAMING = {"hypotheses", "signals", "controller", "simulator", "gate"}
# Quantities of the robot that share a name with an effect, and a bin of a map.
ELSE = {
    "facts/settings.py": {"motor_inertia", "viscous_friction"},
    "prepare/position_targets.py": {"motor_inertia"},
    "views/targets.py": {"viscous_friction"},
    "measure/where.py": {"load"},
}
# Still to do.
TO_DO: set[str] = set()


def strings(tree: ast.AST) -> Iterator[str]:
    """Yield string literals, but for docstrings and for what scope and point of action are compared with."""
    skipped = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            if any(isinstance(s, ast.Attribute) and s.attr in {"scope", "acts"} for s in sides):
                skipped |= {id(x) for s in sides for x in ast.walk(s)}
        elif isinstance(node, ast.Expr):
            skipped.add(id(node.value))
    constants = (n for n in ast.walk(tree) if isinstance(n, ast.Constant) and id(n) not in skipped)
    for node in constants:
        if isinstance(node.value, str):
            yield node.value


def names_in(path: Path, known: set[str]) -> set[str]:
    """Return by what a file knows an effect or a family by name."""
    tree = ast.parse(path.read_text("utf-8"))
    imported = {
        f"from {node.module}"
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module == "axisight.effects.stated"
    }
    return imported | (set(strings(tree)) & (TABLE.keys() | FAMILIES)) - known


def test_no_room_that_decides_knows_an_effect_by_name(repository: Path) -> None:
    root = repository / "python" / "axisight" / "gap"
    found = {}
    for path in sorted(root.rglob("*.py")):
        name = path.relative_to(root).as_posix()
        if name.split("/")[0] not in NAMING:
            by = names_in(path, ELSE.get(name, set()))
            found |= {name: sorted(by)} if by else {}
    assert {name: by for name, by in found.items() if name not in TO_DO} == {}
    assert found.keys() >= TO_DO, "done: take it off the list"


def test_names_are_seen(tmp_path: Path) -> None:
    """The counterpart: each way to know an effect by name is found, and what is none is not."""
    ways = {
        "from axisight.effects.stated import STEPS": {"from axisight.effects.stated"},
        'x = {"backlash": 1.0}': {"backlash"},
        'info.family == "load"': {"load"},
        'GEAR = "transmission"': {"transmission"},
        'info.acts == "transmission"': set(),
        'scope = None if i.scope == "arm" else axis': set(),
        'def f():\n    """backlash"""': set(),
    }
    path = tmp_path / "room.py"
    for text, by in ways.items():
        path.write_text(text, "utf-8")
        assert names_in(path, set()) == by
