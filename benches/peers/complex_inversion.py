"""Inversion of a million small complex matrices, side by side with ``numpy.linalg.inv``.

Run ``python benches/peers/complex_inversion.py [--count 1000000]``.

Both sides invert the same random 3x3 and 6x6 matrices of complex doubles, on one thread
(OPENBLAS_NUM_THREADS=1; NumPy's own loop over the matrices is serial anyway) and, for ours,
once more on two. ``axisight.frf.invert`` also flags singular matrices, which NumPy raises for.
The residual is the largest of |A X - 1| / (eps n |A| |X|) over 100,000 matrices, and over
2,000 of condition number 1e10 with singular values in equal ratios.

Times on one thread are CPU times, on two wall times. "Memory again" puts our inverses where
the last ones were (``out=``), which NumPy cannot; "in cache" repeats the inversion of 1,000
matrices. "NumPy's copy" is what ``matrices.copy()`` takes, and ``numpy.copyto`` into memory in
use: a lower bound for anything that reads and writes as much.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import time
from functools import partial

import numpy as np

from axisight import frf


def shortest(action, clock, repeats: int = 5) -> float:
    best = float("inf")
    for _ in range(repeats):
        begin = clock()
        action()
        best = min(best, clock() - begin)
    return best


def inverted(matrices, threads, out=None):
    return frf.invert(matrices, threads=threads, out=out)


def residual(a: np.ndarray, x: np.ndarray) -> float:
    n = a.shape[-1]
    size = np.linalg.norm(a, axis=(1, 2)) * np.linalg.norm(x, axis=(1, 2))
    left = np.linalg.norm(a @ x - np.eye(n), axis=(1, 2))
    return float(np.max(left / (np.finfo(float).eps * n * size)))


def badly_conditioned(rng: np.random.Generator, n: int) -> np.ndarray:
    shape = (2000, n, n)
    q = [np.linalg.qr(rng.normal(size=shape) + 1j * rng.normal(size=shape))[0] for _ in range(2)]
    return q[0] * np.logspace(0, -10, n) @ q[1]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=1_000_000)
    count = parser.parse_args().count
    rng = np.random.default_rng(1)
    print(f"{'':>22} {'NumPy ns':>9} {'ours ns':>9} {'ratio':>6}   residual NumPy, ours")
    for n in (3, 6):
        a = rng.normal(size=(count, n, n)) + 1j * rng.normal(size=(count, n, n))
        few, many = a[:1000], a[:100_000]
        hard = badly_conditioned(rng, n)
        good = residual(many, np.linalg.inv(many)), residual(many, frf.invert(many)[0])
        bad = residual(hard, np.linalg.inv(hard)), residual(hard, frf.invert(hard)[0])
        again = np.ones_like(a)
        rows = [
            ("one thread", a, time.process_time, 1, None, 7),
            ("memory again", a, time.process_time, 1, again, 7),
            ("two threads, wall", a, time.perf_counter, 2, None, 7),
            ("in cache", few, time.process_time, 1, np.ones_like(few), 300),
        ]
        for label, matrices, clock, threads, out, repeats in rows:
            begin = matrices, threads, out
            peer = shortest(lambda m=matrices: np.linalg.inv(m), clock, repeats)
            ours = shortest(lambda b=begin: inverted(*b), clock, repeats)
            print(
                f"{n}x{n} {label:>18} {peer / len(matrices) * 1e9:9.0f} "
                f"{ours / len(matrices) * 1e9:9.0f} {peer / ours:6.1f}   "
                f"{good[0]:.2f}, {good[1]:.2f}; condition 1e10: {bad[0]:.2f}, {bad[1]:.2f}"
            )
        used = shortest(partial(np.copyto, again, a), time.process_time) / count * 1e9
        new = shortest(a.copy, time.process_time) / count * 1e9
        label = "NumPy's copy"
        print(f"{n}x{n} {label:>18} {new:9.0f} {used:9.0f} (new memory, memory in use)")


if __name__ == "__main__":
    main()
