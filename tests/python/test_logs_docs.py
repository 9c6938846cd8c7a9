"""What docs/logs.md shows runs, and does what the page says."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from axisight.logs import MAPS


@pytest.fixture
def page(repository: Path) -> str:
    return (repository / "docs" / "logs.md").read_text(encoding="utf-8")


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


def test_the_table_has_every_map(page: str) -> None:
    assert set(re.findall(r"^\| `([a-z-]+)` \| [^|]+ \| [^|]+ \|$", page, flags=re.M)) >= set(MAPS)
