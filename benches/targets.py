"""Whether causes are named from positions and targets alone.

    python benches/targets.py [SEED] [STEP_S] [RATE_HZ]

Machines simulated by MuJoCo, position actuators in a loop of its own: ten that differ from their MJCF in one
thing, five that do not. Each has three runs of 20 s, the last held out. ``STEP_S`` of MuJoCo, 0.5 ms by
default, a whole share of the sample time; ``RATE_HZ`` of the logs, 50 by default.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "python"))

from printed import COMPLETE, Counted

from servo_arm import MACHINES, NOMINAL, simulator


def main(seed: int, step_s: float, rate_hz: float) -> None:
    """Print a line for every machine, and the counts."""
    counted = Counted()
    with tempfile.TemporaryDirectory() as folder:
        robot = simulator(Path(folder), replace(NOMINAL, step_s=step_s, rate_hz=rate_hz))
        for number, lacks in enumerate([*MACHINES, *COMPLETE]):
            machine = replace(MACHINES.get(lacks, NOMINAL), step_s=step_s, rate_hz=rate_hz)
            logs = [machine.log(1000 * seed + 10 * number + k) for k in range(3)]
            counted.diagnose(robot, lacks, logs)
    counted.print_counts()


if __name__ == "__main__":
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else 0,
        float(sys.argv[2]) if len(sys.argv) > 2 else 5e-4,
        float(sys.argv[3]) if len(sys.argv) > 3 else 50.0,
    )
