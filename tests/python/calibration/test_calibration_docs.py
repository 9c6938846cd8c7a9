"""What docs/calibration.md shows runs, and finds what was put in."""

import re
from pathlib import Path

import pytest


def test_snippet_finds_offset_and_tool(repository: Path) -> None:
    page = (repository / "docs" / "calibration.md").read_text(encoding="utf-8")
    names: dict = {}
    exec("\n".join(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)), names)
    found = names["found"]
    assert found.status == "converged"
    deviation = found.table["deviation"]
    spread = found.table["standard_error"]
    for name, true in (("axis2.offset", 1e-3), ("tool.x", 2e-3), ("axis3.offset", 0.0)):
        error = abs(float(deviation.sel(parameter=name)) - true)
        assert error < 4 * float(spread.sel(parameter=name)), name
    held = found.errors["rms"].sel(kind="position_m", of="cross_validation")
    # Three coordinates of 0.05 mm.
    assert float(held.sel(when="calibrated")) == pytest.approx(8.7e-5, rel=0.2)
    assert float(held.sel(when="nominal")) > 1e-3
