"""What docs/logs.md and docs/cases.md show runs, and does what the pages say."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from axisight.logs import MAPS
from axisight.logs.case import _CaseFile
from axisight.logs.columns import (
    Address,
    AxisColumns,
    ColumnMap,
    PositionColumn,
    TemperatureColumn,
    TimeColumn,
    TorqueColumn,
    VelocityColumn,
)
from axisight.logs.patterns import AxisPattern, ColumnPattern
from key_tables import keys, same, told


@pytest.fixture
def page(repository: Path) -> str:
    return (repository / "docs" / "logs.md").read_text(encoding="utf-8")


@pytest.fixture
def cases(repository: Path) -> str:
    return (repository / "docs" / "cases.md").read_text(encoding="utf-8")


def test_the_examples(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec("\n".join(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)), names)
    assert names["log"].sample_time_s == pytest.approx(0.01)
    assert names["log"].is_resampled
    assert (names["ur"].n_axes, names["ur"].sample_rate_hz) == (2, pytest.approx(125))
    assert names["ur"].notes[0].startswith("torque: target_moment is what the model")
    guess = names["guess"].columns
    assert (guess.time.unit, guess.side) == ("ms", "joint")
    assert [a.position.unit for a in guess.axis] == ["deg", "deg"]
    assert [a.velocity.unit for a in guess.axis] == ["rpm", "rpm"]
    assert '# torque = { name = "i_2", unit = "A", scale = ... }' in names["guess"].text
    assert np.isfinite(names["log"].torque_nm).all()


def test_the_case(cases: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec("\n".join(re.findall(r"```python\n(.*?)```", cases, flags=re.DOTALL)), names)
    case = names["case"]
    assert case.roles == ("estimation", "validation")
    assert case.estimation[0].period_s == 10.0


def test_the_table_has_every_map(page: str) -> None:
    assert set(re.findall(r"^\| `([a-z-]+)` \| [^|]+ \| [^|]+ \|$", page, flags=re.M)) >= set(MAPS)


def test_the_table_has_every_key_of_a_map(page: str) -> None:
    section = page.split("\n## Column maps\n")[1].split("\n## ", maxsplit=1)[0]
    maps, signals = section.split("\nA signal is a table")
    known = keys(ColumnMap, leaves=(Address,))
    # Stamps have a table of their own, and stand in this one with what is more than an address.
    assert set(TimeColumn.model_fields) - set(Address.model_fields) == {"unit", "resample_hz"}
    known |= {"time.unit": "`s`", "time.resample_hz": "none"}
    # Those of any number of axes.
    assert set(ColumnPattern.model_fields) - set(ColumnMap.model_fields) == {"axes", "every_axis"}
    assert set(AxisPattern.model_fields) == set(AxisColumns.model_fields)
    known |= {"every_axis": "needed without `[[axis]]`", "axes": "none"}
    same(told(maps), known)
    kinds = (PositionColumn, VelocityColumn, TorqueColumn, TemperatureColumn)
    zeros = {"offset", "raw_range", "unit_range"}
    assert {frozenset(keys(kind).keys() | zeros) for kind in kinds} == {
        frozenset(keys(PositionColumn))
    }
    same(told(signals), keys(PositionColumn))
    assert keys(TemperatureColumn)["unit"] == "`degC`"
    units = {
        unit
        for kind in (*kinds, TimeColumn)
        for unit in kind.model_fields["unit"].annotation.__args__
    }
    assert units <= set(re.findall(r"`([^`\n]+)`", maps))


def test_the_table_has_every_key_of_a_case(cases: str) -> None:
    section = cases.split("\n## ", maxsplit=1)[0]
    # Without a log a case is refused, in words of its own.
    same(told(section), keys(_CaseFile) | {"log": "needed"})
