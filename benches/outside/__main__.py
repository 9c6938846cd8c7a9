"""Make cases of machines that Drake, Exudyn, DART, Bullet and Jiminy simulate.

python -m outside make CASES --truth FOLDER [--seed N] [--count N] [--engines NAME ...]
python -m outside nominal FOLDER [--engines NAME ...]
python -m outside laws FOLDER [--engines NAME ...]

The folder that holds the package ``outside`` must be on the path of modules (PYTHONPATH=benches).
``make`` writes a draw. ``nominal`` writes one case for each arm with nothing withheld, no scatter and
no noise, for ``agree.py``. ``laws`` does so with each effect in turn, beside its truth. Without
``--engines`` the arms are those of Drake and Exudyn.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from .draw import SINGLE
from .make import changed, make, place, runs, write
from .models import ARMS, arms_of
from .motions import plan

ENGINES = ("drake", "exudyn", "dart", "bullet", "jiminy")


def nominal(folder: Path, engines: list[str]) -> None:
    """Write a case for each arm whose machine is its simulator."""
    for name in arms_of(engines):
        arm = replace(ARMS[name](), noise_std_rad=0.0)
        logs = plan(np.random.default_rng(1), arm)
        write(folder / name, arm, logs, runs(arm, [], [w_ref for _, _, w_ref in logs]))


def laws(folder: Path, engines: list[str]) -> None:
    """Write a case for each effect, of a machine that has it and is its simulator otherwise."""
    labels = {}
    arms = arms_of(engines)
    for number, (name, kind) in enumerate(SINGLE.items()):
        arm_name, axes = next((arm, axes) for arm, axes in kind.axes.items() if arm in arms)
        arm = replace(ARMS[arm_name](), noise_std_rad=0.0)
        rng = np.random.default_rng(number)
        logs = plan(rng, arm)[1:4]
        references = [w_ref for _, _, w_ref in logs]
        effect = kind.draw(place(arm, axes[-1], runs(arm, [], references), 1.0, rng))
        stated = effect.simulator(arm) if effect.simulator else arm
        write(folder / name, stated, logs, runs(*changed(arm, [effect]), references))
        labels[name] = {"effects": name, "truth": [effect.truth()]}
        (folder / "labels.json").write_text(json.dumps(labels, indent=1) + "\n")


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        prog="outside", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    draw = commands.add_parser("make")
    draw.add_argument("cases", type=Path)
    draw.add_argument("--truth", type=Path, required=True)
    draw.add_argument("--seed", type=int, default=1)
    draw.add_argument("--count", type=int, default=66)
    for name in ("nominal", "laws"):
        commands.add_parser(name).add_argument("folder", type=Path)
    for command in commands.choices.values():
        command.add_argument("--engines", nargs="+", choices=ENGINES, default=["drake", "exudyn"])
    given = parser.parse_args()
    if given.command == "make":
        make(given.cases, given.truth, given.seed, given.count, given.engines)
    else:
        {"nominal": nominal, "laws": laws}[given.command](given.folder, given.engines)


main()
