"""Whether causes are named from positions and targets alone where the drive is a cascade.

    python benches/cascade_targets.py [pi | p | fed] [SEED]

The machines of `benches/targets.py` with motors instead of position actuators, in MuJoCo, under a position loop
around a speed loop of 500 Hz: with an integral, without one, or with rates of targets fed forward. Logs at 50 Hz,
three runs of 20 s with one held out.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "python"))

from printed import COMPLETE, Counted

from cascade_arm import PI, P, log_of, machine_of, simulator
from servo_arm import MACHINES, NOMINAL

LAWS = {"pi": PI, "p": P, "fed": replace(PI, fed=True)}


def main(law_name: str, seed: int) -> None:
    """Print a line for every machine, and the counts."""
    counted, law = Counted(), LAWS[law_name]
    with tempfile.TemporaryDirectory() as folder:
        robot = simulator(Path(folder), NOMINAL, law)
        for number, lacks in enumerate([*MACHINES, *COMPLETE]):
            arm, own = machine_of(lacks, law)
            logs = [log_of(arm, own, 1000 * seed + 10 * number + k) for k in range(3)]
            counted.diagnose(robot, lacks, logs)
    counted.print_counts()


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "pi", int(sys.argv[2]) if len(sys.argv) > 2 else 0)
