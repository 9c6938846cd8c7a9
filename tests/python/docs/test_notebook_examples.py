"""Notebooks of the examples run from top to bottom, and say what is stored in them."""

import copy
import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

nbformat = pytest.importorskip("nbformat")
pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")

REPOSITORY = Path(__file__).resolve().parents[3]
EXAMPLES = REPOSITORY / "examples"
# Those of the kernel and its sockets.
pytestmark = pytest.mark.filterwarnings("default")
# Cells that end with a figure.
FIGURES = {"diagnose": 4, "identify": 0, "simulate": 1}
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
# Linear algebra rounds differently on other processors: with the kernels of OpenBLAS for Haswell and for
# Nehalem the values of these notebooks differ by at most 3e-9 of themselves. Where no more digits than this
# are printed, that can only change how the last one is rounded, by one.
DIGITS = 5


def load_script() -> ModuleType:
    path = REPOSITORY / "docs" / "make_notebooks.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return load_script()


def stored(name: str):
    return nbformat.read(EXAMPLES / f"{name}.ipynb", as_version=4)


def unit(number: str) -> float:
    """One in the last digit of a number as it is printed."""
    mantissa, _, power = number.partition("e")
    return 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))


def whole(number: str) -> bool:
    return re.fullmatch(r"-?\d+", number) is not None


def near(stored: str, fresh: str) -> bool:
    """Whether numbers are equal to one in the last digit printed; counts are equal."""
    if whole(stored) and whole(fresh):
        return int(stored) == int(fresh)
    step = max(unit(stored), unit(fresh))
    return abs(float(stored) - float(fresh)) < 1.01 * step


def differences(stored: list[tuple[str, str, str]], fresh: list[tuple[str, str, str]]) -> list[str]:
    """What two notebooks say differently: (cell, kind, text) of every output, in order."""
    if [x[:2] for x in stored] != [x[:2] for x in fresh]:
        return [f"outputs: {[x[:2] for x in stored]} stored, {[x[:2] for x in fresh]} fresh"]
    found = []
    for (cell, _, old), (_, _, new) in zip(stored, fresh, strict=True):
        if NUMBER.split(old) != NUMBER.split(new):
            found.append(f"{cell}: stored {old!r}, fresh {new!r}")
        pairs = zip(NUMBER.findall(old), NUMBER.findall(new), strict=False)
        found += [f"{cell}: {a} stored, {b} fresh" for a, b in pairs if not near(a, b)]
    return found


def pictures(book) -> list[str]:
    """Cells that end with a figure."""
    return [
        c.id for c in book.cells for o in c.get("outputs", []) if "image/png" in o.get("data", {})
    ]


def test_every_notebook_is_known() -> None:
    assert {p.stem for p in EXAMPLES.glob("*.ipynb")} == set(FIGURES)


@pytest.mark.parametrize("name", FIGURES)
def test_a_notebook_holds_its_outputs(name: str, script: ModuleType) -> None:
    book = stored(name)
    assert script.faults(book) == []
    assert len(pictures(book)) == FIGURES[name]
    code = [cell for cell in book.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    said = list(script.texts(book))
    assert said
    numbers = [n for _, _, text in said for n in NUMBER.findall(text) if not whole(n)]
    digits = [len(re.sub(r"e.*|\D", "", n).lstrip("0")) for n in numbers]
    assert max(digits) <= DIGITS, "round what is printed"
    assert (EXAMPLES / f"{name}.ipynb").stat().st_size < 150_000


@pytest.mark.parametrize("name", FIGURES)
def test_a_fresh_run_says_what_is_stored(name: str, script: ModuleType) -> None:
    book, fresh = stored(name), script.executed(EXAMPLES / f"{name}.ipynb")
    assert script.faults(fresh) == []
    assert pictures(fresh) == pictures(book)
    said = list(script.texts(fresh))
    assert differences(list(script.texts(book)), said) == [], "run `make notebooks`"
    text = "".join(t for _, _, t in said)
    if name == "diagnose":
        assert "coulomb_friction@2" in text and "\nnone\n" in f"\n{text}"
    if name == "identify":
        assert "axis1.coulomb_friction   0.400" in text


def test_what_differs_is_told() -> None:
    old = [("a", "stdout", "gap 13.1 % on axis2, 1e-05 rad"), ("b", "text/plain", "124 of 600")]
    assert differences(old, old) == []

    def with_text(text: str) -> list[tuple[str, str, str]]:
        return [("a", "stdout", text), old[1]]

    assert differences(old, with_text("gap 13.2 % on axis2, 1e-05 rad")) == []
    assert differences(old, with_text("gap 13 % on axis2, 1.1e-05 rad")) == []
    for text in (
        "gap 13.3 % on axis2, 1e-05 rad",
        "gap 13.1 % on axis3, 1e-05 rad",
        "gap 13.1 % on axis2, 3e-05 rad",
        "gap 13.1 % on joint2, 1e-05 rad",
        "gap -13.1 % on axis2, 1e-05 rad",
        "gap 13.1 % on axis2",
    ):
        assert differences(old, with_text(text)), text
    assert differences(old, [old[0], ("b", "text/plain", "123 of 600")])
    assert differences(old, old[:1])


def test_paths_and_warnings_are_told(script: ModuleType) -> None:
    book = stored("simulate")
    for text in ("/home/me/x.toml", "see /tmp/a: no", r"C:\Users\me"):
        spoilt = copy.deepcopy(book)
        spoilt.cells[-1].outputs = [nbformat.v4.new_output("stream", name="stdout", text=text)]
        assert len(script.faults(spoilt)) == 1, text
    spoilt.cells[-1].outputs = [nbformat.v4.new_output("stream", name="stderr", text="UserWarning")]
    assert script.faults(spoilt) == [f"{spoilt.cells[-1].id}: stderr: UserWarning"]
    spoilt.cells[-1].outputs = [
        nbformat.v4.new_output("stream", name="stdout", text="demo/case/a.csv, 3/4, rad/s")
    ]
    assert script.faults(spoilt) == []
