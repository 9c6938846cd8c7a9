"""The page of the posterior: its snippets run as they stand, on a small case."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from axisight import Effect
from axisight.cli import app
from gap_data import bare_axis, bare_case, log_of, reference, scattered

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


@pytest.fixture
def blocks(repository, tmp_path, monkeypatch):
    """Return the blocks of code of the page, in a folder with the case that they name."""
    machine = scattered(bare_axis(), 4)
    friction = [Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.05})]
    waves = [("multisine", 1), ("moves", 0), ("multisine", 3), ("multisine", 9)]
    number = int(3.0 / machine.sample_time_s)
    logs = [
        log_of(machine, friction, reference(*wave, number, machine.sample_time_s), k, f"log{k}")
        for k, wave in enumerate(waves)
    ]
    bare_case(tmp_path / "case", logs)
    monkeypatch.chdir(tmp_path)
    return BLOCK.findall((repository / "docs" / "posterior.md").read_text("utf-8"))


def test_commands(blocks):
    shell, *_ = (code for kind, code in blocks if kind == "sh")
    for line in shell.strip().splitlines():
        done = CliRunner().invoke(app, line.split()[1:])
        assert done.exit_code == 0, done.output
    assert "EVENTS" in Path("randomization.py").read_text("utf-8")
    assert Path("corner.png").read_bytes().startswith(b"\x89PNG")


def test_python(blocks, capsys):
    names: dict[str, object] = {}
    for kind, code in blocks:
        if kind == "python":
            exec(compile(code, "page", "exec"), names)
    said = capsys.readouterr().out
    assert "coulomb_friction@1.coulomb_nm" in said and "frictionloss of axis1" in said
    assert all(Path(name).exists() for name in ("corner.png", "randomization.py", "verdict.nc"))
