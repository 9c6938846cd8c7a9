"""What results show of themselves: few lines in a terminal, tables that can be read in a notebook."""

import dataclasses
import importlib
import inspect
import re
from html.parser import HTMLParser
from pathlib import PurePosixPath

import numpy as np
import pytest
import xarray as xr

import axisight
from axisight.display.summary import shortened, summarized
from diagnosis_data import explained, of

ROOMS = [
    "blackbox", "calibration", "effects", "excitation", "fitting", "frequency_fit", "frf", "graybox",
    "identifiability", "logs", "montecarlo", "records", "rigid_body", "robot", "robot_file",
    "write_back", "gap",
]  # fmt: skip
# Options that a caller writes down himself; their repr is the call.
OPTIONS = {
    "Clipping", "LpRefinement", "FitOptions", "FrequencyFitOptions", "FitSettings", "FastMethod",
    "Finding", "AxisParameter", "Servo", "Labelled", "Effect", "ExperimentLimits", "DriveTerms",
    "IdentificationFinding",
}  # fmt: skip
MANY = 5000


def public() -> dict[str, type]:
    """Every public dataclass of the rooms that results come from, by name of room and class."""
    found = {}
    for room in ROOMS:
        module = importlib.import_module(f"axisight.{room}")
        for name in module.__all__:
            kind = getattr(module, name)
            if inspect.isclass(kind) and dataclasses.is_dataclass(kind) and name not in OPTIONS:
                found[f"{room}.{name}"] = kind
    return found


def large(field: dataclasses.Field) -> object:
    """A value of the kind that a field has, far too large to be shown."""
    kind = str(field.type)
    if field.name in {"names", "free"} or kind.startswith("tuple[str"):
        return tuple(f"parameter_{k}_of_a_long_name" for k in range(MANY))
    if "Mapping[str" in kind or kind.startswith("dict"):
        return {f"name {k}": k / 3 for k in range(MANY)}
    if kind.startswith("tuple"):
        return tuple(k / 3 for k in range(MANY))
    if re.search(r"Array|Real|Floats|NDArray|Complex|Lines|Integers", kind):
        return np.arange(MANY) / 3
    if "Dataset" in kind:
        return xr.Dataset({"a": ("time", np.zeros(MANY))})
    return {"float": 1 / 3, "int": 7, "bool": True}.get(
        kind.split(" ", maxsplit=1)[0], "word " * 200
    )


class Read(HTMLParser):
    """Tags that are open, tables, and heads without a scope."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open, self.tables, self.captions, self.bare = [], 0, 0, 0
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        self.tables += tag == "table"
        self.captions += tag == "caption"
        self.bare += tag == "th" and dict(attrs).get("scope") not in {"col", "row"}

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def check(thing: object) -> None:
    text, page = repr(thing), Read(thing._repr_html_())
    assert text.count("\n") < 30, text
    assert not re.search(r"\d\.\d{9}", text), text
    assert max(map(len, text.splitlines())) < 400
    assert page.open == [] and page.bare == 0
    assert page.captions == page.tables


@pytest.mark.parametrize("name", public())
def test_a_public_result_shows_little_of_much(name):
    kind = public()[name]
    assert hasattr(kind, "_repr_html_"), "decorate it with axisight.display.summary.summarized"
    thing = object.__new__(kind)
    for field in dataclasses.fields(kind):
        object.__setattr__(thing, field.name, large(field))
    own = "_repr_html_" in kind.__dict__ and kind._repr_html_.__module__ != summarized.__module__
    if own or hasattr(kind, "_summary"):
        return  # of one that is made up, it cannot compute what it shows
    check(thing)


@pytest.mark.parametrize("verdict", ["none", "explained", "unknown", "undecidable"])
def test_a_diagnosis_shows_its_verdict_gap_and_causes(verdict):
    found = of(verdict)
    check(found)
    text = repr(found)
    assert found.headline in text and verdict in text.splitlines()[0]
    if verdict == "explained":
        assert "coulomb_nm 0.612 Nm" in text and "97 %" in text


def test_parts_of_a_diagnosis_are_short():
    found = explained()
    for part in (found.gap, found.causes[0], found.axis(2), found.ranking[0], found.settings):
        if not isinstance(part, dict):
            check(part)
    assert (
        repr(found.causes[0].parameters["coulomb_nm"])
        == "Interval(value=0.612, low=0.583, high=0.641)"
    )
    assert "0.612 (0.583 to 0.641)" in repr(found.causes[0])


def test_linear_models_show_parameters_with_standard_errors():
    rng = np.random.default_rng(0)
    u = rng.normal(size=400)
    y = np.zeros(400)
    for n in range(2, 400):
        y[n] = 1.2 * y[n - 1] - 0.5 * y[n - 2] + 0.7 * u[n - 1] + 0.01 * rng.normal()
    data = axisight.records.Experiment(input=u[:, None], output=y[:, None], sample_time_s=1e-3)
    model = axisight.blackbox.arx(data, na=2, nb=1, nk=1)
    check(model)
    text = repr(model)
    assert text.startswith("ARXModel") and "+-" in text and "0.001 s" in text


def test_robots_effects_and_logs_are_short():
    robot = axisight.load_robot("irb6600_like")
    for thing in (robot, robot.joints[0], axisight.effect_info("backlash")):
        check(thing)
    effect = axisight.Effect("coulomb_friction", "shoulder", {"coulomb_nm": 0.1 + 0.2})
    assert repr(effect) == "Effect('coulomb_friction', 'shoulder', {'coulomb_nm': 0.3})"


@pytest.mark.parametrize(
    ("value", "name", "text"),
    [
        (1 / 3, "sample_time_s", "0.3333 s"),
        (np.array([1.0, 2.5]), "rms_nm", "1, 2.5 Nm"),
        (np.zeros((3, 200)), "position_rad", "3 x 200 numbers, 0 to 0 rad"),
        (True, "converged", "yes"),
        (("a", "b", "c", "d", "e", "f"), "names", "a, b, c, d, and 2 more"),
        (np.array([]), "lines", "none"),
        ({"a": 1 / 3}, "values", "a: 0.3333"),
        (2e-6, "compliance_rad_nm", "2e-06 rad/Nm"),
        (2.5, "static_moment_kg_m", "2.5 kg m"),
        (2.5, "compliance_rad_nm_std", "2.5 rad/Nm"),
        (PurePosixPath("logs/first.csv"), "source", "logs/first.csv"),
        ((PurePosixPath("a/b"), "c"), "files", "a/b, c"),
    ],
)
def test_values_are_shortened_with_their_unit(value, name, text):
    assert shortened(value, name) == text
