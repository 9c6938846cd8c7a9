"""The pages are up to date and everything public is documented."""

import importlib.util
import inspect
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from typer.testing import CliRunner

import axisight
from axisight import _core
from axisight.cli import app
from axisight.gap.constants import constants, settings
from axisight.gap.facts.trace import MOVES, RULES

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
    axisight.paths,
    axisight.posterior,
    axisight.records,
    axisight.remainder,
    axisight.repeats,
    axisight.responses,
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


def test_commands_page_is_up_to_date(repository: Path) -> None:
    script = load_script(repository / "docs" / "make_cli.py")
    page = (repository / "docs" / "cli.md").read_text(encoding="utf-8")
    assert page == script.render(), "run `make docs`"


def test_commands_page_has_the_options_of_the_help(repository: Path) -> None:
    page = (repository / "docs" / "cli.md").read_text(encoding="utf-8")
    for section in page.split("\n## ")[1:]:
        command = section.split("\n")[0]
        run = CliRunner(env={"COLUMNS": "300", "NO_COLOR": "1", "TERM": "dumb"})
        told = run.invoke(app, [*command.split(), "--help"]).output
        options = set(re.findall(r"(?<![\w`-])--[a-z][\w-]*(?=[ ,│|])", told))
        # One head of the page has what all commands take.
        options -= {"--help", "--quiet"}
        shown = set(re.findall(r"^\| `(--[\w-]+)`", section, flags=re.MULTILINE))
        shown |= set(re.findall(r"^\| `--[\w-]+`, `(--[\w-]+)`", section, flags=re.MULTILINE))
        shown |= set(re.findall(r"^\| `-\w`, `(--[\w-]+)`", section, flags=re.MULTILINE))
        in_words = set(re.findall(r"--[a-z][\w-]*", section)) - shown
        assert shown <= options, command
        assert options <= shown | in_words, command


def test_constants_page_is_up_to_date(repository: Path) -> None:
    script = load_script(repository / "docs" / "make_constants.py")
    page = (repository / "docs" / "constants.md").read_text(encoding="utf-8")
    assert page == script.render(), "run `make docs`"
    assert script.main(["--check"]) == 0


def test_pages_of_rules_name_constants_that_exist(repository: Path) -> None:
    known = {c.name for c in settings()}
    for one in constants():
        known |= {f"{Path(one.place).stem}.{name}" for name in one.name.split(", ")}
    pages = [*(repository / "docs").glob("rules_*.md"), repository / "docs" / "outputs.md"]
    assert len(pages) > 4
    for page in pages:
        named = re.findall(
            r"`(\w+\.(?:_?[A-Z][A-Z0-9_]*|(?<=Settings\.)\w+))`", page.read_text("utf-8")
        )
        assert page.name == "outputs.md" or len(named) > 3
        assert set(named) - known == set(), page.name


def test_gallery_is_up_to_date(repository: Path) -> None:
    script = load_script(repository / "docs" / "make_gallery.py")
    page = (repository / "docs" / "gallery.md").read_text(encoding="utf-8")
    assert page == script.render(), "run `make docs`"
    pictures = {path.stem: path for path in script.PICTURES.glob("*.png")}
    assert set(pictures) == {*axisight.effect_table(), "motions"}, "run `make gallery`"
    sizes = [path.stat().st_size for path in pictures.values()]
    assert max(sizes) < 40_000
    assert sum(sizes) < 2_000_000


def test_every_plotting_function_is_on_its_page(repository: Path) -> None:
    script = load_script(repository / "docs" / "make_plots.py")
    page = (repository / "docs" / "plots.md").read_text(encoding="utf-8")
    assert page == script.render(), "run `make docs`"
    shown = {path.rpartition(".")[2] for path in script.SHOWN}
    assert shown == {path.stem for path in script.PICTURES.glob("*.png")}, "run `make gallery`"
    assert {name for name in dir(axisight) if name.startswith("plot_")} <= shown
    assert sum(path.stat().st_size for path in script.PICTURES.glob("*.png")) < 1_000_000


def test_gallery_draws_what_the_effect_does(repository: Path) -> None:
    script = load_script(repository / "docs" / "make_gallery.py")
    named = [name for names in script.OVER.values() for name in names]
    assert len(named) == len(set(named))
    known = set(axisight.effect_table())
    assert {*named, *script.ON_AXIS_2, *script.SIZES, *script.FROM_THE_START} <= known
    robot = axisight.load_robot(script.ROBOT)
    reference = script.references(robot, script.FAST)
    base = script.moved(robot, axisight.simulate(robot, reference))
    constant = axisight.Effect("torque_offset", 1, {"offset_nm": 0.5})
    run = axisight.simulate(robot, reference, effects=[constant])
    missing = run["torque_cmd_nm"].values - base.torque
    figure = script.picture(axisight.effect_info("torque_offset"), base, missing)
    assert all(axes.get_xlabel().endswith("]") for axes in figure.axes)
    assert figure.axes[0].get_ylabel() == "missing torque,\naxis 1 [Nm]"
    drawn = figure.axes[0].lines[1].get_ydata()
    assert drawn == pytest.approx(-0.5, abs=1e-3)


def test_table_cells_cannot_break_the_effects_page(repository: Path) -> None:
    script = load_script(repository / "docs" / "make_effects.py")
    parameter = {"name": "p", "unit": "a|b", "role": "shape"} | dict.fromkeys(
        ("neutral", "lower", "upper", "typical", "spread"), 0.0
    )
    parameter["prior"] = "uniform"
    effect = {"name": "e", "summary": "s|t", "equation": "x", "source": "y"}
    effect |= {"scope": "arm", "acts": "arm", "parameters": [parameter]}
    effect |= {"family": "arm", "contains": [], "parts": [], "usual": [], "twins": []}
    effect |= {"stands_for": None, "linear": "no", "inverse_dynamics": False}
    effect |= {"twins_alone": False, "plainer": None, "resembles": None, "formula": {"error": 0.02}}
    page = script.render([effect]).removeprefix(script.HEAD)
    rows = [line for line in page.splitlines() if line.startswith("| ")]
    for row, columns in zip(rows, (3, 3, 7, 7), strict=True):
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


def test_the_account_page_has_every_rule_and_move(repository: Path) -> None:
    page = (repository / "docs" / "explain.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| ([a-z ]+) \| ([A-Z].*) \|$", page, flags=re.MULTILINE))
    assert rows == {name.replace("_", " "): why for name, why in (RULES | MOVES).items()}
