"""What docs/rigid_body.md shows runs, and does what the page says."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest


@pytest.fixture(scope="module")
def shown(repository: Path) -> dict[str, Any]:
    page = (repository / "docs" / "rigid_body.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    exec("\n".join(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)), names)
    return names


def test_the_axis_comes_out(shown: dict[str, Any]) -> None:
    base, estimate = shown["base"], shown["estimate"]
    assert len(base) == 4
    assert base.combinations[0] == "axis1.inertia_zz + 5.031e+04 axis1.motor_inertia"
    truth = base.from_standard(shown["truth"])
    lower, upper = estimate.interval(0.999)
    assert ((lower < truth) & (truth < upper)).all()
    assert shown["held_out"].rms_nm.item() == pytest.approx(0.2, rel=0.05)
    assert np.abs(shown["by_energy"].values / estimate.values - 1)[[0, 2]].max() < 0.05
