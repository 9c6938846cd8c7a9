"""One elastic axis with effects that its simulator lacks, and evidence made by hand."""

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from axisight import Effect, Log, Robot, load_robot, simulate
from axisight.blind.case_files import CaseFolder
from axisight.gap.fit.fitted_model import FittedModel

PLAN = {"multisine": ("multisine", 1), "second": ("multisine", 2), "moves": ("moves", 0)}
HELD = {"fresh": ("multisine", 9), "other": ("moves", 3)}


def bare_axis() -> Robot:
    """Return the two-mass axis as a simulator without effects."""
    return load_robot("two_mass_axis").with_effects([])


def bare_case(folder: Path, logs: Sequence[Log]) -> Path:
    """Write a case of that axis with the last log for validation; return its folder."""
    case = CaseFolder(folder, "bare")
    for k, log in enumerate(logs):
        role = "validation" if k == len(logs) - 1 else "estimation"
        case.add(
            log.name, role, log.time_s, log.velocity_ref_rad_s, log.torque_nm, log.position_rad
        )
    case.finish("two_mass_axis")
    robot = folder / "robot.toml"
    text = robot.read_text("utf-8")
    first, rest = text.index("[[effect]]"), text.index("[controller]")
    robot.write_text(text[:first] + text[rest:], "utf-8")
    return folder


def reference(kind: str, seed: int, n: int, sample_time_s: float) -> np.ndarray:
    time = np.arange(n) * sample_time_s
    if kind == "moves":
        return (30.0 * np.sin(2 * np.pi * 0.35 * time) * np.minimum(time, 1.0))[:, None]
    rng = np.random.default_rng(seed)
    lines = np.arange(1.0, 40.0, 0.5)
    phases = rng.uniform(0, 2 * np.pi, len(lines))
    wave = np.cos(2 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
    square = np.tanh(20 * np.sin(2 * np.pi * time / 3.0))
    return (np.minimum(time / 0.1, 1.0) * 6.0 * (0.7 * wave / np.abs(wave).max() + square))[:, None]


def log_of(
    machine: Robot, effects: list[Effect], reference: np.ndarray, run: int, name: str = ""
) -> Log:
    """Return the log of a simulated run along a velocity reference (n, n_axes)."""
    data = simulate(machine, reference, effects=effects, noise_seed=5, run=run)
    assert data.attrs["status"] == "completed"
    name = name or f"run{run}"
    return Log(
        name=name,
        source=Path(f"{name}.parquet"),
        sample_time_s=machine.sample_time_s,
        time_s=data.time.values,
        velocity_ref_rad_s=reference,
        torque_nm=data.torque_cmd_nm.values,
        position_rad=data.position_rad.values,
    )


def logs_of(
    machine: Robot,
    effects: list[Effect],
    plan: dict[str, tuple[str, int]],
    seconds: float = 6.0,
) -> list[Log]:
    """Return logs by name; ``plan`` gives kind of reference and seed."""
    out = []
    n = int(seconds / machine.sample_time_s)
    for run, (name, (kind, seed)) in enumerate(plan.items()):
        ref = reference(kind, seed, n, machine.sample_time_s)
        out.append(log_of(machine, effects, ref, run, name))
    return out


def scattered(robot: Robot, seed: int) -> Robot:
    """Return a robot with about 1 % scatter in every parameter, like another machine of the type."""
    rng = np.random.default_rng(seed)
    spread = {"stiffness": 0.01, "damping": 0.05, "motor_inertia": 0.01, "viscous_friction": 0.02}
    values = {
        name: value * (1 + spread[q] * rng.uniform(-1, 1))
        for name, value in robot.parameters().items()
        if (q := name.rsplit(".", 1)[1]) in spread
    }
    return robot.with_parameters(values)


def linear_evidence(x: np.ndarray, y: np.ndarray, log: np.ndarray, block: int = 20) -> FittedModel:
    """Return the evidence of an ordinary least-squares fit of y on x, cut into blocks."""
    theta = np.linalg.lstsq(x, y, rcond=None)[0]
    residual = x @ theta - y
    starts = np.arange(0, len(y), block)
    matrix = np.array([x[s : s + block].T @ x[s : s + block] for s in starts])
    gradient = np.array([x[s : s + block].T @ residual[s : s + block] for s in starts])
    loss = np.array([(residual[s : s + block] ** 2).sum() for s in starts])
    p = x.shape[1]
    names = tuple((None, f"p{i}") for i in range(p))
    return FittedModel(
        effects=(),
        free=(),
        robot_values={},
        std={},
        parameters=names,
        status="loss_converged",
        renewed=True,
        condition=1.0,
        at_bound=(),
        matrix=matrix,
        gradient=gradient,
        loss=loss,
        log=log[starts],
        axis=np.zeros(len(starts), dtype=np.int64),
        start=starts,
        size=np.full(len(starts), block),
        samples=np.full(len(starts), float(block)),
        prior_matrix=np.zeros((p, p)),
        prior_gradient=np.zeros(p),
        residual=residual,
        columns={},
    )


class StateStub(SimpleNamespace):
    """A search state that accepts whatever model a move makes."""

    def moved(self, _move: str, model: object) -> None:
        self.model = model
