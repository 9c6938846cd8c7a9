"""What docs/frequency_fit.md shows runs, and does what the page says."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest


@pytest.fixture(scope="module")
def shown(repository: Path) -> dict[str, Any]:
    page = (repository / "docs" / "frequency_fit.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    exec("\n".join(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)), names)
    return names


def test_the_robot_comes_back(shown: dict[str, Any]) -> None:
    fit, truth = shown["fit"], shown["truth"]
    error = fit.values - np.array([truth[name] for name in fit.names])
    # Chi-squared with 5 degrees of freedom: below 26 with probability 0.9999.
    assert error @ np.linalg.solve(fit.covariance, error) < 26
    assert shown["better"].parameters()["axis1.stiffness"] == fit.values[0]


def test_what_stays_unknown_is_named(shown: dict[str, Any]) -> None:
    (sentence,) = shown["plan"].words()
    assert re.match(r"only axis1.motor_inertia \+ .* axis1.inertia_scale .to 9", sentence)


def test_operating_points_are_chosen(shown: dict[str, Any]) -> None:
    choice = shown["choice"]
    assert len(choice.chosen) == 3
    assert 0.8 < choice.efficiency <= 1
