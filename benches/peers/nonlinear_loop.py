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


def own_rows(s: setting.Setting, reference: Array, args: argparse.Namespace) -> tuple:
    """Our two explicit methods at the loosest setting; microseconds per evaluation."""
    rows, per_evaluation = [], {}
    options = {
        "dopri5": [{"tolerance": t} for t in RTOL],
        "rk4": [{"substeps": n} for n in (1, 2, 3, 4, 6, 8)],
    }
    for method, choices in options.items():

        def error(choice: dict, method: str = method) -> float:
            return relative_rms(setting.ours(s, method=method, **choice)[0], reference)

        choice = loosest(error, choices, args.wanted)
        run = lambda m=method, c=choice: axisight.simulate(s.robot, s.reference, method=m, **c)  # noqa: E731
        seconds, _ = timed(run, args.repeats)
        positions, attrs = setting.ours(s, method=method, **choice)
        text = ", ".join(f"{k} {v:.3g}" for k, v in choice.items())
        rows.append(Row(f"axisight {method}", text, relative_rms(positions, reference), seconds))
        per_evaluation[f"axisight {method}"] = 1e6 * seconds / attrs["right_hand_sides"]
    return rows, per_evaluation


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

    fine, finer = (loops.rk4_sampled(s.sampled, n)() for n in (16, 32))
    smooth_fine, smooth_finer = (loops.rk4_sampled(s.smooth, n)() for n in (16, 32))
    print(
        f"references converged to {relative_rms(fine, finer) / 15:.0e} (sampled)"
        f" and {relative_rms(smooth_fine, smooth_finer) / 15:.0e} (smooth)"
    )
    own, per_evaluation = own_rows(s, finer, args)
    best = min(own, key=lambda r: r.seconds)

    def rk4(task: Task, reference: Array) -> Row:
        n = loosest(
            lambda n: relative_rms(loops.rk4_sampled(task, n)(), reference),
            [1, 2, 3, 4, 6, 8],
            args.wanted,
        )
        seconds, out = timed(loops.rk4_sampled(task, n), args.repeats)
        return Row("numba RK4 loop", f"substeps {n}", relative_rms(out, reference), seconds)

    rows = [rk4(s.sampled, finer)]
    restarting = diffsol_runs.Sampled(s.model, s.sampled)
    for label, prepare in (
        ("pydiffsol tsit45", restarting.prepare),
        ("SciPy LSODA", loops.lsoda_sampled),
        ("SciPy Radau", loops.radau_sampled),
    ):
        rows.append(peer(label, prepare, s.sampled, finer, args.wanted, args.scan_seconds))
    print_rows("sampled: restart at every sample", own + rows, best)

    rows = [rk4(s.smooth, smooth_finer)]
    whole = diffsol_runs.Smooth(s.model, s.tones, s.feed_forward, s.smooth)
    for label, prepare in (
        ("SciPy LSODA, odeint", smooth.lsoda),
        ("SciPy LSODA, solve_ivp", smooth.scipy_ivp("LSODA")),
        ("SciPy DOP853, solve_ivp", smooth.scipy_ivp("DOP853")),
        ("SciPy Radau, solve_ivp", smooth.scipy_ivp("Radau")),
        ("pydiffsol tsit45", whole.prepare),
    ):
        rows.append(peer(label, prepare, s.smooth, smooth_finer, args.wanted, args.scan_seconds))
    print_rows("smooth: no restarts, ours sampled", [best, *rows], best)
    per_evaluation["numba RK4 loop"] = (
        1e6 * timed(loops.rk4_sampled(s.sampled, 1), args.repeats)[0] / (4 * len(s.reference))
    )
    # Six stages a step, the seventh is the next one's first. Rejected steps are not told, so
    # this is an upper bound.
    bare, steps = timed(whole.bare, args.repeats)
    per_evaluation["pydiffsol tsit45, smooth"] = 1e6 * bare / (6 * steps)
    print("\nmicroseconds per right-hand side, solver included")
    for label, us in per_evaluation.items():
        print(f"{label:26}{us:8.3f}")
    if hasattr(axisight, "simulate_batch"):
        batch_row(s, best, args)
    else:
        print("\nbatch: not in this version of the package")


def batch_row(s: setting.Setting, best: Row, args: argparse.Namespace) -> None:
    """Time per run in a batch of 64 against a single run, one thread."""
    runs = 64
    scale = np.linspace(0.5, 1.0, runs)[:, None, None]
    references = np.ascontiguousarray(scale * s.reference)
    method, choice = best.label.split()[1], best.settings.split()
    options = {choice[0]: int(choice[1]) if method == "rk4" else float(choice[1])}
    seconds, _ = timed(
        lambda: axisight.simulate_batch(s.robot, references, threads=1, method=method, **options),
        1,
    )
    per_run = seconds / runs
    print(f"\nbatch of {runs}: {per_run:.4f} s a run, single {best.seconds:.4f} s,")
    print(f"ratio {best.seconds / per_run:.2f}")


if __name__ == "__main__":
    main()
