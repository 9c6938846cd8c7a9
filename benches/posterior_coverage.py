"""How often the posterior of a diagnosis holds what it says, on simulated machines with short logs.

    python benches/posterior_coverage.py [MACHINES] [SECONDS] [--parameters]

``--parameters``: only the band of held-out torque, and the true parameters inside their intervals.

One elastic axis. Machines differ by about 1 % in every parameter, and have dry friction (every third one also a ripple)
that the simulator lacks. Four estimation logs and two validation logs each. Printed:

- share of held-out torque inside the 95 % band, by machine, and of its means over blocks of 0.25 s;
- share of true parameters inside their 95 % intervals, with and without the error of formulas;
- ratio of standard deviations by block bootstrap to those of the Gaussian;
- parameters that are said to vary between runs: none does here, then friction does, by 10 %.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from axisight import Diagnosis, Effect, Log, Robot, Settings, diagnose, load_robot, simulate
from axisight.posterior import Posterior, sampled_robot

Array = NDArray[np.float64]

BLOCK_S = 0.25
DRAWS = 40
SPREAD = {"stiffness": 0.01, "damping": 0.05, "motor_inertia": 0.01, "viscous_friction": 0.02}
COULOMB = "coulomb_friction@1.coulomb_nm"


def machine_of(robot: Robot, rng: np.random.Generator) -> Robot:
    """Return another machine of the type."""
    values = {
        name: value * (1 + SPREAD[quantity] * rng.uniform(-1, 1))
        for name, value in robot.parameters().items()
        if (quantity := name.rsplit(".", 1)[1]) in SPREAD
    }
    return robot.with_parameters(values)


def reference(kind: str, seed: int, n: int, step_s: float) -> Array:
    """Return a velocity reference (n, 1) [rad/s]: slow moves to and fro, or a multisine on a square wave."""
    time = np.arange(n) * step_s
    rng = np.random.default_rng(seed)
    if kind == "moves":
        shift = rng.uniform(0.3, 0.4)
        return (30.0 * np.sin(2 * np.pi * shift * time) * np.minimum(time, 1.0))[:, None]
    lines = np.arange(1.0, 40.0, 0.5)
    phases = rng.uniform(0, 2 * np.pi, len(lines))
    wave = np.cos(2 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
    square = np.tanh(20 * np.sin(2 * np.pi * time / 3.0))
    return (np.minimum(time / 0.1, 1.0) * 6.0 * (0.7 * wave / np.abs(wave).max() + square))[:, None]


def log_of(machine: Robot, effects: list[Effect], wave: Array, run: int) -> Log:
    """Return the log of a run."""
    out = simulate(machine, wave, effects=effects, noise_seed=11, run=run)
    name = f"run{run}"
    return Log(
        name=name, source=Path(name), sample_time_s=machine.sample_time_s, time_s=out.time.values,
        velocity_ref_rad_s=wave, torque_nm=out.torque_cmd_nm.values,
        position_rad=out.position_rad.values,
    )  # fmt: skip


def causes_of(number: int, rng: np.random.Generator) -> list[Effect]:
    """Return what the simulator of a machine lacks."""
    friction = {"coulomb_nm": rng.uniform(0.2, 0.8), "smoothing_rad_s": 0.05}
    ripple = {"order_1": 6.0, "cosine_1_nm": rng.uniform(0.1, 0.3), "sine_1_nm": 0.1}
    out = [Effect("coulomb_friction", 1, friction)]
    return [*out, Effect("torque_ripple", 1, ripple)] if number % 3 == 2 else out


def diagnosed(
    number: int, seconds: float, spread: float
) -> tuple[Diagnosis, dict[str, float], list[Log]]:
    """Return the diagnosis of a machine, its true parameters, and its validation logs."""
    robot = load_robot("two_mass_axis").with_effects([])
    rng = np.random.default_rng([number, 17])
    machine, effects = machine_of(robot, rng), causes_of(number, rng)
    n, step = round(seconds / robot.sample_time_s), robot.sample_time_s
    logs = []
    for k, kind in enumerate(("multisine", "moves", "multisine", "moves", "multisine", "moves")):
        size = effects[0].values()[0] * (1 + (spread * rng.standard_normal() if k < 4 else 0.0))
        own = [effects[0].with_values({"coulomb_nm": size}), *effects[1:]]
        logs.append(
            log_of(machine, own, reference(kind, 100 * number + k, n, step), 10 * number + k)
        )
    found = diagnose(
        robot=robot, estimation=logs[:4], validation=logs[4:], posterior=True,
        settings=Settings(bootstrap=100),
    )  # fmt: skip
    truth = dict(machine.parameters())
    for effect in effects:
        truth |= {f"{effect.label}.{name}": x for name, x in (effect.parameters or {}).items()}
    return found, truth, logs[4:]


def block_means(x: Array, step_s: float) -> Array:
    """Return means over blocks, (n_blocks, n_axes)."""
    length = round(BLOCK_S / step_s)
    count = len(x) // length
    return x[: count * length].reshape(count, length, -1).mean(axis=1)


def blocks_inside(posterior: Posterior, logs: list[Log], *, formula_error: bool) -> list[float]:
    """Return the share of block means of held-out torque inside their 95 % band, by log.

    The scatter of block means by noise comes from runs of the leading simulator with noise.
    """
    robot = load_robot("two_mass_axis").with_effects([])
    drawn = posterior.samples(DRAWS, formula_error=formula_error)
    out = []
    for log in logs:
        step = log.sample_time_s
        means = []
        for k in range(DRAWS):
            made = sampled_robot(posterior, robot, drawn.isel(draw=k))
            # Each with the noise of another run: parameters and noise together.
            run = simulate(made, log.velocity_ref_rad_s, noise_seed=99, run=k)
            means.append(block_means(run.torque_cmd_nm.values, step))
        middle, spread = np.mean(means, axis=0), np.std(means, axis=0, ddof=1)
        # A prediction from so many draws.
        reach = 1.96 * spread * (1 + 1 / DRAWS) ** 0.5
        out.append(float(np.mean(np.abs(block_means(log.torque_nm, step) - middle) <= reach)))
    return out


def share(values: list[bool] | list[float]) -> str:
    return f"{100 * float(np.mean(values)):.1f} %"


def main() -> None:
    """Print the table of machines, then the sums."""
    given = [x for x in sys.argv[1:] if x != "--parameters"]
    brief = len(given) < len(sys.argv) - 1
    machines = int(given[0]) if given else 32
    seconds = float(given[1]) if len(given) > 1 else 4.0
    inside: list[float] = []
    blocks: dict[bool, list[float]] = {True: [], False: []}
    held: dict[bool, dict[str, list[bool]]] = {True: {}, False: {}}
    ratios, alarms, power = [], [], []
    print("| machine | verdict | causes | held-out torque inside | varies |\n|---|---|---|---|---|")
    for number in range(machines):
        found, truth, logs = diagnosed(number, seconds, 0.0)
        posterior = found.posterior
        assert posterior is not None
        mine = [log.attrs["inside"] for log in posterior.held_out]
        inside += mine
        for formula in (True, False):
            if not brief:
                blocks[formula] += blocks_inside(posterior, logs, formula_error=formula)
            known = posterior.gaussian(formula_error=formula)
            for k, name in enumerate(posterior.best.names):
                if name in truth:
                    ok = float(known.low[k]) <= truth[name] <= float(known.high[k])
                    held[formula].setdefault(name, []).append(ok)
        fit = posterior.gaussian(formula_error=False)
        ratios += [
            posterior.bootstrap_std[n] / float(fit.deviation.sel(parameter=n))
            for n in posterior.best.names
        ]
        varies = [x.parameter for x in posterior.between_runs if x.varies]
        alarms.append(bool(varies))
        print(
            f"| {number} | {found.verdict} | {', '.join(posterior.best.causes)} | {share(mine)} | "
            f"{', '.join(varies) or 'nothing'} |",
            flush=True,
        )
        if number < machines // 2 and not brief:
            other = diagnosed(number, seconds, 0.1)[0].posterior
            assert other is not None
            known_run = other.variation(COULOMB)
            power.append(known_run is not None and known_run.varies)
    print(
        f"\nheld-out torque inside its 95 % band: {share(inside)} of samples, {len(inside)} logs; ",
        end="",
    )
    print(f"least {share([min(inside)])}, most {share([max(inside)])}")
    for formula in (True, False):
        with_or = "with" if formula else "without"
        if blocks[formula]:
            print(
                f"means over {BLOCK_S} s inside, {with_or} the error of formulas: {share(blocks[formula])}"
            )
        every = [ok for one in held[formula].values() for ok in one]
        print(
            f"true parameters inside, {with_or} the error of formulas: {share(every)} of {len(every)}"
        )
        for name, one in held[formula].items():
            print(f"    {name}: {share(one)} of {len(one)}")
    quantiles = ", ".join(f"{x:.2f}" for x in np.quantile(ratios, [0.05, 0.5, 0.95]))
    print(f"bootstrap over Gaussian, 5 %, 50 % and 95 % quantile: {quantiles}")
    print(f"machines with a false alarm of variation between runs: {share(alarms)}")
    if power:
        print(
            f"friction that differs by 10 % from run to run is found: {share(power)} of {len(power)}"
        )


if __name__ == "__main__":
    main()
