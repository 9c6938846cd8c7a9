"""The pages that begin: commands and snippets run as they stand, in order, and say what is shown."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from axisight import Robot
from axisight.cli import app

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def words(text: str) -> str:
    """A text without frames of tables, spacing and the digits of figures, which machines round."""
    text = re.sub(r"[│┃━─┏┓┗┛┡┩└┘┴┬╇┳┻╭╮╰╯]", " ", text)
    text = re.sub(r"\d+(\.\d+)?(e-?\d+)?", "#", text)
    return " ".join(text.split())


class Reader:
    """Somebody who does what pages say, in one folder."""

    def __init__(self) -> None:
        self.names: dict[str, object] = {}
        self.told = ""

    def command(self, line: str) -> None:
        program, *arguments = shlex.split(line)
        assert program in ("axisight", "pip")
        if program == "axisight":
            # As wide as the lines of the page.
            out = CliRunner(env={"COLUMNS": "400"}).invoke(app, arguments)
            assert out.exit_code == 0, f"{line}\n{out.output}"
            self.told += out.output

    def follow(self, page: Path) -> None:
        shown = 0
        for kind, text in BLOCK.findall(page.read_text(encoding="utf-8")):
            if kind == "text":
                for line in text.splitlines():
                    assert words(line) in words(self.told), f"{page.name}: {line}\n{self.told}"
                    shown += 1
                continue
            self.told = ""
            if kind == "sh":
                for line in text.replace("\\\n", " ").splitlines():
                    self.command(line)
            elif kind == "python":
                heard = io.StringIO()
                with contextlib.redirect_stdout(heard):
                    exec(text, self.names)
                self.told = heard.getvalue()
        self.shown = shown


@pytest.fixture
def reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Reader:
    monkeypatch.chdir(tmp_path)
    return Reader()


def test_diagnose(reader: Reader, repository: Path) -> None:
    reader.follow(repository / "docs" / "start_diagnose.md")
    assert reader.shown == 4
    assert Path("demo/report.html").exists()


def test_simulate(reader: Reader, repository: Path) -> None:
    reader.follow(repository / "docs" / "start_simulate.md")
    assert reader.shown == 2
    more = reader.names["more"].values  # type: ignore[attr-defined]
    assert more[0] > more[1] > more[2] > 0.1
    assert Path("worn.png").exists()
    assert Path("again.parquet").exists()


def test_identify_and_what_stays_open(reader: Reader, repository: Path) -> None:
    reader.follow(repository / "docs" / "start_identify.md")
    assert reader.shown == 8
    found = Robot.from_toml(Path("lever.toml").read_text(encoding="utf-8"))
    stated = {effect.name: effect.parameters for effect in found.effects}
    assert stated["coulomb_friction"]["coulomb_nm"] == pytest.approx(0.4, rel=0.01)
    (joint,) = tomllib.loads(found.toml)["joint"]
    assert joint["link"]["mass"] * joint["link"]["com"][0] == pytest.approx(31, rel=0.01)
    reader.follow(repository / "docs" / "undecidable.md")
    assert reader.shown == 1
    verdict = reader.names["verdict"]
    assert verdict["verdict"] == "undecidable"  # type: ignore[index]
    assert ["link_com@1", "payload"] in verdict["equivalent"]  # type: ignore[index]


def test_the_floor(reader: Reader, repository: Path) -> None:
    reader.follow(repository / "docs" / "floor.md")
    assert re.fullmatch(r"\[(0\.\d+ ?)+\]\n", reader.told)


def test_closed_loop_bias(reader: Reader, repository: Path) -> None:
    reader.follow(repository / "docs" / "closed_loop_bias.md")
    assert reader.shown == 2
    h1, mfrf = (int(p) for p in re.findall(r"(\d+)% off", reader.told))
    assert h1 > 60
    assert mfrf < 15


def test_every_key_of_a_robot_file_is_told(repository: Path) -> None:
    page = (repository / "docs" / "robot_files.md").read_text(encoding="utf-8")
    section = page.split("\n## Keys\n")[1].split("\n## ")[0]
    (example,) = (text for kind, text in BLOCK.findall(section) if kind == "toml")
    assert Robot.from_toml(example).n_joints == 2
    names = re.findall(r"`\[*([a-z_.]+)\]*`", section)
    told = {part for name in names for part in name.split(".")}
    source = repository / "crates" / "axisight-core" / "src" / "robot_file" / "reader.rs"
    text = source.read_text(encoding="utf-8")
    lists = re.findall(r"const \w*KEYS: &\[&str\] = &\[(.*?)\];", text, flags=re.DOTALL)
    lists += re.findall(r"let keys = \[(\"kind\".*?)\];", text)
    lists += re.findall(r"section\.only\(&\[(\"kind\".*?|\"position_noise_std\")\]\)", text)
    known = {key for keys in lists for key in re.findall(r'"(\w+)"', keys)}
    assert {"mass", "gear_ratio", "kv", "position_noise_std"} <= known
    assert known - told == set()
