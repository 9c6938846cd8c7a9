"""The list of long tests names tests that there are, and no file as a whole."""

import ast
import subprocess
import sys
from pathlib import Path

from conftest import long_tests


def test_every_line_names_a_test(repository: Path) -> None:
    for line in long_tests():
        file, _, name = line.partition("::")
        tree = ast.parse((repository / file).read_text("utf-8"))
        names = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
        assert name.partition("[")[0] in names, line


def test_every_line_with_parameters_is_a_test_that_runs(repository: Path) -> None:
    """Ids of parameters are known only once pytest has collected the files."""
    lines = [line for line in long_tests() if "[" in line]
    files = sorted({line.partition("::")[0] for line in lines})
    run = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider", *files]
    done = subprocess.run(run, cwd=repository, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    found = set(done.stdout.splitlines())
    # A file is skipped as a whole where a library that it needs is not installed.
    there = {line.partition("::")[0] for line in found}
    assert [x for x in lines if x.partition("::")[0] in there and x not in found] == []


def test_no_line_stands_twice_and_all_are_in_order() -> None:
    lines = long_tests()
    assert lines == sorted(set(lines))
