"""Install one wheel or source distribution into an empty environment and run the command, timed.

Usage: python tests/wheel_smoke.py FILE_OR_FOLDER
Nothing but what the package itself asks for is installed.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import time
import venv
import zipfile
from pathlib import Path


def the_file(place: Path) -> Path:
    """The only distribution there."""
    if place.is_file():
        return place
    found = sorted([*place.glob("axisight-*.whl"), *place.glob("axisight-*.tar.gz")])
    if len(found) != 1:
        raise SystemExit(f"{place}: expected one distribution, got {len(found)}")
    return found[0]


def built_by(wheel: Path) -> tuple[str, str, int]:
    """What built a wheel, as it says itself: the builder, the revision of rustc, how many crates are listed."""
    with zipfile.ZipFile(wheel) as file:
        (about,) = (name for name in file.namelist() if name.endswith(".dist-info/WHEEL"))
        (core,) = (name for name in file.namelist() if re.search(r"/_core\.[^/]*(so|pyd)$", name))
        listed = [name for name in file.namelist() if name.endswith(".cyclonedx.json")]
        builder = re.search(r"^Generator: (.+?)\r?$", file.read(about).decode(), re.M)
        compiler = re.search(rb"/rustc/([0-9a-f]{40})[/\\]", file.read(core))
        crates = sum(len(json.loads(file.read(name)).get("components", ())) for name in listed)
    if builder is None or compiler is None or not crates:
        raise SystemExit(f"{wheel.name}: expected its builder, compiler and crates on record")
    return builder[1], compiler[1].decode(), crates


def timed(what: str, command: list[str], folder: Path) -> str:
    """Run a command outside of any source tree, say how long it took, and return what it says."""
    begun = time.monotonic()
    kept = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, encoding="utf-8", check=False,
        env=kept | {"PYTHONUTF8": "1"},
    )  # fmt: skip
    if done.returncode:
        raise SystemExit(f"{what}: status {done.returncode}\n{done.stdout}\n{done.stderr}")
    print(f"{what:24} {time.monotonic() - begun:6.1f} s", flush=True)
    return done.stdout


def main(place: Path) -> None:
    """Install and run."""
    distribution = the_file(place.resolve())
    print(f"{distribution.name}: {distribution.stat().st_size / 1e6:.1f} MB")
    if distribution.suffix == ".whl":
        print("built by {}, rustc {:.9}, {} crates listed".format(*built_by(distribution)))
    version = distribution.name.split("-")[1].removesuffix(".tar.gz")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        venv.create(folder / "env", with_pip=True)
        programs = folder / "env" / ("Scripts" if os.name == "nt" else "bin")
        axisight = str(programs / "axisight")
        pip = [str(programs / "python"), "-m", "pip", "--quiet", "--disable-pip-version-check"]
        timed("install", [*pip, "install", str(distribution)], folder)
        said = timed("axisight --version", [axisight, "--version"], folder).strip()
        if said != version:
            raise SystemExit(f"axisight --version: expected {version}, got {said}")
        if "diagnose" not in timed("axisight --help", [axisight, "--help"], folder):
            raise SystemExit("axisight --help: expected its commands")
        told = timed("axisight demo", [axisight, "demo"], folder)
        if "explained: The simulator lacks Coulomb friction on axis 2" not in told:
            raise SystemExit(f"axisight demo: expected friction on axis 2, got\n{told}")
        if not (folder / "demo" / "report.html").stat().st_size:
            raise SystemExit("axisight demo: expected a report")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
