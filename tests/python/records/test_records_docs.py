"""What docs/records.md shows runs, and does what the page says."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from axisight.records import FindingKind


@pytest.fixture(scope="module")
def shown(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    page = (repository / "docs" / "records.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("page"))
        exec("\n".join(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)), names)
        names["written"] = {path.name for path in Path().iterdir()}
    return names


def test_period_lines_and_transient_are_found(shown: dict[str, Any]) -> None:
    prepared = shown["prepared"]
    assert prepared.period.n_samples * prepared.records.sample_time_s == pytest.approx(1.0)
    np.testing.assert_array_equal(prepared.records.lines, shown["tones"].lines)
    assert len(prepared.records.lines) == 59
    assert prepared.dropped_periods == 8
    assert not prepared.serious
    kinds = {finding.kind for finding in prepared.findings}
    assert kinds >= {FindingKind.PERIOD, FindingKind.LINES, FindingKind.TRANSIENT}
    assert 0 < shown["wait_s"] < 24


def test_response_comes_back_from_other_packages(shown: dict[str, Any]) -> None:
    response = shown["response"]
    xr.testing.assert_identical(shown["again"], response)
    for other in (shown["back"]["response"], shown["again"]["response"]):
        np.testing.assert_allclose(other.values, response["response"].values, rtol=1e-12)
    assert shown["back"]["response"].units == response["response"].units
    np.testing.assert_array_equal(shown["element"], response["response"].values[:, 0, 0])
    assert shown["written"] == {"matrix.png", "bode.png", "response.nc"}
