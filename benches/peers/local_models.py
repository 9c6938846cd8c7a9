"""Local rational method side by side, in one process run: this package and SDynPy.

Run ``python benches/peers/local_models.py [--lines 391]`` from the root of the repository,
with ``pip install sdynpy joblib psutil``.

One record of 20,000 samples of white noise on three inputs and three outputs: a sampled
system with three resonances, random initial state, white noise on the outputs. The response
is wanted at lines 10 to 400, from raw samples, on one thread, in CPU time.

*same model* gives SDynPy our orders (numerator, transient and denominator 2), our window and
one local model per line. *as it comes* leaves it its defaults: three candidate models of lower
order per window, windows of 30 Hz, one window for the lines in its middle tenth.

The two do not do quite the same work. SDynPy iterates on the denominator (Sanathanan and
Koerner, until the coefficients change by less than 0.5 %); we solve one linear problem, and
compute variances, which SDynPy does not. So the table counts its least-squares solutions per
line and output, and gives the ratio for one of them as well.
"""

import argparse
import os
import warnings

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from common.timing import cpu, timed
from scipy.signal import lfilter
from sdynpy.signal_processing import sdynpy_lrm

from axisight.frf import local_rational
from axisight.records import ArbitraryRecords

N, SAMPLE_TIME, CHANNELS, HALF_WIDTH = 20_000, 5e-4, 3, 20
RESONANCE_HZ, DAMPING = (8.0, 15.0, 28.0), (0.05, 0.04, 0.03)


def record(rng: np.random.Generator, noise: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Input, output (sample, channel), and the exact response at all lines below Nyquist."""
    poles = [
        np.exp(2 * np.pi * f * SAMPLE_TIME * (-z + 1j * np.sqrt(1 - z**2)))
        for f, z in zip(RESONANCE_HZ, DAMPING, strict=True)
    ]
    lines = np.arange(1, N // 2)
    delay = np.exp(-2j * np.pi * lines / N)
    u = rng.normal(size=(N, CHANNELS))
    y = np.zeros((N, CHANNELS))
    truth = np.zeros((len(lines), CHANNELS, CHANNELS), complex)
    for pole in poles:
        a = np.real(np.poly([pole, pole.conj()]))
        shape = rng.normal(size=(CHANNELS, CHANNELS)) * abs(np.sum(a))
        filtered = lfilter([1.0], a, u, axis=0, zi=rng.normal(size=(2, CHANNELS)))[0]
        y += filtered @ shape.T
        truth += shape / np.polyval(a[::-1], delay)[:, None, None]
    return u, y + noise * np.std(y) * rng.normal(size=y.shape), truth


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lines", type=int, default=391, help="fewer for a quick look")
    lines = 10 + np.arange(parser.parse_args().lines)
    u, y, truth = record(np.random.default_rng(1), 0.01)
    truth = truth[lines - 1]
    records = ArbitraryRecords(SAMPLE_TIME, u, y)

    solved = 0

    def counted(solver):  # type: ignore[no-untyped-def]
        def solve(a, b):  # type: ignore[no-untyped-def]
            nonlocal solved
            solved += len(a)
            return solver(a, b)

        return solve

    # SDynPy 0.23 counts with NumPy's truth values, which NumPy 2 refuses as indices.
    sdynpy_lrm.range = lambda *limits: range(*map(int, limits))
    for name in ("__lstsq_numpy", "__lstsq_scipy"):
        setattr(sdynpy_lrm, name, counted(getattr(sdynpy_lrm, name)))

    def ours():  # type: ignore[no-untyped-def]
        found = local_rational(records, lines=lines, half_width=HALF_WIDTH, threads=1)
        return found.response.values

    def peer(**options):  # type: ignore[no-untyped-def]
        spectra = [np.fft.rfft(a, axis=0)[1 : N // 2].T for a in (u, y)]
        hz = np.arange(1, N // 2) / (N * SAMPLE_TIME)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return sdynpy_lrm.frf_local_model(
                *spectra, hz, f_out=hz[lines - 1], max_parallel=1, print_time=False, **options
            )[1]

    def error(response: np.ndarray) -> float:
        return float(np.linalg.norm(response - truth) / np.linalg.norm(truth))

    own_time, own = timed(ours, 7)
    print(f"{cpu()}; {N} samples, {CHANNELS}x{CHANNELS}, {len(lines)} lines\n")
    print("| | CPU s | rel. error | solutions per line and output | peer/ours | per solution |")
    print("|---|---|---|---|---|---|")
    print(f"| axisight local_rational | {own_time:.4f} | {error(own):.1e} | 1 | 1 | 1 |")
    width = (2 * HALF_WIDTH + 1) / (N * SAMPLE_TIME)
    same = {"modelset": [[2, 2, 2]], "bandwidth": width, "export_ratio": 0.5 / (2 * HALF_WIDTH)}
    for name, options in {"same model": same, "as it comes": {}}.items():
        solved = 0
        seconds, response = timed(lambda options=options: peer(**options))
        each = solved / len(lines) / CHANNELS
        ratio = seconds / own_time
        print(
            f"| SDynPy, {name} | {seconds:.2f} | {error(response):.1e} | {each:.1f} "
            f"| {ratio:.0f} | {ratio / each:.0f} |"
        )


if __name__ == "__main__":
    main()
