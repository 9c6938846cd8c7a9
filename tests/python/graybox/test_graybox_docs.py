"""What docs/gray_box.md shows runs, and does what the page says of the three steps."""

import contextlib
import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest


@pytest.fixture(scope="module")
def shown(repository: Path) -> dict[str, Any]:
    page = (repository / "docs" / "gray_box.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    with contextlib.redirect_stdout(io.StringIO()):
        exec("\n".join(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)), names)
    return names


def test_three_steps_of_the_page(shown: dict[str, Any]) -> None:
    found = shown["found"]
    truth = {"J_m": 0.0121, "J_a": 1130.0, "k1": 1.46e6, "k3": 3.72e10, "d": 2630.0}
    truth |= {"F_v": 0.013, "F_c": 0.644}
    for name, value in truth.items():
        assert found.fit.parameters[name] == pytest.approx(value, rel=5e-3), name
    for name in ("J_m", "J_a", "k1"):
        assert found.initial.start[name] == pytest.approx(truth[name], rel=0.03), name
    assert found.initial.start["k3"] == pytest.approx(truth["k3"], rel=0.4)


def test_chain_of_the_page(shown: dict[str, Any]) -> None:
    chain = shown["chain"]
    np.testing.assert_allclose(chain.poles_rad_s, [58.0, 80.0], rtol=1e-9)
    np.testing.assert_allclose(chain.zeros_rad_s, [35.9, 76.5], rtol=1e-9)
