"""The multivariable estimate from records, side by side with NumPy and pyFRF.

Run ``python benches/peers/frf_estimators.py`` (needs pyFRF).

Three experiments of eight periods of 20,000 samples, three inputs and three outputs, 391
lines. ``axisight.frf.mfrf`` gives G, the variance of each element from the scatter of the
periods, condition numbers and flags, and removes drift from the output. NumPy does the same
work but the drift: real FFTs of every period (samples contiguous, which suits it; ours has
them interleaved), means over periods, a batched inverse, the residuals of each period carried
through U^-1, and condition numbers; and once more only G. pyFRF's H1 is fed the 24 periods as
24 measurements of three inputs and outputs, as it asks, and gives H1 on all 10,001 lines
without uncertainty; it is called as it comes, and with its faster direct inverse.

One thread, CPU time; then ours on all cores against the peers, which have one thread each, by
wall time. The largest relative difference from NumPy's G is printed.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import time

import numpy as np
import pyFRF

from axisight import frf
from axisight.records.periodic import PeriodicRecords

N, PERIODS, EXPERIMENTS, CHANNELS = 20_000, 8, 3, 3
LINES = np.arange(10, 401)


def shortest(action, repeats: int, clock=time.process_time):
    best, result = float("inf"), None
    for _ in range(repeats):
        begin = clock()
        result = action()
        best = min(best, clock() - begin)
    return best, result


def by_numpy(u: np.ndarray, y: np.ndarray, covariance: bool):
    """From (experiment, period, channel, sample)."""
    spectra = [np.fft.rfft(s)[..., LINES].transpose(3, 0, 1, 2) for s in (u, y)]
    averages = [s.mean(axis=2).swapaxes(1, 2) for s in spectra]  # line, channel, experiment
    inverse = np.linalg.inv(averages[0])
    g = averages[1] @ inverse
    if not covariance:
        return g
    residual = spectra[1] - np.einsum("fij,fepj->fepi", g, spectra[0])
    error = residual.var(axis=2, ddof=1) / PERIODS  # line, experiment, output
    variance = np.einsum("fei,fej->fij", error, np.abs(inverse) ** 2)
    return g, variance, np.linalg.cond(averages[0])


def main() -> None:
    rng = np.random.default_rng(1)
    shape = (EXPERIMENTS, 1, N, CHANNELS)
    u = rng.normal(size=shape) + 0.01 * rng.normal(size=(EXPERIMENTS, PERIODS, N, CHANNELS))
    y = np.roll(u, 1, axis=2) + 0.3 * u[..., ::-1]
    y += 0.01 * rng.normal(size=y.shape)
    records = PeriodicRecords(5e-4, u, y, LINES)
    flat_u, flat_y = (np.ascontiguousarray(s.swapaxes(2, 3)) for s in (u, y))
    # pyFRF: (measurement, channel, sample).
    measured = [s.reshape(-1, CHANNELS, N) for s in (flat_u, flat_y)]

    def by_pyfrf(fastest: bool):
        peer = pyFRF.FRF(
            sampling_freq=2000,
            exc=measured[0],
            resp=measured[1],
            exc_type="f",
            resp_type="d",
            window="none",
            frf_estimator="H1",
            analytical_inverse=fastest,
        )
        return peer.get_FRF()

    ours, found = shortest(lambda: frf.mfrf(records), 9)
    plain, g = shortest(lambda: by_numpy(flat_u, flat_y, False), 9)
    whole, (_, variance, _) = shortest(lambda: by_numpy(flat_u, flat_y, True), 9)
    # Removing the drift is for free, but changes the response by what the noise pretends.
    found = frf.mfrf(records, remove_drift=False)
    difference = np.abs(found["response"].values - g).max() / np.abs(g).max()
    spread = np.abs(found["variance"].values / variance - 1).max()
    print(f"G off NumPy's by {difference:.1e}, variance by {spread:.1e}")
    print(f"{'axisight mfrf, all':<28} {ours * 1e3:8.2f} ms")
    print(f"{'NumPy, all':<28} {whole * 1e3:8.2f} ms  {whole / ours:6.1f}")
    print(f"{'NumPy, G alone':<28} {plain * 1e3:8.2f} ms  {plain / ours:6.1f}")
    peers = (("pyFRF H1, as it comes", False), ("pyFRF H1, direct inverse", True))
    for label, fastest in peers:
        peer, _ = shortest(lambda fastest=fastest: by_pyfrf(fastest), 3)
        print(f"{label:<28} {peer * 1e3:8.2f} ms  {peer / ours:6.1f}")
    wall = time.perf_counter
    ours, _ = shortest(lambda: frf.mfrf(records, threads=0), 15, wall)
    print(f"{'axisight mfrf, all cores':<28} {ours * 1e3:8.2f} ms, wall")
    whole, _ = shortest(lambda: by_numpy(flat_u, flat_y, True), 9, wall)
    print(f"{'NumPy, all':<28} {whole * 1e3:8.2f} ms  {whole / ours:6.1f}")
    for label, fastest in peers:
        peer, _ = shortest(lambda fastest=fastest: by_pyfrf(fastest), 3, wall)
        print(f"{label:<28} {peer * 1e3:8.2f} ms  {peer / ours:6.1f}")


if __name__ == "__main__":
    main()
