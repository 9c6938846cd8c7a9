"""Rust dependencies against `deny.toml`, also where `cargo deny` is not installed: licences, doubles, sources.

And what built a wheel: named in the recipe of a release, and on record in the wheel."""

import re
import shutil
import subprocess
import tomllib
import zipfile
from collections import Counter
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DENY = tomllib.loads((ROOT / "deny.toml").read_text("utf-8"))
LOCKED = tomllib.loads((ROOT / "Cargo.lock").read_text("utf-8"))["package"]


def allowed(expression: str, known: set[str]) -> bool:
    """Whether a licence expression can be met; one that is no product of sums may be refused wrongly."""
    needed = re.split(r"\s+AND\s+", expression.replace("(", " ").replace(")", " "))
    return all(known & {one.strip() for one in re.split(r"\s+OR\s+|/", part)} for part in needed)


@pytest.mark.parametrize(
    ("expression", "met"),
    [
        ("MIT", True),
        ("GPL-3.0", False),
        ("GPL-3.0 OR MIT", True),
        ("Unlicense/MIT", True),
        ("(MIT OR GPL-3.0) AND X", False),
        ("(MIT OR X) AND Apache-2.0", True),
        ("Apache-2.0 WITH LLVM-exception", False),
        ("X OR (MIT AND Y)", False),
        ("", False),
    ],
)
def test_expressions(expression, met):
    assert allowed(expression, {"MIT", "Apache-2.0"}) is met


@pytest.fixture(scope="module")
def built():
    """Licences by name and version of the packages of others that are built on this platform."""
    if shutil.which("cargo") is None:
        pytest.skip("no cargo here")
    told = subprocess.run(
        ["cargo", "tree", "--workspace", "--locked", "--offline", "--prefix=none", "--format={p}|{l}"],
        cwd=ROOT, check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    lines = [
        re.match(r"(\S+) v(\S+)([^|]*)\|(.*?)(?: \(\*\))?$", x) for x in told.splitlines() if x
    ]
    found = {(x[1], x[2]): x[4] for x in lines if str(ROOT) not in x[3]}
    assert len(found) > 50
    return found


def test_licences(built):
    known = set(DENY["licenses"]["allow"])
    assert [name for (name, _), text in built.items() if not allowed(text, known)] == []


def test_doubles(built):
    skipped = [entry["crate"].split("@") for entry in DENY["bans"]["skip"]]
    left = Counter(
        name
        for name, version in built
        if not any(name == n and f"{version}.".startswith(f"{v}.") for n, v in skipped)
    )
    assert [name for name, times in left.items() if times > 1] == []
    # Whatever no longer stands twice is no longer excused.
    locked = Counter(p["name"] for p in LOCKED)
    assert [name for name, _ in skipped if locked[name] < 2] == []


def test_sources():
    """All of crates.io, with the checksum of what was fetched."""
    fetched = [p for p in LOCKED if "source" in p]
    assert {p["source"] for p in fetched} == {
        "registry+https://github.com/rust-lang/crates.io-index"
    }
    assert all(re.fullmatch("[0-9a-f]{64}", p["checksum"]) for p in fetched)


def test_a_release_names_its_compiler():
    recipe = (ROOT / ".github" / "workflows" / "release.yml").read_text("utf-8")
    (named,) = re.findall(r'^ +rust-toolchain: "(\d+)\.(\d+)\.\d+"$', recipe, re.M)
    lowest = tomllib.loads((ROOT / "Cargo.toml").read_text("utf-8"))["workspace"]["package"]
    assert [int(n) for n in named] >= [int(n) for n in lowest["rust-version"].split(".")]


RECORD = {
    "axisight-0.1.0.dist-info/WHEEL": b"Wheel-Version: 1.0\nGenerator: maturin (1.2.3)\n",
    "axisight-0.1.0.dist-info/sboms/a.cyclonedx.json": b'{"components": [{}, {}]}',
    "axisight/_core.pyd": b"\0/rustc/" + b"0a" * 20 + b"\\library\0",
}


@pytest.mark.parametrize("lacks", [None, *RECORD])
def test_wheels_say_what_built_them(tmp_path, monkeypatch, lacks):
    monkeypatch.syspath_prepend(ROOT / "tests")
    built_by = import_module("wheel_smoke").built_by
    wheel = tmp_path / "axisight.whl"
    with zipfile.ZipFile(wheel, "w") as file:
        for name, data in RECORD.items():
            file.writestr(name, b"{}" if name == lacks else data)
    if lacks is None:
        assert built_by(wheel) == ("maturin (1.2.3)", "0a" * 20, 2)
    else:
        with pytest.raises(SystemExit, match="on record"):
            built_by(wheel)
