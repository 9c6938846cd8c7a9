"""What docs/excitation.md and docs/optimal_design.md show runs."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from axisight.excitation import read_design


def blocks(repository: Path, language: str, name: str = "excitation.md") -> list[str]:
    page = (repository / "docs" / name).read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", page, flags=re.DOTALL)


def test_snippets_run(repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec("\n".join(blocks(repository, "python")), {})
    # The example keeps within its limits.
    assert (tmp_path / "references.csv").exists()


def test_design_is_a_design(repository: Path) -> None:
    (text,) = blocks(repository, "toml")
    read_design(tomllib.loads(text))


def test_snippets_of_optimal_experiments_run(repository: Path) -> None:
    names: dict[str, Any] = {}
    exec("\n".join(blocks(repository, "python", "optimal_design.md")), names)
    # The page states a predicted gain of 16, and the fit of both steps is near the truth.
    assert names["best"].gain == pytest.approx(16, abs=0.5)
    true = names["robot"].parameters()["axis1.stiffness"]
    at = names["fit"].names.index("axis1.stiffness")
    assert abs(names["fit"].values[at] - true) < 4 * names["fit"].std[at]


def test_optimal_design_is_a_design(repository: Path) -> None:
    (text,) = blocks(repository, "toml", "optimal_design.md")
    assert read_design(tomllib.loads(text)).optimal is not None
