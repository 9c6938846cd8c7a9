"""What docs/black_box.md, identifiability.md and pages of robot files show runs and does what they say."""

import inspect
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from axisight import blackbox, identifiability, robot_file


def run(repository: Path, folder: Path, page: str) -> dict[str, Any]:
    text = (repository / "docs" / page).read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        exec("\n".join(re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)), names)
    return names


def test_black_box_page(repository: Path, tmp_path: Path) -> None:
    shown = run(repository, tmp_path, "black_box.md")
    judge, states, arx = (shown[name] for name in ("judge", "states", "arx"))
    assert blackbox.fit_percent(judge.output, states.model.simulate(judge))[0] > 95
    mode = states.model.modes().isel(mode=1)
    assert abs(mode["frequency_hz"] - shown["robot"].modes()["frequency_hz"][2]) < 0.1
    assert blackbox.fit_percent(judge.output, arx.predict(judge))[0] > 80
    assert blackbox.fit_percent(judge.output, arx.simulate(judge))[0] < 0
    assert len(shown["tests"].advice()) == 2
    assert np.isfinite(shown["response"]["variance"].values).all()
    assert shown["model"].status == "converged" and shown["least"].order == 6
    mode = shown["model"].modes().isel(mode=0)
    assert abs(mode["frequency_hz"] - 12.0) < 5 * mode["frequency_std_hz"]


def test_black_box_page_on_noise_models(repository: Path, tmp_path: Path) -> None:
    shown = run(repository, tmp_path, "black_box.md")
    jenkins = shown["jenkins"]
    true = np.array([0.2, 0.1, -1.6, 0.8, 0.5, -0.9])
    assert jenkins.status == "converged" and jenkins.residual_tests(shown["data"]).advice() == ()
    assert np.abs((jenkins.values - true) / jenkins.std).max() < 4
    assert shown["space"].status == "converged"


def test_closed_loop_methods_page(repository: Path, tmp_path: Path) -> None:
    """Every number that the page prints is what its code computes."""
    page = (repository / "docs" / "closed_loop_methods.md").read_text(encoding="utf-8")
    shown = run(repository, tmp_path, "closed_loop_methods.md")
    tables = re.findall(r"```text\n(.*?)```", page, flags=re.DOTALL)
    frame = shown["table"].to_dataframe().round(3)
    assert " ".join(tables[0].split()) == " ".join(str(frame).split())
    for approach, bias in re.findall(r"^(\w+) +bias +(\d+)%", tables[1], flags=re.MULTILINE):
        found = np.linalg.norm(shown["expected"]["bias"].sel(approach=approach)) / shown["size"]
        assert round(100 * found) == int(bias), approach
    assert shown["found"].controller_mismatch[0] < 1e-12
    assert np.isfinite(shown["response"]["variance"].values).all()


def test_identifiability_page(repository: Path, tmp_path: Path) -> None:
    shown = run(repository, tmp_path, "identifiability.md")
    words = shown["found"].words()
    assert "axis1.mass: not seen at all" in words
    assert any("axis1.motor_inertia" in w for w in words)
    advice = shown["recommend_experiments"](shown["slow"], shown["candidates"], limit=0.2)
    assert advice[0].startswith("add tones around the resonance: separates"), advice


def test_robot_files_page(repository: Path, tmp_path: Path) -> None:
    assert run(repository, tmp_path, "robot_files.md")["wide"].tolerances["stiffness"] == 0.05


def test_identified_values_page(repository: Path, tmp_path: Path) -> None:
    shown = run(repository, tmp_path, "identified_values.md")
    assert shown["back"].value("axis1.stiffness") == 1.482e6
    page = (repository / "docs" / "identified_values.md").read_text(encoding="utf-8")
    quoted = re.search(r"`(# identified: axis1\.stiffness[^`]*)`", page)
    assert quoted and quoted.group(1) in (tmp_path / "axis1.toml").read_text()
    files = {"axis1.toml", "axis1.identified.json", "axis.toml", "axis.identified.json"}
    assert {p.name for p in tmp_path.iterdir()} == files
    assert "not written: J_a" in shown["values"].provenance.notes


@pytest.mark.parametrize("module", [blackbox, identifiability, robot_file])
def test_public_names_are_documented(module) -> None:
    names = getattr(module, "__all__", None) or [
        n
        for n, thing in vars(module).items()
        if not n.startswith("_") and getattr(thing, "__module__", "") == module.__name__
    ]
    for name in names:
        thing = getattr(module, name)
        assert inspect.getdoc(thing) and not inspect.getdoc(thing).startswith(f"{name}("), name
        if inspect.isfunction(thing):
            text = inspect.getdoc(thing)
            wanted = [p for p in inspect.signature(thing).parameters if p != "path"]
            missing = [p for p in wanted if len(wanted) > 1 and p not in text]
            assert not missing, (name, missing)
