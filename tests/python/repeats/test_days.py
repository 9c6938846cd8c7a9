"""The day of a log, by its folder or a pattern of its name."""

from pathlib import Path

import pytest

from axisight.errors import InputError
from axisight.repeats import days_of


def test_by_folder():
    assert days_of([Path("x/mon/a.csv"), Path("x/tue/a.csv")]) == ["mon", "tue"]


def test_folders_of_one_name_are_told_apart_by_their_parents():
    found = days_of([Path("mon/logs/a.csv"), Path("tue/logs/a.csv")])
    assert found == ["mon/logs", "tue/logs"]


@pytest.mark.parametrize("pattern", ["{day}_run*", "{day}_run?.csv", "{day}_*"])
def test_by_pattern(pattern):
    assert days_of([Path("mon_run1.csv"), Path("tue_run1.csv")], pattern) == ["mon", "tue"]


def test_wrong_patterns():
    with pytest.raises(InputError, match=r"one \{day\}"):
        days_of([Path("a.csv")], "date")
    with pytest.raises(InputError, match=r"fit 'x_\{day\}', got a.csv"):
        days_of([Path("a.csv")], "x_{day}")
