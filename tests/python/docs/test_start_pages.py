"""The pages that begin: commands and snippets run as they stand, in order, and say what is shown."""

from __future__ import annotations

import contextlib
import io
import json
import re
import shlex
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from axisight import Robot
from axisight.cli import app
from axisight.effects import title

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e-?\d+)?")
# Machines round differently: a quoted number may be off by this share, or by one in its last digit.
ROUNDING = 0.005
DEMO = "axisight demo"
# What the first pages run to install the package; `make demo` ends with the demo.
SAME = {"make demo": DEMO, "source .venv/bin/activate": ""}


def words(text: str) -> str:
    """A text without frames of tables and spacing."""
    text = re.sub(r"[│┃━─┏┓┗┛┡┩└┘┴┬╇┳┻╭╮╰╯]", " ", text)
    return " ".join(text.split())


def is_near(shown: str, told: str) -> bool:
    """Whether a number that a page shows is the one that was told; counts and axes are the same."""
    if "." not in shown and "e" not in shown:
        return shown == told
    mantissa, _, exponent = shown.partition("e")
    last_digit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    wanted, got = float(shown), float(told)
    return abs(wanted - got) <= max(1.001 * last_digit, ROUNDING * abs(got))


def is_said(line: str, told: str) -> bool:
    """Whether a line of a page was told: word for word, and number for number."""
    parts = NUMBER.split(words(line))
    pattern = f"({NUMBER.pattern})".join(re.escape(part) for part in parts)
    shown = NUMBER.findall(words(line))
    return any(
        all(map(is_near, shown, match.groups())) for match in re.finditer(pattern, words(told))
    )


class Reader:
    """Somebody who does what pages say, in one folder, and remembers what was told."""

    def __init__(self) -> None:
        self.names: dict[str, object] = {}
        self.told = ""
        self.heard: dict[str, str] = {}

    def command(self, line: str) -> None:
        line = shlex.join(shlex.split(line, comments=True))
        line = SAME.get(line, line)
        if line and line not in self.heard:
            program, *arguments = shlex.split(line)
            assert program == "axisight", line
            # As wide as the lines of the page.
            out = CliRunner(env={"COLUMNS": "400"}).invoke(app, arguments)
            assert out.exit_code == 0, f"{line}\n{out.output}"
            self.heard[line] = out.output
        self.told += self.heard.get(line, "")

    def follow(self, page: Path, section: str = "") -> None:
        """Do what a page says, or its section of this heading."""
        text = page.read_text(encoding="utf-8")
        if section:
            text = text.split(f"\n## {section}\n")[1].split("\n## ")[0]
        self.shown = 0
        for kind, block in BLOCK.findall(text):
            if kind == "text":
                for line in block.splitlines():
                    assert is_said(line, self.told), f"{page.name}: {line}\n{self.told}"
                    self.shown += 1
                continue
            self.told = ""
            if kind == "sh":
                for line in block.replace("\\\n", " ").splitlines():
                    self.command(line)
            elif kind == "python":
                heard = io.StringIO()
                with contextlib.redirect_stdout(heard):
                    exec(block, self.names)
                self.told = heard.getvalue()


@pytest.fixture
def reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Reader:
    monkeypatch.chdir(tmp_path)
    return Reader()


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder in which the demo was run, and what it told."""
    folder = tmp_path_factory.mktemp("demo")
    reader = Reader()
    with contextlib.chdir(folder):
        reader.command(DEMO)
    return folder, reader.told


@pytest.fixture
def reader_of_demo(demo: tuple[Path, str], monkeypatch: pytest.MonkeyPatch) -> Reader:
    folder, told = demo
    monkeypatch.chdir(folder)
    reader = Reader()
    reader.heard[DEMO] = told
    return reader


def test_what_counts_as_said() -> None:
    told = "found: 0.8604 of 12 │ 13.1 %\nfound: 7 of 12 13 %"
    for line in ("found: 0.860 of 12 13.1 %", "of 12", "found: 7 of 12 13 %", "0.86"):
        assert is_said(line, told), line
    for line in ("found: 0.873 of 12 13.1 %", "found: 0.860 of 13", "lost: 7", "13.3 %"):
        assert not is_said(line, told), line


def test_the_first_page_and_the_readme(reader_of_demo: Reader, repository: Path) -> None:
    makefile = (repository / "Makefile").read_text(encoding="utf-8")
    assert f"\n\t$(BIN)/{DEMO} --out demo\n" in makefile.split("\ndemo:")[1].split("\n\n")[0]
    reader_of_demo.follow(repository / "docs" / "index.md")
    assert reader_of_demo.shown == 1
    reader_of_demo.follow(repository / "README.md", "Try it")
    assert reader_of_demo.shown == 1


def test_diagnose(reader_of_demo: Reader, repository: Path) -> None:
    reader_of_demo.follow(repository / "docs" / "start_diagnose.md")
    assert reader_of_demo.shown == 4
    assert Path("demo/report.html").exists()


# What a unit of the page is in the unit of the verdict.
SCALES = {"Nm": 1.0, "ms": 1e-3, "%": 1e-2, "µrad": 1e-6}


def test_detection_limits(reader_of_demo: Reader, repository: Path) -> None:
    page = repository / "docs" / "detection_limits.md"
    reader_of_demo.follow(page)
    limits = {
        (title(one["effect"]).lower(), one["axis"]): one["value"]
        for one in json.loads(Path("again.json").read_text())["detection_limits"]
    }
    rows = re.findall(
        r"^\| ([\w ]+), axis (\d) \| ([^|]+) \|", page.read_text("utf-8"), re.MULTILINE
    )
    assert len(rows) == 5
    for effect, axis, shown in rows:
        found = limits[effect.lower(), int(axis)]
        if shown == "none":
            assert found is None, effect
        else:
            value, unit = shown.split()
            # The page has two digits.
            assert found == pytest.approx(float(value) * SCALES[unit], rel=0.06), effect


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
