"""The borders of the package's rooms: few loose files, no circles, one way to the compiled robot."""

import ast
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from axisight import _core

# What every room uses; the rest belongs to one.
LOOSE = {
    # `python -m axisight`.
    "__main__.py",
    "__init__.py",
    "__init__.pyi",
    "_core.pyi",
    "arguments.py",
    "documents.py",
    "errors.py",
    "palette.py",
    "storage.py",
}
# Names on other compiled results too, which may be asked for them.
SHARED = {"jacobian"}


@pytest.fixture(scope="module")
def modules(repository: Path) -> dict[str, Path]:
    """Modules of both packages by dotted name."""
    found = {}
    for root in (repository / "python", repository / "thesis"):
        for path in root.rglob("*.py"):
            parts = path.relative_to(root).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports(path: Path, modules: dict[str, Path]) -> set[str]:
    """Modules that a file names in its imports, wherever they stand in it."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            inner = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name if name in modules else node.module for name in inner}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return found & modules.keys()


def room(module: str) -> str:
    return ".".join(module.split(".")[:2])


def test_few_files_are_loose(repository: Path) -> None:
    top = (repository / "python" / "axisight").iterdir()
    loose = {p.name for p in top if p.suffix in {".py", ".pyi"}}
    assert loose <= LOOSE, "a new file belongs to a room, or to this list with a reason"


def test_modules_and_rooms_have_no_circles(modules: dict[str, Path]) -> None:
    # The package itself names everything, for its users; nothing else stands on it.
    graph = {m: imports(p, modules) - {m, "axisight"} for m, p in modules.items()}
    TopologicalSorter(graph).prepare()  # raises CycleError, which lists the circle
    rooms: dict[str, set[str]] = {}
    for module, used in graph.items():
        if module not in {"axisight", "axisight_thesis"}:
            rooms.setdefault(room(module), set()).update(map(room, used - {room(module)}))
    for name, used in rooms.items():
        used.discard(name)
    TopologicalSorter(rooms).prepare()


# Files of a folder beyond which nobody keeps in mind what is where; modules that the pipeline may name.
MOST_FILES = 15
MOST_IMPORTS = 20


def test_rooms_of_the_diagnosis_use_one_another_one_way(modules: dict[str, Path]) -> None:
    def inner(module: str) -> str:
        folder = modules[module].name == "__init__.py"
        return module if folder else module.rpartition(".")[0]

    rooms: dict[str, set[str]] = {}
    for module, path in modules.items():
        # A folder's own file hands on what stands in it; the pipeline stands on all of them.
        if module.startswith("axisight.gap.") and path.name != "__init__.py":
            used = {inner(m) for m in imports(path, modules) if m.startswith("axisight.gap.")}
            rooms.setdefault(inner(module), set()).update(used - {inner(module)})
    TopologicalSorter(rooms).prepare()


def test_rooms_of_the_diagnosis_are_small_and_say_what_they_are(modules: dict[str, Path]) -> None:
    gap = modules["axisight.gap"].parent
    for folder in (gap, *(p for p in gap.rglob("*") if p.is_dir() and p.name != "__pycache__")):
        files = list(folder.glob("*.py"))
        assert len(files) <= MOST_FILES, folder
        said = ast.get_docstring(ast.parse((folder / "__init__.py").read_text("utf-8")))
        assert said and "\n" not in said and said.endswith("."), f"{folder}: one sentence"
    assert len(imports(gap / "pipeline.py", modules)) <= MOST_IMPORTS


# Rooms where a simulation that diverges is an answer: what raises there is misuse, and is to be seen.
FITTING_ROOMS = ("fit", "measure", "ranking", "screening", "search", "verdict", "views")
MISUSE = {"InputError", "AxisightError", "ValueError", "Exception", "BaseException"}


def caught(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Names of what is caught and not raised again, with their lines."""
    for node in ast.walk(tree):
        kinds: list[ast.expr | None] = []
        if isinstance(node, ast.ExceptHandler):
            again = isinstance(node.body[-1], ast.Raise) and node.body[-1].exc is None
            kinds = [] if again else [node.type or ast.Name("BaseException")]
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("suppress"):
            kinds = [*node.args]
        for kind in kinds:
            named = kind.elts if isinstance(kind, ast.Tuple) else [kind]
            yield from ((node.lineno, ast.unparse(n).rpartition(".")[2]) for n in named if n)


def test_no_room_that_fits_catches_misuse(modules: dict[str, Path]) -> None:
    gap = modules["axisight.gap"].parent
    for name in FITTING_ROOMS:
        for path in (gap / name).rglob("*.py"):
            for line, kind in caught(ast.parse(path.read_text("utf-8"))):
                assert kind not in MISUSE, f"{path}:{line}: misuse would vanish here"


def test_what_is_caught_is_found() -> None:
    code = """
with suppress(InputError, KeyError):
    pass
try:
    pass
except (errors.InputError, OSError):
    pass
except:
    pass
try:
    pass
except BaseException:
    stop()
    raise
"""
    found = [kind for _, kind in caught(ast.parse(code))]
    assert sorted(found) == ["BaseException", "InputError", "InputError", "KeyError", "OSError"]


def test_package_stands_without_the_study(modules: dict[str, Path]) -> None:
    users = {m for m, p in modules.items() if "axisight_thesis" in imports(p, modules)}
    assert {m for m in users if not m.startswith("axisight_thesis")} == {"axisight.cli.reproduce"}


def test_only_its_room_looks_into_the_compiled_robot(modules: dict[str, Path]) -> None:
    names = {n for n in dir(_core.Robot) if not n.startswith("_")} - SHARED
    for module, path in modules.items():
        if room(module) == "axisight.robot":
            continue
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            inside = isinstance(node, ast.Attribute) and isinstance(node.value, ast.Attribute)
            if inside and node.value.attr == "core":
                assert node.attr not in names, f"{path}:{node.lineno}: ask the Robot"
