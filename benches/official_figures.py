"""The EMPS benchmark by its official protocol: the position that named physics predict from the force alone.

Protocol (nonlinearbenchmark.org, package nonlinear_benchmarks): estimate on DATA_EMPS, simulate DATA_EMPS_PULSES from
its input alone, and leave the first 20 samples out of the error. The fit is 1 - rms error / standard deviation.

Run: python benches/official_figures.py FOLDER [--submission FILE.npz]. FOLDER holds emps/, with the files that
examples/emps/README.md names. The submission holds the simulated positions of the test run [m].
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import axisight
from axisight import Effect, Log, Robot
from axisight.effects import effect_info
from axisight.fitting import FitOptions, effect_parameter, fit, robot_parameter
from axisight.logs import differentiate

EMPS = Path(__file__).resolve().parents[1] / "examples" / "emps"
MASS = "carriage.mass"
INITIAL = 20
"""Samples at the start of a run that the protocol leaves out."""
STEADY_S = 0.3
"""Shortest stretch of constant speed whose mean force is printed."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Model:
    """A robot with effects that stand for what the machine has."""

    robot: Robot
    effects: Sequence[Effect]

    def position(self, log: Log) -> Array:
        """Return the position (n,) [m] that the force of a log gives, from rest at its first position."""
        mass, none = [robot_parameter(self.robot, MASS)], FitOptions(max_iterations=0)
        at = fit(self.robot, [log], mass, effects=self.effects, options=none)
        return log.position_rad[:, 0] + np.asarray(at.core.residual)

    def fitted(self, log: Log, family: str = "") -> Model:
        """Return the model with mass and amplitudes fitted to the positions of a log, driven by its force.

        ``family``: fit the effects of this family, and not the mass.
        """
        placed = self.robot.placed(self.effects)
        free = [
            effect_parameter(placed, i, p.name)
            for i, effect in enumerate(placed)
            for p in effect_info(effect.name).parameters
            if family in ("", effect_info(effect.name).family)
            and p.role == "amplitude"
            and (effect.parameters or {}).get(p.name)
        ]
        mass = [] if family else [robot_parameter(self.robot, MASS)]
        options = FitOptions(max_iterations=200)
        found = fit(self.robot, [log], [*free, *mass], effects=placed, options=options)
        if not found.status.endswith("converged"):
            raise SystemExit(f"{log.name}: {found.status}: {'; '.join(found.warnings)}")
        values = dict(zip(found.names, found.values.tolist(), strict=True))
        own = {MASS: values.pop(MASS)} if mass else {}
        named = [name.split(".", 1) for name in values]
        effects = [
            effect.with_values({n: values[f"{at}.{n}"] for at, n in named if at == effect.label})
            for effect in placed
        ]
        return Model(self.robot.with_parameters(own), effects)


def main() -> None:
    """Print the table of errors and the forces at constant speed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument(
        "--submission", type=Path, help="Write the simulated positions here (.npz)."
    )
    given = parser.parse_args()
    train, test = (
        from_rest(axisight.read_log(given.folder / "emps" / name, EMPS / "columns.toml"))
        for name in ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")
    )
    named = named_physics(axisight.load_robot(EMPS / "robot.toml"), train)
    ours = named.fitted(train)
    models = {
        "values of the diagnosis": named,
        "fitted to the training run": ours,
        "with the friction of the test run (not the protocol)": ours.fitted(test, "friction"),
        "fitted to the test run (not the protocol)": ours.fitted(test),
    }
    print("| named physics | training run (mm) | test run (mm) | fit on the test run |")
    print("|---|---|---|---|")
    for name, model in models.items():
        off = [rms_error(model, log) for log in (train, test)]
        share = 1 - off[1] / float(np.std(test.position_rad[INITIAL:]))
        print(f"| {name} | {1e3 * off[0]:.2f} | {1e3 * off[1]:.2f} | {share:.1%} |")
    if given.submission:
        np.savez(given.submission, position_m=ours.position(test))
    stretches = steady(train)
    for log in (train, test):
        print(f"\n{log.name}: least squares of the mean forces at constant speed\n")
        print("\n".join(least_squares_rows(log, stretches)))
    print(
        "\n| from (s) | speed (m/s) | force, training run (N) | test run (N) |\n|---|---|---|---|"
    )
    for start, stop, speed in stretches:
        forces = (float(log.torque_nm[start:stop].mean()) for log in (train, test))
        print(
            f"| {train.time_s[start]:.2f} | {speed:.4f} | "
            + " | ".join(f"{x:.2f}" for x in forces)
            + " |"
        )


def from_rest(log: Log) -> Log:
    """Return a log whose simulation starts at its first position."""
    return replace(log, start_rad=log.position_rad[0].copy())


def named_physics(robot: Robot, train: Log) -> Model:
    """Return the causes that the diagnosis of the training run names; the last third is held out."""
    cut = 2 / 3 * train.duration_s
    found = axisight.diagnose(
        robot=robot, estimation=[train.part(0.0, cut)], validation=[train.part(cut)]
    )
    effects = [
        Effect(c.effect, c.axis, {name: p.value for name, p in c.parameters.items()})
        for c in found.causes
    ]
    return Model(robot, effects)


def rms_error(model: Model, log: Log) -> float:
    """Return the rms error of position [m], without the first samples."""
    error = (model.position(log) - log.position_rad[:, 0])[INITIAL:]
    return float(np.sqrt(np.mean(error**2)))


def least_squares_rows(log: Log, stretches: Sequence[tuple[int, int, float]]) -> list[str]:
    """Return a table of F_v v + F_c sign(v) beside an offset, D |v|, or both, fitted to mean forces (± std)."""
    speed = np.array([v for *_, v in stretches])
    force = np.array([log.torque_nm[start:stop].mean() for start, stop, _ in stretches])
    common = {"F_v (N s/m)": speed, "F_c (N)": np.sign(speed)}
    even = {"D (N s/m)": np.abs(speed), "offset (N)": np.ones(len(speed))}
    names = [*common, *even]
    rows = [f"| {' | '.join(names)} | rms error (N) |", "|---" * (len(names) + 1) + "|"]
    for beside in (["offset (N)"], ["D (N s/m)"], list(even)):
        columns = {**common, **{name: even[name] for name in beside}}
        x = np.stack(list(columns.values()), axis=1)
        theta = np.linalg.lstsq(x, force, rcond=None)[0]
        error = force - x @ theta
        scatter = error @ error / (len(force) - x.shape[1])
        std = np.sqrt(scatter * np.diag(np.linalg.inv(x.T @ x)))
        told = {n: f"{v:.3g} ± {s:.2g}" for n, v, s in zip(columns, theta, std, strict=True)}
        cells = [told.get(name, "-") for name in names]
        rows.append(f"| {' | '.join(cells)} | {np.sqrt(np.mean(error**2)):.2f} |")
    return rows


def steady(log: Log) -> list[tuple[int, int, float]]:
    """Return stretches of constant speed: first sample, the one behind the last, speed [m/s]."""
    speed, acceleration = differentiate(log.position_rad, log.sample_time_s, 40.0)
    constant = (np.abs(acceleration[:, 0]) < 0.05) & (np.abs(speed[:, 0]) > 0.05)
    edges = np.flatnonzero(np.diff(constant.astype(int), prepend=0, append=0)).reshape(-1, 2)
    margin, least = round(0.08 / log.sample_time_s), round(STEADY_S / log.sample_time_s)
    return [
        (int(a) + margin, int(b) - margin, float(speed[a + margin : b - margin].mean()))
        for a, b in edges
        if b - a > least + 2 * margin
    ]


if __name__ == "__main__":
    main()
