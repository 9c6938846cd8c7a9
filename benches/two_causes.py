"""How long the diagnosis of two causes takes, and what it says, on the motions of a case.

    python benches/two_causes.py CASE [SEED]

The machine is the case's simulator with production scatter and two effects, simulated along the case's
own references with the noise it states. Nothing else should run on the computer.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import dask.array  # noqa: F401
import numpy as np
from limits import log_of

from axisight import Effect, diagnose, load_robot
from axisight.blind.drawing import scattered
from axisight.logs import read_case

# Of the sizes that the benchmark draws.
PAIRS = (
    (
        Effect("backlash", 1, {"half_width_rad": 2e-4}),
        Effect("nonlinear_stiffness", 3, {"cubic_nm_rad3": 3e12}),
    ),
    (
        Effect("torque_saturation", 2, {"limit_nm": 45.0}),
        Effect("torque_ripple", 1, {"order_1": 6.0, "cosine_1_nm": 0.05}),
    ),
    (
        Effect("coulomb_friction", 2, {"coulomb_nm": 0.3, "smoothing_rad_s": 0.1}),
        Effect("input_delay", 3, {"delay_s": 1.2e-3}),
    ),
    (
        Effect("resolver_ripple", 1, {"order_1": 2.0, "cosine_1_rad": 2e-3}),
        Effect("stribeck_friction", 3, {"coulomb_nm": 0.2, "excess_nm": 0.2}),
    ),
    (
        Effect("gravity_compensation", 2, {"sine_nm": 300.0}),
        Effect("actuator_bandwidth", 1, {"time_constant_s": 1.5e-3}),
    ),
    (
        Effect("backlash", 1, {"half_width_rad": 2e-4}),
        Effect("viscous_friction", 2, {"viscous_nm_s_rad": 0.02}),
    ),
)


def main(folder: Path, seed: int) -> None:
    """Print a line for every pair."""
    case = read_case(folder)
    robot = load_robot(case.robot_path)
    machine = scattered(np.random.default_rng(seed), robot)
    for number, pair in enumerate(PAIRS):
        logs = {
            role: [
                log_of(machine, list(pair), log.velocity_ref_rad_s, log.name, 100 * number + k)
                for k, log in enumerate(given)
            ]
            for role, given in (("estimation", case.estimation), ("validation", case.validation))
        }
        start, busy = time.perf_counter(), time.process_time()
        found = diagnose(robot=robot, **logs)
        took, spent = time.perf_counter() - start, time.process_time() - busy
        print(
            f"{' and '.join(e.label for e in pair):48s} {took:5.1f} s, CPU {spent:5.1f} s   {found.verdict}: "
            + ", ".join(f"{c.label} {c.probability:.2f}" for c in found.causes),
            flush=True,
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1)
