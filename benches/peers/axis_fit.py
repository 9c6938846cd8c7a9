"""Seven parameters of a two-mass axis from 32,500 samples: this package against numba and SciPy.

Run ``python benches/peers/axis_fit.py`` from the root of the repository.

Truth is model m3 of Wernholt (2004), Table 9.1, the start model m0; records as in section 9.4:
a triangle of 6.25 s, two multisines on square waves of 5 s, velocity controlled at 2 kHz. The
plant of the records is the peers' own model with 64 Runge-Kutta steps a sample.

* *speed*: the fit without noise. The peer simulates with one numba Runge-Kutta step per sample,
  as we do, and SciPy's trust region minimizes with scaled parameters and tolerances of 1e-12,
  once with finite differences and once with sensitivities written out. Its friction is the sign
  taken at every stage; ours finds the instants at which the sign changes. So the records are
  also made with the peer's own coarse steps, where its model is exact.
* *multistart*: fits from starts drawn around m0, 40 dB of white noise on the velocity.
* *intervals*: how often 95 % intervals hold the truth over many noise realizations.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("RAYON_NUM_THREADS", "1")

import argparse

import numpy as np
import scipy
from common import two_mass
from common.timing import cpu, timed

from axisight.graybox import AxisData, AxisModel, FitSettings, fit_axis, multistart_axis

MODEL = AxisModel(gear_ratio=two_mass.RATIO)
START = dict(zip(two_mass.NAMES, two_mass.START.tolist(), strict=True))
TRUTH = dict(zip(two_mass.NAMES, two_mass.TRUTH.tolist(), strict=True))
# As the peer does it: the free run from the start. The default goes there in rounds.
DIRECT = FitSettings(gradual=())
DAMPING_RANGE = (300.0, 1e4)


def data(records: list[two_mass.Record], seed: int | None = None) -> list[AxisData]:
    """Records for our fit; with a seed white noise 40 dB below the velocity of all of them."""
    power = np.mean(np.concatenate([r.velocity**2 for r in records]))
    size = 0.0 if seed is None else 0.01 * np.sqrt(power)
    out = []
    for i, r in enumerate(records):
        noise = size * np.random.default_rng([seed or 0, i]).normal(size=r.velocity.size)
        out.append(AxisData(r.torque, r.velocity + noise, sample_time_s=two_mass.SAMPLE_S))
    return out


def worst(values: np.ndarray) -> str:
    """Largest relative error and whose it is."""
    error = np.abs(values / two_mass.TRUTH - 1)
    return f"{100 * error.max():.5f} % ({two_mass.NAMES[int(error.argmax())]})"


def speed(label: str, records: list[two_mass.Record], repeats: int) -> None:
    """Times and errors of both sides, in turns."""
    own_data = data(records)
    runs = {
        "axisight": lambda: fit_axis(MODEL, own_data, START, settings=DIRECT),
        "axisight, rough rounds first": lambda: fit_axis(MODEL, own_data, START),
        "numba + SciPy, differences": lambda: two_mass.fit(records, two_mass.START, analytic=False),
        "numba + SciPy, sensitivities": lambda: two_mass.fit(
            records, two_mass.START, analytic=True
        ),
    }
    best = dict.fromkeys(runs, float("inf"))
    found = {}
    for _ in range(repeats):
        for name, run in runs.items():
            seconds, found[name] = timed(run)
            best[name] = min(best[name], seconds)
    print(f"\n{label}")
    print(f"{'':30}{'CPU s':>8}{'ratio':>7}  worst error of a parameter, evaluations")
    for name, result in found.items():
        own = name.startswith("axisight")
        values = result.values if own else result.x
        count = result.evaluations if own else f"{result.nfev} + {result.njev} Jacobians"
        ratio = best[name] / best["axisight"]
        print(f"{name:30}{best[name]:8.4f}{ratio:7.1f}  {worst(values)}, {count}")


def multistart(records: list[two_mass.Record], starts: int) -> None:
    """Share of starts that reach every parameter within 2 %."""
    noisy = data(records, seed=7)
    print(f"\n{starts} starts, 40 dB; log-uniform around m0 (d: 300 to 10,000), all within 2 %")
    for spread in (2.0, 3.0, 5.0):
        seconds, result = timed(
            lambda s=spread: multistart_axis(
                MODEL,
                noisy,
                START,
                n_starts=starts,
                seed=1,
                spread=s,
                ranges={"d": DAMPING_RANGE},
                threads=1,
            )
        )
        rate = result.success_rate(TRUTH, 0.02)
        print(f"factor {spread:g} either way: {100 * rate:.0f} % in {seconds:.1f} s CPU")


def coverage(records: list[two_mass.Record], runs: int) -> None:
    """Share of 95 % intervals that hold the truth, by parameter."""
    hits = {"white": np.zeros(7), "sandwich": np.zeros(7)}
    exact = [
        two_mass.Record(r.torque, MODEL.simulate(TRUTH, r.torque, two_mass.SAMPLE_S).output.values)
        for r in records
    ]
    for run in range(runs):
        fit = fit_axis(MODEL, data(exact, seed=1000 + run), TRUTH, settings=DIRECT)
        for kind, count in hits.items():
            for i, name in enumerate(two_mass.NAMES):
                low, high = fit.interval(name, kind=kind)
                count[i] += low <= two_mass.TRUTH[i] <= high
    print(f"\n95 % intervals over {runs} realizations at 40 dB [%]: {', '.join(two_mass.NAMES)}")
    for kind, count in hits.items():
        shares = ", ".join(f"{100 * c / runs:.1f}" for c in count)
        print(f"{kind}: {shares}; all {100 * count.mean() / runs:.1f}")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--starts", type=int, default=50)
    parser.add_argument("--realizations", type=int, default=300)
    args = parser.parse_args()
    print(cpu())
    print(f"SciPy {scipy.__version__}, one thread, CPU time, shortest of {args.repeats} in turns")
    records = two_mass.records()
    # Compiles the peer's functions.
    for analytic in (False, True):
        two_mass.fit(records, two_mass.TRUTH, analytic=analytic)
    speed("records of 64 steps a sample", records, args.repeats)
    speed("records of the peer's own steps", two_mass.records(crumbs=1), args.repeats)
    multistart(records, args.starts)
    coverage(records, args.realizations)


if __name__ == "__main__":
    main()
