"""What docs/monte_carlo.md shows runs, its table has every key, and the study in examples is read."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from axisight import montecarlo
from axisight.montecarlo.design import core_study, freeze
from key_tables import keys, same, told


@pytest.fixture
def page(repository: Path) -> str:
    return (repository / "docs" / "monte_carlo.md").read_text(encoding="utf-8")


def test_the_examples(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run, design = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    names: dict[str, Any] = {}
    exec(design, names)
    study = names["study"]
    written = montecarlo.Study(
        robot="irb6600_like",
        excitation=montecarlo.Excitation(
            multisine=montecarlo.Multisine(period_s=1.0, band_hz=(2.0, 40.0), peak_rad_s=8.0)
        ),
    )
    assert study == written
    exec(run.replace("runs=250", "runs=4"), names)
    assert np.isfinite(names["result"].arithmetic_mean.values).all()
    assert (names["result"]["count"] == 4).all()
    assert len(montecarlo.failures(names["result"])) == 0


def test_the_table_has_every_key_of_a_study(page: str) -> None:
    section = page.split("\n## The study\n")[1].split("\n## ", maxsplit=1)[0]
    same(told(section), keys(montecarlo.Study))


def test_the_study_in_examples_shows_every_section(page: str, repository: Path) -> None:
    path = repository / "examples" / "monte_carlo" / "study.toml"
    assert f"(../{path.relative_to(repository)})" in page
    study = montecarlo.read_study(path)
    core_study(freeze(study))
    shown = study.model_dump(exclude_unset=True)
    assert set(montecarlo.Study.model_fields) - set(shown) == {"robot_parameters"}
    assert set(shown["excitation"]) == {"multisine", "square", "directions"}
