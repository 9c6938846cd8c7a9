"""Notebooks of the examples run from top to bottom, and have no output of their own."""

import os
import sys
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
# Those of the kernel and its sockets.
pytestmark = pytest.mark.filterwarnings("default")
# Cells that end with a figure.
FIGURES = {"diagnose": 4, "identify": 0, "simulate": 1}


def test_every_notebook_is_known():
    assert {p.stem for p in EXAMPLES.glob("*.ipynb")} == set(FIGURES)


@pytest.mark.parametrize("name", FIGURES)
def test_a_notebook_runs(name: str, tmp_path: Path, monkeypatch) -> None:
    book = nbformat.read(EXAMPLES / f"{name}.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in book.cells)
    beside = str(Path(sys.executable).parent)
    monkeypatch.setenv("PATH", os.pathsep.join([beside, os.environ["PATH"]]))
    where = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(book, timeout=300, resources=where).execute()
    shown = [out.get("data", {}) for cell in book.cells for out in cell.get("outputs", [])]
    assert sum("image/png" in data for data in shown) == FIGURES[name]
    said = "".join(out.get("text", "") for cell in book.cells for out in cell.get("outputs", []))
    if name == "diagnose":
        assert "coulomb_friction@2" in said and "No unmodelled effect found" in said
    if name == "identify":
        assert "axis1.coulomb_friction   0.400" in said
