"""Crest factors of flat multisines side by side: this package and clipping in NumPy.

Run ``python benches/peers/crest_factor.py`` from the root of the repository; ``--budget`` is
the wall time of the search over many starts, ``--hunt`` a longer one for the lowest ever.

Every crest factor is computed here with NumPy on a grid of 32 times the Nyquist count of the
highest line, for both sides. Times for one start are CPU times on one thread, ours and the
peer's in turn, medians over the same starts (same initial phases).
"""

from __future__ import annotations

import argparse
import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from common.timing import cpu

from axisight.excitation import Clipping, LpRefinement, multisine, optimize_crest_factor
from axisight.excitation.multisine import Multisine

BAND_HZ, SAMPLE_TIME_S = (1.0, 40.0), 5e-4
LADDER = (
    (Clipping(1500, relaxation=6.0), LpRefinement(64, 256, 5)),
    (Clipping(3000), LpRefinement(64, 256, 8)),
    (Clipping(3000), LpRefinement(16, 512, 20)),
)


def crest_factor(lines: np.ndarray, phase: np.ndarray) -> float:
    """Crest factor of a flat multisine on the 32x grid."""
    n = 64 * int(lines.max())
    spectrum = np.zeros(n // 2 + 1, complex)
    spectrum[lines] = 0.5 * n * np.exp(1j * phase) / 1j
    return float(np.abs(np.fft.irfft(spectrum, n)).max() / np.sqrt(0.5 * len(lines)))


def peer(lines: np.ndarray, phase: np.ndarray, iterations: int) -> np.ndarray:
    """Algorithm 5.1 with the same schedule and grid as ours; the phases at the end."""
    n = 1 << (16 * int(lines.max()) - 1).bit_length()
    d = np.exp(1j * phase) / 1j
    spectrum = np.zeros(n // 2 + 1, complex)
    for level in 1 - np.geomspace(0.3, 0.001, iterations):
        spectrum[lines] = d
        x = np.fft.irfft(spectrum, n)
        bound = level * max(x.max(), -x.min())
        np.clip(x, -bound, bound, out=x)
        d = np.fft.rfft(x)[lines]
        d /= np.abs(d)
    return np.asarray(np.angle(1j * d))


def to_reach(signal: Multisine, target: float, starts: int) -> None:
    """CPU time per start to get to the target, ours against the peer's."""
    ours: list[tuple[float, float, int, int]] = []
    theirs: list[tuple[float, float, int]] = []
    for run in range(starts):
        start = multisine(signal.period_s, SAMPLE_TIME_S, band_hz=BAND_HZ, run=run)
        # Both sides: the least effort, of a ladder, that reaches the target; only that rung counts.
        for iterations in (1000, 2000, 3000, 4500, 7000, 10000, 15000, 20000):
            begin = time.process_time()
            phase = peer(start.lines, start.phase_rad, iterations)
            spent = time.process_time() - begin
            reached = crest_factor(start.lines, phase)
            if reached <= target:
                break
        theirs.append((spent, reached, iterations))
        for clipping, refinement in LADDER:
            begin = time.process_time()
            found = optimize_crest_factor(
                start, from_signal=True, threads=1, clipping=clipping, refinement=refinement
            )
            spent = time.process_time() - begin
            reached = crest_factor(found.signal.lines, found.signal.phase_rad)
            if reached <= target:
                break
        ours.append((spent, reached, found.clipping_iterations, found.refinement_steps))
    a, b = np.array(ours), np.array(theirs)
    print(
        f"  to {target} from {starts} starts: reached by ours {np.sum(a[:, 1] <= target)}, "
        f"by the peer {np.sum(b[:, 1] <= target)}"
    )
    print(
        f"    ours {np.median(a[:, 0]):.3f} s ({np.median(a[:, 2]):.0f} clips + "
        f"{np.median(a[:, 3]):.0f} Gauss-Newton steps), crest factor median "
        f"{np.median(a[:, 1]):.4f}"
    )
    print(
        f"    peer {np.median(b[:, 0]):.3f} s ({np.median(b[:, 2]):.0f} clips), crest factor "
        f"median {np.median(b[:, 1]):.4f}"
    )
    print(
        f"    peer / ours: median {np.median(b[:, 0] / a[:, 0]):.1f}, "
        f"of medians {np.median(b[:, 0]) / np.median(a[:, 0]):.1f}"
    )


def many_starts(signal: Multisine, seconds: float, seed: int, goal: float) -> None:
    """Best of many starts within a wall time, all cores."""
    begin = time.perf_counter()
    found = optimize_crest_factor(signal, starts=1_000_000, time_s=seconds, seed=seed)
    wall = time.perf_counter() - begin
    checked = crest_factor(found.signal.lines, found.signal.phase_rad)
    done = found.crest_factors
    verdict = "reached" if checked <= goal else "MISSED"
    print(
        f"  {wall:.1f} s wall, {len(done)} starts: best {checked:.4f} (seed {seed}, start "
        f"{found.start}), median {np.median(done):.4f}; goal {goal}: {verdict}; "
        f"{found.clipping_iterations} clips, {found.refinement_steps} Gauss-Newton steps"
    )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--starts", type=int, default=5)
    parser.add_argument("--budget", type=float, default=10.0)
    parser.add_argument("--hunt", type=float, default=0.0)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    print(f"{cpu()}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
    for period_s, goal, target in ((10.0, 1.387, 1.410), (5.0, 1.385, 1.410)):
        signal = multisine(period_s, SAMPLE_TIME_S, band_hz=BAND_HZ)
        schroeder = multisine(period_s, SAMPLE_TIME_S, band_hz=BAND_HZ, phases="schroeder")
        print(
            f"{len(signal.lines)} lines, 1-40 Hz at {1 / period_s:g} Hz; Schroeder phases "
            f"{crest_factor(signal.lines, schroeder.phase_rad):.3f}"
        )
        to_reach(signal, target, options.starts)
        many_starts(signal, options.hunt or options.budget, options.seed, goal)


if __name__ == "__main__":
    main()
