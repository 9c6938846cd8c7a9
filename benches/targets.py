"""Whether causes are named from positions and targets alone.

    python benches/targets.py [SEED] [STEP_S] [RATE_HZ]

Machines simulated by MuJoCo, position actuators in a loop of its own: ten that differ from their MJCF in one
thing, five that do not. Each has three runs of 20 s, the last held out. ``STEP_S`` of MuJoCo, 0.5 ms by
default, a whole share of the sample time; ``RATE_HZ`` of the logs, 50 by default.
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "python"))

from axisight import diagnose
from servo_arm import MACHINES, NOMINAL, ServoArm, simulator


def main(seed: int, step_s: float, rate_hz: float) -> None:
    """Print a line for every machine, and the counts."""
    first, invented = 0, 0
    with tempfile.TemporaryDirectory() as folder:
        robot = simulator(Path(folder), replace(NOMINAL, step_s=step_s, rate_hz=rate_hz))
        complete = {f"nothing, run {i + 1}": NOMINAL for i in range(5)}
        for number, (lacks, arm) in enumerate({**MACHINES, **complete}.items()):
            machine: ServoArm = replace(arm, step_s=step_s, rate_hz=rate_hz)
            logs = [machine.log(1000 * seed + 10 * number + k) for k in range(3)]
            start = time.perf_counter()
            found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
            names = [cause.label for cause in found.causes]
            right = bool(names) and names[0].startswith(lacks)
            first += right
            invented += lacks.startswith("nothing") and bool(names)
            print(
                f"{lacks:20s} {time.perf_counter() - start:5.1f} s  {found.verdict:11s} "
                f"{100 * found.gap.before:5.1f} -> {100 * found.gap.after:4.1f} % "
                f"(noise {100 * found.gap.floor:4.1f})  "
                + ", ".join(f"{c.label} {c.probability:.2f}" for c in found.causes),
                flush=True,
            )
    print(f"{first} of {len(MACHINES)} first, {invented} of {len(complete)} invented")


if __name__ == "__main__":
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else 0,
        float(sys.argv[2]) if len(sys.argv) > 2 else 5e-4,
        float(sys.argv[3]) if len(sys.argv) > 3 else 50.0,
    )
