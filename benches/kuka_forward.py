"""The KUKA KR300 benchmark, forward: six positions from six motor torques alone, over 363 s.

Protocol (nonlinearbenchmark.org, industrial robot, forward identification): torques of six axes every 0.1 s are
the input, joint angles the output. The test recording is predicted from its torques and its initial state. NRMSE is
the rms error over the standard deviation of the measured angle, of each axis, and the mean over the six axes.

Run: python benches/kuka_forward.py FILE.mat [--open-test] [--submission FILE.npz]. FILE is the official
forward_identification_without_raw_data.mat or the cropped copy of it whose recordings have 3,630 samples.
Without --open-test nothing of the test recording is read. The submission holds the predicted angles [rad].
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from kuka_forward_motion import INFLATION, SOFT_RAD_S, MotionEstimator, MotionPrior
from kuka_forward_physics import Physics, identify, measured, motion, simulated
from kuka_forward_search import FROM_NEAR, refined, searched
from kuka_forward_start import Recognition
from numpy.typing import NDArray
from scipy.io import loadmat

import axisight
from axisight import Robot
from axisight.rigid_body import DriveTerms, TorqueModel

ROBOT = Path(__file__).resolve().parents[1] / "examples" / "rigid_body" / "kuka_kr300.toml"
CROPPED = 3630
"""Samples of a recording of the cropped file."""
STILL_RAD_S = 0.001
"""A sample at which no training recording is faster belongs to a rest."""
MARGIN = (20, 8)
"""Samples after and before a rest whose torque is not used: static friction still holds."""

DIVERGED = 100.0
"""An NRMSE above this says nothing but that a simulation diverged."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Recording:
    """Motor torques (n, 6) [Nm] and joint angles (n, 6) [rad] from the pose at the start."""

    torque_nm: Array
    position_rad: Array

    def part(self, at: slice) -> Recording:
        """Return a part of the recording."""
        return Recording(self.torque_nm[at], self.position_rad[at])


@dataclass(frozen=True)
class Benchmark:
    """Recordings for training, one for choices, and the one that is predicted at the end."""

    kind: str
    sample_time_s: float
    train: list[Recording]
    validation: Recording
    test: Recording | None


def read(path: Path, *, with_test: bool) -> Benchmark:
    """Return the recordings of the official file or of its cropped copy."""
    data = loadmat(path)
    names = ["train", "val"] if "u_val" in data else ["train"]
    parts: dict[str, list[Recording]] = {}
    for name in [*names, *(["test"] if with_test else [])]:
        u, y = data[f"u_{name}"].T, np.deg2rad(data[f"y_{name}"].T)
        if "time_train" in data:
            time = data[f"time_{name}"].ravel()
            cuts = [0, *(np.flatnonzero(np.diff(time) < 0) + 1), len(u)]
        else:
            cuts = list(range(0, len(u) + 1, CROPPED))
        parts[name] = [Recording(u[a:b], y[a:b] - y[a]) for a, b in pairwise(cuts)]
    official = "time_train" in data
    step = float(np.median(np.diff(data["time_train"].ravel()))) if official else 0.1000025
    train = parts["train"]
    validation = parts["val"][0] if "val" in parts else train[-1]
    return Benchmark(
        "official file" if official else "cropped copy of the official file",
        step,
        train if "val" in parts else train[:-1],
        validation,
        parts["test"][0] if with_test else None,
    )


@dataclass(frozen=True)
class Schedule:
    """Rests that all training recordings share: samples at rest, of usable torque, and stretches between rests.

    All stretches are as long as the shortest.
    """

    rest: NDArray[np.bool_]
    used: NDArray[np.bool_]
    stretches: list[slice]


def schedule(train: list[Recording], step_s: float) -> Schedule:
    """Return the rests common to all training recordings; every stretch begins and ends in one."""
    n = min(len(r.position_rad) for r in train)
    speed = np.max(
        [np.abs(motion(r.position_rad[:n], step_s)[1]).max(axis=1) for r in train], axis=0
    )
    rest = speed < STILL_RAD_S
    edges = np.flatnonzero(np.diff(rest.astype(int), prepend=0, append=0)).reshape(-1, 2)
    edges = edges[np.diff(edges, axis=1)[:, 0] > 10]
    rest = np.zeros(n, dtype=bool)
    used = np.ones(n, dtype=bool)
    for a, b in edges:
        rest[a:b] = True
        used[max(a - MARGIN[1], 0) : b + MARGIN[0]] = False
    starts = [0, *((a + b) // 2 for a, b in edges[1:-1]), n]
    length = int(np.diff(starts).min())
    return Schedule(rest, used, [slice(int(a), int(a) + length) for a in starts[:-1]])


NETWORKS, TRAINING_MOTIONS = 2, 6000
SHARES = (0.5, 0.2)
"""Errors of a rough motion, as shares of the size of training motions; each gives a start of the search."""
ROUNDS = 60
REPEATED = 3
"""Motions 4 to 6 repeat motions 1 to 3, in all training recordings."""


@dataclass(frozen=True)
class Model:
    """What the training recordings give: physics, torque errors, prior of the motion, rests, rough starts."""

    physics: Physics
    error_nm: Array
    prior: MotionPrior
    plan: Schedule
    starts: list[Recognition]
    step_s: float

    def estimator(self, at: slice) -> MotionEstimator:
        """Return the estimator of a stretch."""
        return MotionEstimator(self.physics, self.error_nm, self.prior, self.plan.used[at])


def trained(train: list[Recording], step_s: float) -> Model:
    """Return the model of training recordings."""
    robot: Robot = axisight.load_robot(ROBOT).with_sample_time(step_s)
    torque_model = TorqueModel(
        robot, terms=DriveTerms(inertia="motor", offset="motor"), side="motor"
    )
    plan = schedule(train, step_s)
    physics, _ = identify(
        torque_model, [(r.torque_nm, r.position_rad) for r in train], plan.used, step_s
    )
    errors = torque_errors(physics, train, plan.used, step_s)
    stretches = [(r.torque_nm[at], r.position_rad[at]) for r in train for at in plan.stretches]
    prior = MotionPrior.of(np.stack([q for _, q in stretches]), step_s)
    usable = plan.used[plan.stretches[0]]
    starts = [
        Recognition(
            stretches, physics, prior, errors, usable, step_s, count=TRAINING_MOTIONS, seed=seed
        )
        for seed in range(NETWORKS)
    ]
    return Model(physics, errors, prior, plan, starts, step_s)


def torque_errors(
    physics: Physics, records: list[Recording], used: NDArray[np.bool_], step_s: float
) -> Array:
    """Return rms torque errors (2, 6) [Nm] of fast axes (above 0.03 rad/s) and slow axes (below 0.004 rad/s)."""
    errors, speeds = [], []
    for r in records:
        q, v, a = motion(r.position_rad[: len(used)], step_s)
        left = r.torque_nm[: len(used)] - measured(physics.torque(q, v, a))
        errors.append(left[used])
        speeds.append(np.abs(v[used]))
    e, s = np.concatenate(errors), np.concatenate(speeds)
    return np.array(
        [[np.sqrt(np.mean(e[m[:, i], i] ** 2)) for i in range(6)] for m in (s > 0.03, s < 0.004)]
    )


def joined(plan: Schedule, parts: list[Array]) -> Array:
    """Return positions (n, 6) of the whole recording; at the rests between the stretches they are zero."""
    out = np.zeros((len(plan.rest), 6))
    for at, part in zip(plan.stretches, parts, strict=True):
        out[at] = part
    return out


def estimated(model: Model, u: Array) -> tuple[Array, list[float]]:
    """Return the most probable positions (n, 6) given all torques, not causal, and the cost of each motion."""
    positions, costs = [], []
    pools: list[list[Array]] = []
    for k, at in enumerate(model.plan.stretches):
        estimator = model.estimator(at)
        if k < REPEATED:
            rough = [recognize(u[at]) for recognize in model.starts]
            starts = [estimator.started(q, v, share) for q, v in rough for share in SHARES]
            found = searched(estimator, u[at], starts, ROUNDS, np.random.default_rng(k))
        else:
            near = [refined(estimator, u[at], c, FROM_NEAR) for c in pools[k - REPEATED]]
            found = sorted(near, key=lambda f: f[0])
        pools.append([c for _, c in found])
        cost, best = found[0]
        positions.append(estimator.position(best))
        costs.append(cost)
    return joined(model.plan, positions), costs


def from_the_truth(model: Model, record: Recording) -> tuple[Array, list[float]]:
    """Return the optimum nearest the measured motion, which a prediction cannot use, and its costs."""
    positions, costs = [], []
    for at in model.plan.stretches:
        estimator = model.estimator(at)
        c = estimator.coefficients(record.position_rad[at])
        cost, c = refined(estimator, record.torque_nm[at], c, ((INFLATION, SOFT_RAD_S, 25),))
        positions.append(estimator.position(c))
        costs.append(cost)
    return joined(model.plan, positions), costs


def nrmse(position: Array, record: Recording) -> Array:
    """Return rms error over standard deviation of the measured angle, by axis (6,)."""
    y = record.position_rad[: len(position)]
    return np.asarray(np.sqrt(np.mean((position - y) ** 2, axis=0)) / y.std(axis=0))


def row(name: str, causal: str, position: Array, record: Recording) -> str:
    """Return a line of the table."""
    e = nrmse(position, record)
    if e.max() > DIVERGED:
        return f"| {name} | {causal} | diverges | | |"
    y = record.position_rad[: len(position)]
    by_range = np.mean(e * y.std(axis=0) / np.ptp(y, axis=0))
    axes = ", ".join(f"{x:.2f}" for x in e)
    return f"| {name} | {causal} | {axes} | {e.mean():.3f} | {by_range:.3f} |"


def report(model: Model, name: str, record: Recording) -> Array:
    """Print all rows of a recording and return the estimated positions."""
    n = len(model.plan.rest)
    record = record.part(slice(0, n))
    u = record.torque_nm
    print(
        f"\n{name}\n\n| model | causal | NRMSE of axes 1 to 6 | mean | over range |\n|---|---|---|---|---|"
    )
    still = np.zeros(n, dtype=bool)
    for label, rest in (
        ("forward simulation", still),
        ("the same, zero at rests", model.plan.rest),
    ):
        position = simulated(model.physics, u, rest, model.step_s)
        print(row(label, "yes", position, record), flush=True)
    rough = joined(model.plan, [model.starts[0](u[at])[0] for at in model.plan.stretches])
    print(row("network alone (start)", "no", rough, record), flush=True)
    ours, found = estimated(model, u)
    print(row("most probable motion", "no", ours, record), flush=True)
    bound, nearest = from_the_truth(model, record)
    print(
        row("optimum nearest the measured motion (not a prediction)", "no", bound, record),
        flush=True,
    )
    for label, costs in (("found", found), ("nearest the measured motion", nearest)):
        print(f"cost of the optimum {label}: " + ", ".join(f"{x:.0f}" for x in costs))
    left = torque_errors(model.physics, [record], model.plan.used, model.step_s)
    share = left[0] / u[model.plan.used].std(axis=0)
    print(
        "torque error above 0.03 rad/s over torque: " + ", ".join(f"{x:.1%}" for x in share),
        flush=True,
    )
    return ours


def main() -> None:
    """Print the tables of the validation recording and, if asked, of the test recording."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("file", type=Path)
    parser.add_argument(
        "--open-test", action="store_true", help="Predict the test recording, not validation."
    )
    parser.add_argument("--submission", type=Path, help="Write the predicted angles here (.npz).")
    given = parser.parse_args()
    data = read(given.file, with_test=given.open_test or given.submission is not None)
    model = trained(data.train, data.sample_time_s)
    print(
        f"{data.kind}: {len(data.train)} training recordings, {len(model.plan.stretches)} motions each"
    )
    if data.test is None:
        report(model, "Validation recording", data.validation)
    else:
        position = report(model, "Test recording", data.test)
        if given.submission:
            np.savez(given.submission, position_rad=position)


if __name__ == "__main__":
    main()
