"""The JSON of a verdict: every key described, none unknown, and what the contract asks for there."""

import importlib.util
import json
import re
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from typer.testing import CliRunner

from axisight import Diagnosis, Settings
from axisight.cli import app
from axisight.gap import Candidate, Cause, Gap, Interval, Remainder, Where, verdict_schema
from diagnosis_data import VERDICTS, explained, gap, of, one_prismatic

SCHEMA = verdict_schema()
CHECK = jsonschema.Draft202012Validator(SCHEMA)
# What a reader may count on.
CONTRACT = {
    "": {"schema", "mode", "verdict", "gap", "where", "causes", "alternatives", "equivalent",
         "next_experiment", "p_none", "p_unknown", "axes", "remainder", "ranking", "checks",
         "findings", "settings"},
    "gap": {"before", "after", "floor", "pooled", "per_axis"},
    "gap.per_axis": {"before", "after", "floor"},
    "where.items": {"axis", "share", "band_hz", "regime", "evidence"},
    "causes.items": {"effect", "axis", "probability", "parameters", "gap_reduction", "family",
                     "family_probability"},
    "causes.items.parameters.values": {"value", "ci95"},
    "causes.items.gap_reduction": {"value", "ci95"},
    "alternatives.items": {"effect", "axis", "probability"},
    "axes.items": {"axis", "verdict", "gap", "causes"},
    "remainder": {"gap", "where"},
    "settings": {f.name for f in fields(Settings)} - {"threads", "time_limit_s"},
}  # fmt: skip


def resolved(part: dict[str, Any]) -> dict[str, Any]:
    """A part of the schema with what it refers to."""
    if "$ref" in part:
        target = SCHEMA["$defs"][part["$ref"].removeprefix("#/$defs/")]
        return {**target, **part}
    return part


def objects(part: dict[str, Any], path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """All objects with named keys and all maps, with their path."""
    part = resolved(part)
    for option in part.get("anyOf", []):
        yield from objects(option, path)
    if "items" in part:
        yield from objects(part["items"], f"{path}.items".lstrip("."))
    if "properties" in part:
        yield path, part
        for key, value in part["properties"].items():
            yield from objects(value, f"{path}.{key}".lstrip("."))
    elif isinstance(part.get("additionalProperties"), dict):
        yield from objects(part["additionalProperties"], f"{path}.values".lstrip("."))


OBJECTS = dict(objects(SCHEMA))


def plain(diagnosis: Diagnosis) -> dict[str, Any]:
    """The verdict as a reader of the file gets it."""
    return json.loads(json.dumps(diagnosis.to_verdict(), allow_nan=False))


def test_the_schema_is_one():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["$schema"].endswith("2020-12/schema")


@pytest.mark.parametrize("path", OBJECTS)
def test_every_key_is_described_and_no_other_allowed(path):
    part = OBJECTS[path]
    assert part["additionalProperties"] is False
    # Two axes have effects between them alone; a verdict has axes of its own. A remainder is modelled on request.
    optional = {"axes", "modelled"} & set(part["properties"]) if path else set()
    assert set(part["required"]) == set(part["properties"]) - optional
    for key, value in part["properties"].items():
        assert len(value.get("description", "")) > 8, f"{path}.{key}"


@pytest.mark.parametrize("path", CONTRACT)
def test_what_readers_count_on_is_required(path):
    assert CONTRACT[path] <= set(OBJECTS[path]["required"])


def test_the_settings_are_those_of_python():
    assert set(OBJECTS["settings"]["properties"]) == CONTRACT["settings"]


def test_names_are_those_of_python():
    keys = set(SCHEMA["properties"]) - {"schema"}
    assert keys <= {f.name for f in fields(Diagnosis)}
    pairs = {
        "gap": Gap, "causes.items": Cause, "where.items": Where, "ranking.items": Candidate,
        "remainder": Remainder,
    }  # fmt: skip
    for path, kind in pairs.items():
        own = {f.name for f in fields(kind)} | {"per_axis"}
        assert set(OBJECTS[path]["properties"]) <= own, path


@pytest.mark.parametrize("verdict", VERDICTS)
def test_verdicts_obey_the_schema(verdict):
    CHECK.validate(plain(of(verdict)))


@pytest.mark.parametrize("n_axes", [1, 3, 6])
def test_arms_of_any_size_obey_the_schema(n_axes):
    CHECK.validate(plain(explained(n_axes)))


def test_a_simulation_that_broke_off_is_null(tmp_path):
    broken = gap(float("nan"), float("nan"), float("nan"), 0.05, 3)
    diagnosis = replace(of("unknown"), gap=broken, refit={"mass": Interval(0.0, -np.inf, np.inf)})
    verdict = plain(diagnosis)
    assert verdict["gap"]["before"] is None
    assert verdict["gap"]["per_axis"]["floor"] == [0.05] * 3
    assert verdict["refit"]["mass"]["ci95"] == [None, None]
    CHECK.validate(verdict)
    # In the file too, which is JSON: no NaN.
    diagnosis.save_verdict(tmp_path / "verdict.json")
    assert json.loads((tmp_path / "verdict.json").read_text()) == verdict


def test_pooled_over_axes_that_turn_and_slide_is_null():
    diagnosis = explained()
    diagnosis = replace(diagnosis, gap=replace(diagnosis.gap, pooled=None))
    assert plain(diagnosis)["gap"]["pooled"] is None
    CHECK.validate(plain(diagnosis))
    CHECK.validate(plain(replace(diagnosis, remainder=None)))


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all objects in a document."""
    if isinstance(value, dict):
        yield path
        for key, inner in value.items():
            yield from places(inner, (*path, key))
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from places(inner, (*path, i))


# Names in these are the user's: parameters, quantities.
MAPS = re.compile(r"parameters$|refit$|tolerances$")


def test_unknown_and_missing_keys_fail_everywhere():
    base = plain(of("undecidable"))
    seen = 0
    for path in places(base):
        name = ".".join(map(str, path))
        if MAPS.search(name):
            continue
        target = verdict = json.loads(json.dumps(base))
        for step in path:
            target = target[step]
        target["colour"] = "red"
        assert not CHECK.is_valid(verdict), name
        del target["colour"]
        for key in list(target):
            value = target.pop(key)
            assert not CHECK.is_valid(verdict), f"{name}: {key}"
            target[key] = value
        assert CHECK.is_valid(verdict)
        seen += 1
    assert seen > 25


@pytest.mark.parametrize(
    ("verdict", "change"),
    [
        ("explained", {"verdict": "maybe"}),
        ("explained", {"causes": []}),
        ("none", {"causes": plain(explained())["causes"]}),
        ("undecidable", {"equivalent": []}),
        ("undecidable", {"next_experiment": None}),
        ("unknown", {"p_none": 1.2}),
        ("unknown", {"mode": "open_loop"}),
        ("unknown", {"schema": "axisight.verdict/1"}),
    ],
)
def test_what_contradicts_itself_fails(verdict, change):
    assert not CHECK.is_valid({**plain(of(verdict)), **change})


def test_a_prismatic_axis_obeys_the_schema():
    diagnosis = replace(one_prismatic(), provenance=explained(1).provenance)
    CHECK.validate(plain(diagnosis))


def test_the_command_line_prints_the_schema():
    result = CliRunner().invoke(app, ["schema"])
    assert result.exit_code == 0
    assert json.loads(result.output) == SCHEMA


def test_the_page_of_the_verdict_is_that_of_the_schema(repository: Path, tmp_path: Path) -> None:
    page = (repository / "docs" / "verdict.md").read_text(encoding="utf-8")
    spec = importlib.util.spec_from_file_location("page", repository / "docs" / "make_verdict.py")
    assert spec is not None and spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert page == script.page(SCHEMA), "run `make docs`"
    # Every key of a verdict has its line.
    for key in explained().to_verdict():
        assert f"| `{key}` |" in page
    explained().save_verdict(tmp_path / "verdict.json")
    (snippet,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    exec(snippet.replace('"verdict.json"', repr(str(tmp_path / "verdict.json"))), {})
