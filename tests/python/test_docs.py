"""The pages are up to date and everything public is documented."""

import importlib.util
import inspect
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import axisight
from axisight import _core

MODULES = (
    axisight,
    axisight.blackbox,
    axisight.calibration,
    axisight.excitation,
    axisight.frequency_fit,
    axisight.frf,
    axisight.graybox,
    axisight.identifiability,
    axisight.montecarlo,
    axisight.mujoco,
    axisight.records,
    axisight.rigid_body,
    axisight.robot_file,
    axisight.robot_export,
    axisight.robot_import,
    axisight.signal_files,
    axisight.write_back,
)
PUBLIC = {f"{m.__name__}.{n}": getattr(m, n) for m in MODULES for n in m.__all__}
# The word says it all.
SELF_EVIDENT = {"name", "path"}
CLASSES = [thing.__name__ for thing in PUBLIC.values() if inspect.isclass(thing)]


def load_script(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def parameters(function: Callable[..., Any]) -> list[str]:
    """Arguments that need words: all but obvious names and documented classes of axisight."""
    return [
        p.name
        for p in inspect.signature(function).parameters.values()
        if p.name not in SELF_EVIDENT
        and not any(re.search(rf"\b{re.escape(c)}\b", str(p.annotation)) for c in CLASSES)
    ]


def mentions(text: str, name: str) -> bool:
    """The name itself, or its words without the unit ("sample time" for sample_time_s)."""
    if re.search(rf"\b{re.escape(name)}\b", text):
        return True
    words = [w for w in name.split("_") if len(w) > 2]
    return bool(words) and all(w.lower() in text.lower() for w in words)


def test_effects_page_is_up_to_date(repository: Path) -> None:
    script = load_script(repository / "docs" / "make_effects.py")
    page = (repository / "docs" / "effects.md").read_text(encoding="utf-8")
    assert page == script.render(_core.effect_table()), "run `make docs`"


def test_table_cells_cannot_break_the_effects_page(repository: Path) -> None:
    script = load_script(repository / "docs" / "make_effects.py")
    parameter = {"name": "p", "unit": "a|b", "role": "shape"} | dict.fromkeys(
        ("neutral", "lower", "upper", "typical"), 0.0
    )
    effect = {"name": "e", "summary": "s|t", "equation": "x", "source": "y"}
    effect |= {"scope": "arm", "acts": "arm", "parameters": [parameter]}
    effect |= {"family": "arm", "contains": [], "parts": [], "usual": [], "twins": []}
    effect |= {"stands_for": None, "linear": "no", "inverse_dynamics": False}
    rows = [line for line in script.render([effect]).splitlines() if line.startswith("| ")]
    for row, columns in zip(rows, (3, 3, 6, 6), strict=True):
        assert len(re.findall(r"(?<!\\)\|", row)) == columns + 1, row


def test_links_between_pages_lead_somewhere(repository: Path) -> None:
    pages = [*(repository / "docs").glob("*.md"), *repository.glob("*.md")]
    assert pages
    for page in pages:
        for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8")):
            if "://" not in target and not target.startswith("mailto:"):
                assert (page.parent / target).exists(), f"{page.name}: {target}"


@pytest.mark.parametrize("name", PUBLIC)
def test_public_name_exists_and_has_a_docstring(name: str) -> None:
    thing = PUBLIC[name]
    if inspect.isclass(thing) or inspect.isroutine(thing):
        own = thing.__dict__.get("__doc__") if inspect.isclass(thing) else thing.__doc__
        assert own and own.strip(), f"{name} has no docstring"
        # dataclass writes its signature as docstring when there is none.
        assert not own.startswith(f"{thing.__name__}("), f"{name} has no docstring of its own"


@pytest.mark.parametrize("name", PUBLIC)
def test_public_function_documents_its_parameters(name: str) -> None:
    thing = PUBLIC[name]
    if not inspect.isroutine(thing):
        return
    wanted = parameters(thing)
    text = inspect.getdoc(thing) or ""
    # A sole argument is what the summary is about.
    missing = [p for p in wanted if not mentions(text, p)] if len(wanted) > 1 else []
    assert not missing, f"{name} does not document {', '.join(missing)}"
