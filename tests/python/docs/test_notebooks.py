"""What notebooks show: tables of results with every text escaped, and progress."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from io import StringIO
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from rich.console import Console

import axisight
from axisight import Fitted, Log, load_robot, montecarlo
from axisight.display import html
from axisight.display.bars import terminal_bars
from axisight.frequency_fit.result import FrequencyFit
from axisight.graybox.axis_result import AxisFit
from axisight.logs import Case, LogReport
from axisight.logs.findings import Finding
from axisight.rigid_body.from_logs import LogIdentification
from axisight.rigid_body.result import RigidBodyEstimate
from diagnosis_data import HOSTILE, VERDICTS, explained, hostile, of

TAGS = {"div", "p", "strong", "table", "caption", "thead", "tbody", "tr", "th", "td", "progress"}


class Read(HTMLParser):
    """The tags, attributes and text of a piece of HTML, and whether all that opens is closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags, self.attributes, self.text, self.open = set(), set(), "", []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += f"{data} "


def shown(thing: object) -> str:
    """The text that a notebook shows of a thing, without anything but a table."""
    read = Read(thing._repr_html_())
    assert read.tags <= TAGS
    assert read.attributes <= {"scope"}
    return " ".join(read.text.split())


def log(name: str = "run", **more: object) -> Log:
    n = 100
    angle = np.linspace(-1, 2, n)[:, None] * [1, 10]
    torque = np.full((n, 2), np.nan)
    return Log(
        name=name, sample_time_s=0.01, time_s=np.arange(n) * 0.01, torque_nm=torque,
        position_rad=angle, source=Path("run.csv"), axis_kinds=("revolute", "prismatic"), **more,
    )  # fmt: skip


def fitted(name: str = "axis1.stiffness", warning: str = "on a bound") -> Fitted:
    one = np.ones((1, 1))
    values = np.array([1.4e6])
    return Fitted(
        (name,), values, np.array([1e3]), one, one, "stalled", 1.0, 2.0, 3, 4, 5.0, (), (warning,),
        None,
    )  # fmt: skip


def frequency_fit(name: str) -> FrequencyFit:
    made = FrequencyFit.__new__(FrequencyFit)
    given = {
        "names": (name,), "values": np.array([2.0]), "std": np.array([0.25]), "warnings": (name,),
        "interval": np.array([[1.5, 2.5]]), "status": "exact", "iterations": 3, "misfit": 1.07,
    }  # fmt: skip
    vars(made).update(given)
    return made


def axis_fit(name: str) -> AxisFit:
    made = AxisFit.__new__(AxisFit)
    parameter = SimpleNamespace(name=name, unit="Nm/rad")
    given = {
        "model": SimpleNamespace(parameters=[parameter]), "free": (name,), "warnings": (name,),
        "values": np.array([7.5]), "covariance": np.eye(1) / 4, "trusted": "white",
        "status": "exact", "iterations": 3, "fit_percent": (98.76,),
    }  # fmt: skip
    vars(made).update(given)
    return made


def log_identification(name: str) -> LogIdentification:
    estimate = RigidBodyEstimate.__new__(RigidBodyEstimate)
    base = SimpleNamespace(names=[name], units=["kg m^2"])
    given = {"base": base, "method": "wls", "n_samples": 99, "values": np.array([3.5])}
    vars(estimate).update(given | {"covariance": np.eye(1), "findings": (name,)})
    errors = xr.Dataset(
        {"relative_error": (("parameters", "log", "axis"), [[[0.05, 0.125]]])},
        coords={
            "parameters": ["estimate"],
            "log": [name],
            "axis": [1, 2],
            "held_out": ("log", [True]),
        },
    )
    return LogIdentification(estimate, None, (), errors, np.array([99, 99]))


def study(name: str = "mine") -> montecarlo.Study:
    wave = {"period_s": 1.0, "band_hz": [1.0, 30.0], "peak_rad_s": 5.0}
    return montecarlo.Study(name=name, robot=name, runs=17, excitation={"multisine": wave})


def test_a_robot_shows_its_axes():
    text = shown(load_robot("irb6600_like"))
    for words in (
        "payload, 20 states: 3 axes, 7 joints",
        "sample time 0.0005 s",
        "1 axis1 turns elastic",
    ):
        assert words in text, text
    text = shown(load_robot("two_mass_axis"))
    assert "with the effects nonlinear_stiffness@1, coulomb_friction@1" in text


def test_a_log_shows_what_it_has():
    text = shown(log(notes=("resampled linearly",)))
    for words in (
        "run: 1 s, 100 samples at 100 Hz, 2 axes",
        "position 1 rad -1 2",
        "position 2 m -10 20",
        "from run.csv resampled linearly",
    ):
        assert words in text, text
    assert "torque" not in text


def case(name: str = "mine") -> Case:
    logs = (log(name), log("held out"))
    return Case(name, Path(), Path(name), logs, ("estimation", "validation"))


def report(name: str = "torque_1") -> LogReport:
    findings = (Finding("ok", "rate", "uniform"), Finding("error", name, f"{name}: NaN"))
    return LogReport(Path(name), findings, 500.0, 40, 2)


def test_a_case_shows_what_logs_are_for():
    text = shown(case())
    assert "mine Logs log for duration rate axes mine estimation 1 s 100 Hz 2" in text
    assert "held out validation" in text


def test_a_report_on_a_log_shows_errors_first():
    text = shown(report())
    assert "torque_1: cannot be read, 40 samples, at 500 Hz, 2 axes" in text
    assert text.index("error torque_1") < text.index("ok rate uniform")
    sound = replace(report(), findings=(Finding("ok", "rate", "uniform"),), n_axes=None)
    assert "can be read, 40 samples, at 500 Hz Findings severity" in shown(sound)


@pytest.mark.parametrize("verdict", VERDICTS)
def test_a_diagnosis_shows_verdict_causes_and_gap(verdict):
    found = of(verdict)
    text = shown(found)
    assert f": {verdict} {' '.join(found.headline.split())}" in text
    assert all(cause.label in text for cause in found.causes)
    assert "axis verdict gap before re-fitted after noise" in text


def test_a_diagnosis_shows_values_with_units():
    text = shown(replace(explained(), next_experiment="Move slowly."))
    assert "coulomb_friction@2 0.970 coulomb_nm 0.612 Nm 0.583 to 0.641" in text
    assert "2 explained 46.5 % 43.5 % 6.2 % 5 %" in text
    assert "next experiment: Move slowly." in text
    broken = explained()
    gap = replace(broken.gap, before=float("inf"), after=float("nan"))
    assert "nan" not in shown(replace(broken, gap=gap))


def test_fits_show_values_with_errors():
    assert "fit: stalled after 3 iterations" in shown(fitted())
    assert "axis1.stiffness 1.4e+06 1000 on a bound" in shown(fitted())
    assert "p 2 0.25 1.5 2.5" in shown(frequency_fit("p"))
    text = shown(axis_fit("p"))
    assert "fit 98.76 % Parameters with standard errors parameter value" in text
    assert "standard error unit p 7.5 0.5 Nm/rad" in text
    text = shown(log_identification("p"))
    assert "p 3.5 1 kg m^2" in text
    assert "p (held out) estimate 5 % 12.5 %" in text


def test_a_study_shows_its_parts():
    text = shown(study())
    assert "mine: 17 runs of mine, seed 0" in text
    assert "excitation multisine (period_s 1.0" in text


ATTACKED = {
    "diagnosis": hostile,
    "log": lambda: replace(log(HOSTILE), source=Path(HOSTILE), notes=(HOSTILE,)),
    "fit": lambda: fitted(HOSTILE, HOSTILE),
    "frequency fit": lambda: frequency_fit(HOSTILE),
    "axis fit": lambda: axis_fit(HOSTILE),
    "fit to logs": lambda: log_identification(HOSTILE),
    "study": lambda: study(HOSTILE),
    "case": lambda: case(HOSTILE),
    "report on a log": lambda: report(HOSTILE),
}


@pytest.mark.parametrize("name", ATTACKED)
def test_names_are_shown_and_not_obeyed(name):
    assert HOSTILE.split()[0] in shown(ATTACKED[name]())


def test_names_in_a_robot_are_shown_and_not_obeyed():
    toml = load_robot("irb6600_like").toml
    attacked = toml.replace('"axis1"', "'<script>x</script>'").replace(
        '"irb6600-like, 250 kg payload, 20 states"', "'<img src=x onerror=y>'"
    )
    text = shown(axisight.Robot.from_toml(attacked))
    assert "<script>x</script>" in text
    assert "<img src=x onerror=y>" in text


def test_long_tables_are_cut():
    text = html.table(("a", "b"), ((str(i), "x") for i in range(1000)), "Many")
    assert "and 940 more" in Read(text).text
    assert text.count("<tr>") == 62
    assert html.table(("a",), [], "None") == ""
    assert len(html.lines(["x" * 10_000])) < 600


class Notebook:
    """What stands in for a kernel: the HTML that is shown, in order."""

    def __init__(self, monkeypatch) -> None:
        self.shown: list[str] = []
        shell = type("Shell", (type("ZMQInteractiveShell", (), {}),), {})()
        top, part = ModuleType("IPython"), ModuleType("IPython.display")
        top.get_ipython, top.display = lambda: shell, part
        part.HTML, part.display = str, self.display
        monkeypatch.setitem(sys.modules, "IPython", top)
        monkeypatch.setitem(sys.modules, "IPython.display", part)

    def display(self, text: str, display_id: bool) -> Notebook:
        assert display_id
        assert self.shown == []
        self.shown.append(text)
        return self

    def update(self, text: str) -> None:
        self.shown.append(text)


def test_progress_in_a_notebook_is_one_display(monkeypatch, capsys):
    notebook = Notebook(monkeypatch)
    with axisight.progress_bars() as bars:
        for i in range(1001):
            bars(HOSTILE, i, 1000)
        bars("next", 1, 4)
    assert 3 <= len(notebook.shown) < 200
    last = Read(notebook.shown[-1])
    assert last.tags <= TAGS
    assert last.attributes == {"value", "max"}
    assert f"{HOSTILE}: 1000 of 1000" in last.text
    assert "next: 1 of 4" in last.text
    assert capsys.readouterr() == ("", "")


def test_studies_report_to_the_same_bars(monkeypatch):
    notebook = Notebook(monkeypatch)
    with axisight.progress_bars() as bars:
        montecarlo.run(study("irb6600_like").changed(runs=2), progress=bars.study)
        bars.study(montecarlo.Progress(2, 2, 0, 1.0, 0.0, "<b>a worker was lost</b>"))
    text = Read(notebook.shown[-1]).text
    assert "runs: 2 of 2" in text
    assert "<b>a worker was lost</b>" in text


def test_progress_elsewhere_is_on_standard_error(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=object))
    with axisight.progress_bars() as bars:
        bars("screening", 3, 4)
    said = capsys.readouterr()
    assert said.out == ""
    assert "screening" in said.err
    assert "3/4" in said.err


def test_bars_of_a_terminal_show_names_as_they_are():
    console = Console(file=StringIO(), width=100)
    with terminal_bars(console) as bars:
        bars("[red]x[/]", 1, 2)
        bars.note("[bold]lost[/]")
    said = console.file.getvalue()
    assert "[red]x[/]" in said
    assert "[bold]lost[/]" in said


def test_results_are_loaded_without_bars():
    code = "import sys, axisight; axisight.Robot; print('rich.progress' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert done.stdout.split() == [b"False"]
