"""What docs/axis_fit.md shows runs, and does what the page says."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest


@pytest.fixture(scope="module")
def shown(repository: Path) -> dict[str, Any]:
    page = (repository / "docs" / "axis_fit.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    exec("\n".join(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)), names)
    return names


def test_page_recovers_its_truth(shown: dict[str, Any]) -> None:
    for fit in (shown["fit"], shown["predicted"]):
        assert fit.converged
        off = np.abs(fit.values - [shown["truth"][n] for n in fit.free])
        # Seven parameters within four standard deviations.
        assert np.all(off < 4 * fit.std)
    assert shown["low"] < shown["high"]
    assert shown["share"] >= 0.5
