"""The list of long tests names tests that there are, and no file as a whole."""

import ast
from pathlib import Path

from conftest import long_tests


def test_every_line_names_a_test(repository: Path) -> None:
    for line in long_tests():
        file, _, name = line.partition("::")
        tree = ast.parse((repository / file).read_text("utf-8"))
        names = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
        assert name.partition("[")[0] in names, line


def test_no_line_stands_twice_and_all_are_in_order() -> None:
    lines = long_tests()
    assert lines == sorted(set(lines))
