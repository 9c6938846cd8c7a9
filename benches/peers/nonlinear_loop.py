"""Ten seconds of the nonlinear 20-state closed loop at 2 kHz: this package, SciPy, pydiffsol.

Run ``python benches/peers/nonlinear_loop.py`` from the root of the repository.

All solve the same robot with full rigid-body terms in the same motion (every axis swings by
0.35 rad, with four tones up to 36.7 Hz on top). The peers' right-hand side is an independent
model compiled by numba (``common/numba_plant.py``), checked here against the package.

* *sampled*: the task as specified, a controller at 2 kHz and its torque held in between.
  A solver has to start anew at every sample. The error of everyone is measured against one
  reference, a fixed-step Runge-Kutta run of the independent model with 32 sub-steps.
* *smooth*: kinder to the peers. The same controller in continuous time on the same smooth
  references, so one call solves the whole run and nothing restarts; outputs at the 20,001
  samples. Our package knows sampled controllers only, so its time is that of the sampled
  run. Errors are against a reference of the smooth run.

Every solver gets the loosest tolerance at which its worst position, motors and joints
alike, has a relative RMS error of at most 1e-6. Absolute tolerances are the relative ones
times the largest excursion of each state. Radau gets a compiled Jacobian. pydiffsol gets the
independent model as DiffSL text, written out in scalars, in scaled states. The numba loop is
no solver of a library: controller and Runge-Kutta steps compiled for this one robot.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse

import numpy as np
import scipy
from common import diffsol_runs, loops, numba_plant, setting, smooth
from common.loops import Task, relative_rms
from common.scan import RTOL, Row, loosest, peer, print_rows
from common.timing import cpu, timed

import axisight

Array = np.ndarray
SUBSTEPS = [1, 2, 3, 4, 6, 8]
REFERENCE_SUBSTEPS = (16, 32)


def own_rows(s: setting.Setting, reference: Array, args: argparse.Namespace) -> tuple:
    """Our explicit methods at the loosest setting; microseconds per evaluation."""
    rows, per_evaluation = [], {}
    choices = {
        "dopri5": [{"tolerance": t} for t in RTOL],
        "rk4": [{"substeps": n} for n in SUBSTEPS],
        "rkn4": [{"substeps": n} for n in SUBSTEPS],
    }
    for method, settings in choices.items():

        def error(choice: dict, method: str = method) -> float:
            return relative_rms(setting.ours(s, method=method, **choice)[0], reference)

        choice = loosest(error, settings, args.wanted)
        options = {"method": method, **choice}
        run = lambda o=options: axisight.simulate(s.robot, s.reference, **o)  # noqa: E731
        seconds, _ = timed(run, args.repeats)
        positions, attrs = setting.ours(s, **options)
        text = ", ".join(f"{k} {v:.3g}" for k, v in choice.items())
        reached = relative_rms(positions, reference)
        rows.append(Row(f"axisight {method}", text, reached, seconds, options))
        per_evaluation[f"axisight {method}"] = 1e6 * seconds / attrs["right_hand_sides"]
    return rows, per_evaluation


def numba_row(task: Task, reference: Array, args: argparse.Namespace) -> Row:
    """The compiled loop with as few sub-steps as will do."""

    def error(substeps: int) -> float:
        return relative_rms(loops.rk4_sampled(task, substeps)(), reference)

    n = loosest(error, SUBSTEPS, args.wanted)
    seconds, out = timed(loops.rk4_sampled(task, n), args.repeats)
    return Row("numba RK4 loop", f"substeps {n}", relative_rms(out, reference), seconds)


def sampled_rows(s: setting.Setting, reference: Array, args: argparse.Namespace) -> list[Row]:
    """Peers with a restart at every sample."""
    peers = {
        "pydiffsol tsit45": diffsol_runs.Sampled(s.model, s.sampled).prepare,
        "SciPy LSODA": loops.lsoda_sampled,
        "SciPy Radau": loops.radau_sampled,
    }
    return [numba_row(s.sampled, reference, args)] + [
        peer(label, prepare, s.sampled, reference, args.wanted, args.scan_seconds)
        for label, prepare in peers.items()
    ]


def smooth_rows(s: setting.Setting, args: argparse.Namespace) -> tuple[list[Row], float]:
    """Peers in one call, and pydiffsol's microseconds per evaluation."""
    fine, finer = (loops.rk4_sampled(s.smooth, n)() for n in REFERENCE_SUBSTEPS)
    print(f"\nsmooth reference converged to {relative_rms(fine, finer) / 15:.0e}")
    whole = diffsol_runs.Smooth(s.model, s.tones, s.feed_forward, s.smooth)
    peers = {
        "SciPy LSODA, odeint": smooth.lsoda,
        "SciPy LSODA, solve_ivp": smooth.scipy_ivp("LSODA"),
        "SciPy DOP853, solve_ivp": smooth.scipy_ivp("DOP853"),
        "SciPy Radau, solve_ivp": smooth.scipy_ivp("Radau"),
        "pydiffsol tsit45": whole.prepare,
    }
    rows = [numba_row(s.smooth, finer, args)] + [
        peer(label, prepare, s.smooth, finer, args.wanted, args.scan_seconds)
        for label, prepare in peers.items()
    ]
    # Six stages a step, the seventh is the next one's first. Rejected steps are not told, so
    # this is an upper bound.
    bare, steps = timed(whole.bare, args.repeats)
    return rows, 1e6 * bare / (6 * steps)


def batch_row(s: setting.Setting, best: Row) -> None:
    """Time per run in a batch of 64 against a single run, one thread."""
    runs = 64
    # Runs of different amplitude: no run may profit from being another's copy.
    scale = np.linspace(0.5, 1.0, runs)[:, None, None]
    references = np.ascontiguousarray(scale * s.reference)
    seconds, _ = timed(
        lambda: axisight.simulate_batch(s.robot, references, threads=1, **best.options)
    )
    each = seconds / runs
    print(f"\nbatch of {runs}: {each:.4f} s a run, single {best.seconds:.4f} s", end="")
    print(f", ratio {best.seconds / each:.2f}")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--wanted", type=float, default=1e-6)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--scan-seconds", type=float, default=1.0, help="part for the first scan")
    args = parser.parse_args()
    s = setting.make(args.seconds)
    inverse, linear = numba_plant.check(s.model, s.robot.core)
    print(cpu())
    print(f"SciPy {scipy.__version__}, one thread, {args.seconds:g} s, {len(s.reference)} samples")
    print(f"independent model against ours: inverse dynamics {inverse:.0e}, linear {linear:.0e}")

    fine, finer = (loops.rk4_sampled(s.sampled, n)() for n in REFERENCE_SUBSTEPS)
    print(f"sampled reference converged to {relative_rms(fine, finer) / 15:.0e}")
    own, per_evaluation = own_rows(s, finer, args)
    best = min(own, key=lambda r: r.seconds)
    print_rows("sampled: restart at every sample", own + sampled_rows(s, finer, args), best)
    rows, diffsol_us = smooth_rows(s, args)
    print_rows("smooth: no restarts, ours sampled", [best, *rows], best)

    compiled, _ = timed(loops.rk4_sampled(s.sampled, 1), args.repeats)
    per_evaluation["numba RK4 loop"] = 1e6 * compiled / (4 * len(s.reference))
    per_evaluation["pydiffsol tsit45, smooth"] = diffsol_us
    print("\nmicroseconds per right-hand side, solver included")
    for label, us in per_evaluation.items():
        print(f"{label:26}{us:8.3f}")
    batch_row(s, best)


if __name__ == "__main__":
    main()
