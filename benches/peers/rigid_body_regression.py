"""Regressor and base parameters of a six-axis arm: this package against Pinocchio and NumPy.

Run ``python benches/peers/rigid_body_regression.py`` from the root of the repository.

100,000 samples of a six-axis arm with white torque noise; both sides on one thread, CPU time,
best of several in turns.

* regressor: the array (samples, 6, 60). Pinocchio's ``computeJointTorqueRegressor`` takes one
  sample a call and is called in a Python loop, its only interface there, into an array made
  beforehand; what the loop costs without Pinocchio is printed. Ours makes its array, 288 MB, in
  every call; what a fill of as much new memory takes is printed too.
* estimate: the 36 base parameters and the residual of every axis. The peer takes the columns of
  the base parameters, which it gets for nothing, from its regressor and decomposes
  ``[Phi | tau]`` with NumPy's QR (LAPACK): at once, as people write it, and in pieces that fit
  in the cache; normal equations, which cost half the digits, are shown as well. Ours finds the
  base parameters anew, adds standard errors from blocks, row weights if asked, rank and sign
  checks, and never forms the regressor.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402
import pinocchio as pin  # noqa: E402
from common.timing import cpu, timed  # noqa: E402

from axisight.rigid_body import (  # noqa: E402
    TorqueModel,
    base_parameters,
    identify_rigid_body,
    torque_regressor,
)

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "python"))
import pinocchio_model  # noqa: E402
from rigid_body_data import robot_of, smooth_motion, wrist_arm  # noqa: E402

# Pinocchio orders the inertia xx xy yy xz yz zz.
PLACES = np.array([0, 1, 2, 3, 4, 6, 9, 5, 7, 8])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=100_000)
    parser.add_argument("--repeats", type=int, default=5)
    settings = parser.parse_args()
    n = settings.samples
    text = wrist_arm()
    robot = robot_of(text)
    model = TorqueModel(robot)
    q, v, a = smooth_motion(robot, n, 1e-3)
    torque = robot.inverse_dynamics(q, v, a)
    torque += 0.02 * torque.std(axis=0) * np.random.default_rng(0).normal(size=torque.shape)
    peer = pinocchio_model.build(text)
    data = peer.createData()
    regressor = np.zeros((n, 6, 60))
    take = np.concatenate([10 * link + PLACES for link in range(6)])[base_parameters(model).columns]

    def loop() -> None:
        for i in range(n):
            regressor[i] = pin.computeJointTorqueRegressor(peer, data, q[i], v[i], a[i])

    def peer_rows() -> np.ndarray:
        loop()
        rows = np.empty((6 * n, len(take) + 1))
        rows[:, :-1] = regressor.reshape(6 * n, 60)[:, take]
        rows[:, -1] = torque.ravel()
        return rows

    def finish(rows: np.ndarray, values: np.ndarray) -> np.ndarray:
        residual = rows[:, :-1] @ values - rows[:, -1]
        return np.append(values, np.sqrt((residual.reshape(n, 6) ** 2).mean(axis=0)))

    def peer_estimate() -> np.ndarray:
        rows = peer_rows()
        r = np.linalg.qr(rows, mode="r")
        return finish(rows, np.linalg.solve(r[:-1, :-1], r[:-1, -1]))

    def peer_in_pieces() -> np.ndarray:
        rows = peer_rows()
        pieces = [np.linalg.qr(rows[i : i + 3000], mode="r") for i in range(0, 6 * n, 3000)]
        r = np.linalg.qr(np.vstack(pieces), mode="r")
        return finish(rows, np.linalg.solve(r[:-1, :-1], r[:-1, -1]))

    def peer_normal() -> np.ndarray:
        rows = peer_rows()
        gram = rows.T @ rows
        return finish(rows, np.linalg.solve(gram[:-1, :-1], gram[:-1, -1]))

    def overhead() -> None:
        for i in range(n):
            regressor[i] = zero
            q[i], v[i], a[i]

    zero = np.zeros((6, 60))
    work = {
        "regressor, ours": lambda: torque_regressor(robot, q, v, a, threads=1),
        "  of which memory: a fill": lambda: np.empty((n, 6, 60)).fill(1.0),
        "regressor, Pinocchio": loop,
        "  of which the loop": overhead,
        "estimate, ours (ls)": lambda: identify_rigid_body(
            model, q, v, a, torque, method="ls", threads=1
        ),
        "estimate, ours (wls)": lambda: identify_rigid_body(model, q, v, a, torque, threads=1),
        "estimate, Pinocchio, NumPy QR": peer_estimate,
        "  the same, QR in pieces": peer_in_pieces,
        "  the same, normal equations": peer_normal,
    }
    best = dict.fromkeys(work, float("inf"))
    results = {}
    for _ in range(settings.repeats):
        for label, action in work.items():
            seconds, results[label] = timed(action)
            best[label] = min(best[label], seconds)
    ours = results["estimate, ours (ls)"]
    want = results["estimate, Pinocchio, NumPy QR"]
    got = np.append(ours.values, ours.residual_rms_nm)
    scale = np.abs(want) + np.append(ours.standard_error, np.zeros(6))
    got_regressor = results["regressor, ours"].values
    loop()
    columns = np.concatenate([10 * link + PLACES for link in range(6)])
    difference = np.abs(got_regressor - regressor[:, :, columns]).max() / np.abs(regressor).max()
    print(f"{cpu()}, Pinocchio {pin.__version__}, NumPy {np.__version__}, one thread, CPU time")
    print(f"{n} samples, best of {settings.repeats} in turns")
    for label, seconds in best.items():
        print(f"{label:32}{1e3 * seconds:9.1f} ms {1e6 * seconds / n:8.3f} us per sample")
    for label, peer_label in (
        ("regressor, ours", "regressor, Pinocchio"),
        ("estimate, ours (ls)", "estimate, Pinocchio, NumPy QR"),
        ("estimate, ours (ls)", "  the same, QR in pieces"),
        ("estimate, ours (ls)", "  the same, normal equations"),
    ):
        ratio = best[peer_label] / best[label]
        print(f"peer/ours {ratio:6.1f}  {label} against {peer_label.strip()}")
    print(f"regressors differ by {difference:.1e} of the largest entry")
    print(f"estimates differ by {np.abs((got - want) / scale).max():.1e}, relative")


if __name__ == "__main__":
    main()
