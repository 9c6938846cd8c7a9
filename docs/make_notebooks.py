"""Execute the notebooks of the examples and store their outputs in place.

Usage: python docs/make_notebooks.py [NAME...]

Stored is what a reader of the file needs: texts, tables and small figures. Progress, times and
whatever differs from run to run are left out. A warning or a path of this machine ends it with an error.
"""

import argparse
import base64
import io
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode
from PIL import Image

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
# Small figures of few colours: 10 to 20 kB each, for every refresh stays in the history of the repository.
DPI = 60
COLOURS = 48
# An absolute path, of any system.
MACHINE_PATH = re.compile(r"(?<![\w.:/<>-])/(?:home|root|tmp|usr|var|work|opt|Users)/|\b[A-Z]:\\\w")


def executed(path: Path) -> NotebookNode:
    """Return a notebook run from top to bottom in an empty folder, its outputs as they are stored."""
    book = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "matplotlibrc").write_text(f"figure.dpi: {DPI}\n", encoding="utf-8")
        where = {"metadata": {"path": folder}}
        client = NotebookClient(
            book,
            timeout=600,
            resources=where,
            record_timing=False,
            extra_arguments=["--log-level=ERROR"],
        )
        client.execute(env=_environment())
    for cell in book.cells:
        if cell.cell_type == "code":
            cell.outputs = [kept for output in cell.outputs for kept in _stored(output)]
    book.metadata["language_info"] = {"name": "python"}
    return book


def _environment() -> dict[str, str]:
    """Return the environment with this Python's commands first."""
    beside = str(Path(sys.executable).parent)
    return os.environ | {"PATH": os.pathsep.join([beside, os.environ.get("PATH", "")])}


def _stored(output: NotebookNode) -> Iterator[NotebookNode]:
    """Yield what is kept of an output: no progress, one text of each result, small figures."""
    data: dict[str, Any] = output.get("data", {})
    html = data.get("text/html", "")
    if "<progress" in html:
        return
    if "xr-wrap" in html:  # tables of arrays have identifiers that are new in every run
        del data["text/html"]
    elif html:
        del data["text/plain"]
    if "image/png" in data:
        data["image/png"] = _small(data["image/png"])
        data["text/plain"] = "<Figure>"  # its size in pixels depends on fonts
    output.pop("transient", None)
    yield output


def _small(png: str) -> str:
    """Return a picture, in base64, with few colours."""
    picture = Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB")
    out = io.BytesIO()
    picture.quantize(COLOURS, dither=Image.Dither.NONE).save(out, "PNG", optimize=True)
    return base64.b64encode(out.getvalue()).decode()


def texts(book: NotebookNode) -> Iterator[tuple[str, str, str]]:
    """Yield cell, kind and text of every stored output that is text."""
    for cell in book.cells:
        for output in cell.get("outputs", []):
            if output.output_type == "error":
                yield cell.id, "error", output.evalue
            if output.output_type == "stream":
                yield cell.id, output.name, output.text
            data: dict[str, Any] = output.get("data", {})
            yield from ((cell.id, kind, data[kind]) for kind in sorted(data) if "text" in kind)


def faults(book: NotebookNode) -> list[str]:
    """Return what must not stand in a stored notebook: warnings, errors, paths of a machine."""
    found = []
    for cell, kind, text in texts(book):
        if kind in ("stderr", "error"):
            found.append(f"{cell}: {kind}: {text.strip()[:200]}")
        elif path := MACHINE_PATH.search(text):
            found.append(f"{cell}: a path of this machine: {text[path.start() :][:80]}")
    return found


def main() -> int:
    """Run the command; return its exit status."""
    known = sorted(path.stem for path in EXAMPLES.glob("*.ipynb"))
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(known)}; all")
    names = parser.parse_args().names or known
    for name in names:
        if name not in known:
            parser.error(f"NAME: expected one of {', '.join(known)}, got '{name}'")
        path = EXAMPLES / f"{name}.ipynb"
        book = executed(path)
        if found := faults(book):
            print(f"{name}: not written", *found, sep="\n", file=sys.stderr)
            return 1
        nbformat.write(book, path)
        print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
