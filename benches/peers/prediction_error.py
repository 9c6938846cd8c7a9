"""Prediction-error models side by side, in one process run: this package and SIPPY.

Run ``python benches/peers/prediction_error.py [--runs 5]`` from the root of the repository, with
``pip install sippy_unipi`` (LGPL-3.0, which is why no extra of this package installs it). Without it
the script says so and ends.

Records of 2,000 samples from rest: a resonance with white input, and slow noise on its output. Both
packages get the same orders, in CPU time on one thread. The error is that of the response at 60 lines,
relative to it. SIPPY takes records to start at rest, which is right here; this package also estimates
the past and the standard errors, and searches from three starts.
"""

import argparse
import os
import sys
import warnings

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from common.timing import cpu, timed
from scipy import signal

from axisight.blackbox import armax, box_jenkins
from axisight.records.experiment import Experiment

TOP, BOTTOM = np.array([0.0, 0.2, 0.1]), np.array([1.0, -1.6, 0.8])
N = 2000
LINES = np.linspace(0.005, 0.495, 60)


def record(seed: int) -> Experiment:
    """One record with noise about as large as the output."""
    rng = np.random.default_rng(seed)
    u, e = rng.normal(size=N), 0.5 * rng.normal(size=N)
    y = signal.lfilter(TOP, BOTTOM, u) + signal.lfilter([1, 0.5], [1, -0.9], e)
    return Experiment(1.0, u, y)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=5, help="number of records")
    runs = parser.parse_args().runs
    try:
        from sippy_unipi import system_identification  # noqa: PLC0415
    except ImportError:
        print("skipped: pip install sippy_unipi")
        sys.exit(0)
    late = np.exp(-2j * np.pi * LINES)
    truth = np.polyval(TOP[::-1], late) / np.polyval(BOTTOM[::-1], late)

    def error(response: np.ndarray) -> float:
        return float(np.linalg.norm(response - truth) / np.linalg.norm(truth))

    def ours(x: Experiment, kind: str) -> np.ndarray:
        if kind == "Box-Jenkins, true orders":
            model = box_jenkins(x, nb=2, nc=1, nd=1, nf=2)
        else:
            model = armax(x, na=3, nb=3, nc=3)
        return model.response(LINES)["response"].values[:, 0, 0]

    def peer(x: Experiment, kind: str) -> np.ndarray:
        options = (
            {"id_method": "BJ", "BJ_orders": [2, 1, 1, 2, 0]}
            if kind == "Box-Jenkins, true orders"
            else {"id_method": "ARMAX", "ARMAX_orders": [3, 3, 3, 0], "ARMAX_mod": "OPT"}
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = system_identification(x.output[:, 0], x.input[:, 0], **options)
        return np.asarray(model.G(1 / late)).ravel()

    table = []
    for kind in ("Box-Jenkins, true orders", "ARMAX, order 3"):
        found = {}
        for name, call in (("axisight", ours), ("SIPPY", peer)):
            each = [timed(lambda s=s, c=call, k=kind: c(record(s), k)) for s in range(runs)]
            seconds, errors = (
                np.mean([t for t, _ in each]),
                np.mean([error(g) for _, g in each]),
            )
            found[name] = seconds
            ratio = seconds / found["axisight"]
            table.append(f"| {name} | {kind} | {seconds:.3f} | {errors:.1%} | {ratio:.0f} |")
    # SIPPY prints while it fits, so the table comes last.
    print(f"\n{cpu()}; {N} samples, mean of {runs} records\n")
    print("| | model | CPU s | rel. error | peer/ours |\n|---|---|---|---|---|")
    print("\n".join(table))


if __name__ == "__main__":
    main()
