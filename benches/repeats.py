"""How often `axisight repeat` finds a change of viscous friction between two days, and how often it invents one.

Run: python benches/repeats.py [--machines 60] [--preset irb6600_like] [--first 1000] [--alone]

Every machine is simulated in closed loop with sensor noise, friction of its own, and friction that scatters
from run to run. Prints a table in Markdown: scatter, runs a day, change, how often it was found (viscous
friction of the right axis), how often anything else was. --alone compares each axis without the robot.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import axisight
from axisight.repeats import compare_days

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python"))
from repeat_data import simulated_days

# Scatter of friction from run to run, runs a day, change between the days.
DESIGNS = (
    (0.01, 5, 0.0),
    (0.01, 5, 0.05),
    (0.01, 5, 0.02),
    (0.01, 15, 0.02),
    (0.002, 5, 0.02),
)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=60)
    parser.add_argument("--first", type=int, default=1000)
    parser.add_argument("--preset", default="irb6600_like")
    parser.add_argument("--alone", action="store_true")
    given = parser.parse_args()
    robot = None if given.alone else axisight.load_robot(given.preset)
    print("| scatter from run to run | runs a day | change | found | something else found |")
    print("|---|---|---|---|---|")
    for scatter, per_day, change in DESIGNS:
        found = other = 0
        for seed in range(given.first, given.first + given.machines):
            logs, days, axis = simulated_days(
                seed, change=change, preset=given.preset, per_day=per_day, scatter=scatter
            )
            moved = set(compare_days(logs, days, robot=robot).moved)
            name = f"axis{axis}.viscous_friction"
            found += name in moved
            other += bool(moved - ({name, f"torque of axis {axis}"} if change else set()))
        cells = (f"{100 * scatter:g} %", per_day, f"{100 * change:g} %")
        counts = (f"{x} of {given.machines}" for x in (found, other))
        print("|", " | ".join(map(str, (*cells, *counts))), "|", flush=True)


if __name__ == "__main__":
    main()
