"""What is said of the files that a diagnosis hands over: doubts, and why there is none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from axisight import load_robot
from axisight.cli import outcomes
from axisight.cli.model_options import ModelOptions
from axisight.gap import Interval
from axisight.gap.facts.result import Cause
from axisight.gap.verdict.headline import clear_changes
from diagnosis_data import explained, of
from import_data import URDF, written

ONE = Interval(0.05, 0.045, 0.055)
RIVALS = ("viscous_friction@1", "payload")
DRY = Cause(
    "coulomb_friction", 1, 0.5, {"coulomb_nm": ONE}, {"coulomb_nm": "Nm"}, ONE, rivals=RIVALS
)


@pytest.fixture
def said(monkeypatch) -> list[str]:
    lines: list[str] = []
    monkeypatch.setattr(outcomes, "say", lines.append)
    return lines


def test_why_there_is_no_experiment(said, tmp_path):
    closed, open_case = replace(explained(), equivalent=()), of("undecidable")
    cases = {
        "nothing is open": closed,
        "no cause was named, so none has a rival": replace(of("unknown"), mode="closed_loop"),
        "no motion tells torque_constant@2 and payload apart": open_case,
    }
    for words, found in cases.items():
        said.clear()
        outcomes.write_found_experiment(found, tmp_path, to_show=False)
        assert len(said) == 1
        assert words in said[0], words
        assert ("nothing is open" in said[0]) == (found is closed)
        assert ("--to-show" in said[0]) == words.startswith(("nothing", "no cause"))


def written_model(tmp_path: Path, cause: Cause, refit: dict[str, Interval], name: str) -> str:
    source = written(tmp_path, URDF)
    inputs = SimpleNamespace(robot_source=source, robot=load_robot(source))
    found = replace(explained(), causes=(cause,), refit=refit)
    outcomes.write_found_model(
        found, inputs, ModelOptions(None, None, None), tmp_path / name, force=False
    )
    return (tmp_path / name).read_text("utf-8")


@pytest.mark.parametrize("name", ["new.urdf", "new.toml"])
def test_a_cause_in_doubt_is_written_as_one(said, tmp_path, name):
    text = written_model(tmp_path, DRY, {}, name)
    assert "the data cannot tell it from viscous_friction@1 or payload" in text
    assert said[1:] == [
        "in doubt: coulomb_friction@1 is in it, but this data cannot tell it from viscous_friction@1 or payload"
    ]


def test_a_sure_cause_has_no_doubts(said, tmp_path):
    assert "cannot tell" not in written_model(tmp_path, replace(DRY, rivals=()), {}, "new.urdf")
    assert len(said) == 1


def test_what_was_refitted_and_is_not_written_is_said(said, tmp_path):
    refit = {"a.mass": Interval(0.06, 0.048, 0.072), "b.mass": Interval(0.01, -0.01, 0.03)}
    written_model(tmp_path, replace(DRY, rivals=()), refit, "new.urdf")
    assert said[1] == (
        "not in it: what was re-fitted within its tolerance (a.mass +6 %); part of the fall of the gap is that"
    )


def test_changes_are_told_by_size_and_counted():
    clear = {f"j{k}.mass": Interval(-0.01 * k, -0.02 * k, -0.001 * k) for k in range(1, 7)}
    told = clear_changes({**clear, "other.mass": Interval(0.3, -0.1, 0.7)})
    assert told == ["j6.mass -6 %", "j5.mass -5 %", "j4.mass -4 %", "j3.mass -3 %", "and 2 more"]
