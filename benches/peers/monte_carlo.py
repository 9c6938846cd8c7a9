"""A Monte Carlo study side by side, in one process run: this package, and NumPy with Numba.

Run ``python benches/peers/monte_carlo.py [--runs 250] [--peer-runs 4] [--scaling 250 1000]``
from the root of the repository.

The study is that of Wernholt (2004), Figure 8.9: per realization three experiments of 20 s
(one period of 10 s waited, one measured) at 2 kHz on the linearized 20-state robot in closed
loop, random-phase multisine 1-40 Hz with peak 8 rad/s on one axis at a time, smoothed square
wave of 9.6 rad/s on all axes, torque and resolver ripple of Table 8.1, sensor noise; then
G = Y U^-1 on 391 lines and the running mean over realizations.

The peer is what a researcher would write who knows Numba: the exact zero-order hold of the
plant (matrix exponential, once), the ripple inside the sample treated with the same global
order (predicted and corrected once over the sample, with the same first-order-hold and
Hermite matrices), loops compiled with ``fastmath``, NumPy's real FFT and
``np.linalg.solve`` on all lines at once. Compilation is not counted. It is timed as such a
script comes, on one thread, and once more with its loops spread over as many threads as we
use (``prange`` over experiments). It runs on fewer realizations and is scaled; its cost per
realization does not depend on their number.

The peer's noise, phases and square wave come from NumPy, so the two agree in distribution
only; without noise and ripple both must give the exact response, which is checked here.
"""

import argparse
import math
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numba
import numpy as np
from scipy.linalg import expm

import axisight
from axisight import montecarlo as mc
from axisight.montecarlo.backends import available_threads

T = 5e-4
N = 20_000
LINES = np.arange(10, 401)
TORQUE = [(3, 0.06, 1.45), (36, 0.11, 0.9), (72, 0.08, 0.2)]
TORQUE_U = [(18, 0.04, 0.0)]
RESOLVER = [(2, 0.40e-3, -1.84), (10, 0.20e-3, 0.81), (12, 0.22e-3, 2.94), (48, 0.18e-3, 2.94)]


def entry(name: str, axis: int, unit: str, terms: list, extra: list) -> mc.EffectEntry:
    """Ripple ``a sin(n phi + p)`` as the cosine and sine amplitudes of an effect."""
    values = {}
    for label, (order, a, p) in [(str(i + 1), t) for i, t in enumerate(terms)] + [
        ("u", t) for t in extra
    ]:
        suffix = "" if label == "u" else f"_{unit}"
        values[f"order_{label}"] = float(order)
        values[f"cosine_{label}{suffix}"] = a * math.sin(p)
        values[f"sine_{label}{suffix}"] = a * math.cos(p)
    return mc.EffectEntry(name=name, axis=axis, parameters=values)


def study(ripple: bool = True, noise: bool = True) -> mc.Study:
    """Figure 8.9."""
    effects = []
    for axis in (1, 2, 3):
        effects.append(entry("torque_ripple", axis, "nm", TORQUE, TORQUE_U))
        effects.append(entry("resolver_ripple", axis, "rad", RESOLVER, []))
    return mc.Study(
        name="figure 8.9",
        robot="irb6600_like",
        excitation=mc.Excitation(
            multisine=mc.Multisine(period_s=10.0, band_hz=(1.0, 40.0), peak_rad_s=8.0),
            square=mc.Square(amplitude_rad_s=9.6, period_s=5.0),
        ),
        effect=effects if ripple else [],
        measurement=mc.Measurement(noise=noise),
    )


def matrices(robot: axisight.Robot) -> dict[str, np.ndarray]:
    """Exact propagation over a sample: x' = A x + B w with w a cubic in time."""
    a, b, c = robot.linearize()
    n, m = b.shape
    big = np.zeros((n + 4 * m, n + 4 * m))
    big[:n, :n] = a * T
    big[:n, n : n + m] = b * T
    for i in range(3 * m):
        big[n + i, n + m + i] = 1.0
    # Scaling speeds to rad per sample keeps the powers of A T small.
    unit = np.concatenate([np.ones(n // 2), np.full(n // 2, T), np.ones(4 * m)])
    e = expm(big * unit[:, None] / unit) / unit[:, None] * unit
    g = [np.ascontiguousarray(e[:n, n + k * m : n + (k + 1) * m]) for k in range(4)]
    return {
        "phi": np.ascontiguousarray(e[:n, :n]),
        "g0": g[0],
        "g1": g[1],
        "k1": 6.0 * g[2] - 12.0 * g[3],
        "k2": 6.0 * g[3] - 2.0 * g[2],
        "c": c,
    }


@numba.njit(fastmath=True)
def waves(angle, table):
    """Sum of a sin(n phi + p) and its slope over phi."""
    value, slope = 0.0, 0.0
    for k in range(table.shape[0]):
        inner = table[k, 0] * angle + table[k, 2]
        value += table[k, 1] * math.sin(inner)
        slope += table[k, 1] * table[k, 0] * math.cos(inner)
    return value, slope


@numba.njit(fastmath=True)
def one_run(ref, noise, phi, g0, g1, k1, k2, kp, ki, tau, tau_u, res, ripple, u_out, y_out):
    """One experiment; motor angles are the first states, their speeds start at half."""
    n, m = phi.shape[0], g0.shape[1]
    x, p = np.zeros(n), np.zeros(n)
    target, before, u = np.zeros(m), np.zeros(m), np.zeros(m)
    t0, d0, e1, e2 = np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(m)
    for k in range(ref.shape[0]):
        for i in range(m):
            y = x[i] + noise[k, i]
            if ripple:
                y += waves(x[i], res)[0]
            speed = (y - before[i]) / T if k > 0 else 0.0
            before[i] = y
            u[i] = kp[i] * (ref[k, i] - speed) + ki[i] * (target[i] - y)
            target[i] += T * ref[k, i]
            if k >= N:
                u_out[i, k - N] = u[i]
                y_out[i, k - N] = y
            t0[i] = u[i]
            d0[i] = 0.0
            if ripple:
                value, slope = waves(x[i], tau)
                value_u, slope_u = waves(x[i], tau_u)
                t0[i] += value + u[i] * value_u
                d0[i] = (slope + u[i] * slope_u) * x[n // 2 + i] * T
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += phi[i, j] * x[j]
            for j in range(m):
                total += g0[i, j] * t0[j] + g1[i, j] * d0[j]
            p[i] = total
        if ripple:
            for i in range(m):
                value, slope = waves(p[i], tau)
                value_u, slope_u = waves(p[i], tau_u)
                end = u[i] + value + u[i] * value_u
                rate = (slope + u[i] * slope_u) * p[n // 2 + i] * T
                e1[i] = end - t0[i] - d0[i]
                e2[i] = rate - d0[i]
            for i in range(n):
                total = p[i]
                for j in range(m):
                    total += k1[i, j] * e1[j] + k2[i, j] * e2[j]
                p[i] = total
        for i in range(n):
            x[i] = p[i]


@numba.njit(parallel=True, fastmath=True)
def simulate(refs, noises, phi, g0, g1, k1, k2, kp, ki, tau, tau_u, res, ripple, u, y):
    """All experiments of a batch, in parallel."""
    for i in numba.prange(refs.shape[0]):
        one_run(
            refs[i], noises[i], phi, g0, g1, k1, k2, kp, ki, tau, tau_u, res, ripple, u[i], y[i]
        )


def square_wave() -> np.ndarray:
    """One multisine period of the smoothed square wave."""
    half = int(2.5 / T)
    x = np.tile(np.concatenate([np.full(half, 9.6), np.full(half, -9.6)]), 2)
    w = (41 - np.abs(np.arange(-40, 41))) / 41**2
    return sum(wk * np.roll(x, -k) for k, wk in zip(range(-40, 41), w, strict=True))


def peer(runs: int, ripple: bool, noise: bool, tables: dict, robot: axisight.Robot) -> np.ndarray:
    """Mean response over realizations; at most two realizations per thread in memory."""
    rng = np.random.default_rng(0)
    kp, ki = np.array([7.039, 4.005, 3.403]), np.array([178.6, 101.6, 86.33])
    square = square_wave()
    omega = 2 * np.pi * LINES / (N * T)
    tau, tau_u, res = (np.array(t, dtype=float) for t in (TORQUE, TORQUE_U, RESOLVER))
    mean = np.zeros((len(LINES), 3, 3), complex)
    batch, done = numba.get_num_threads(), 0
    while done < runs:
        count = min(batch, runs - done)
        refs = np.empty((count, 3, 2 * N, 3))
        for r in range(count):
            spectrum = np.zeros(N // 2 + 1, complex)
            spectrum[LINES] = np.exp(2j * np.pi * rng.random(len(LINES)))
            broad = np.fft.irfft(spectrum, N)
            broad *= 8.0 / np.abs(broad).max()
            for e in range(3):
                one = np.repeat(square[:, None], 3, axis=1)
                one[:, e] += broad
                refs[r, e] = np.tile(one, (2, 1))
        shape = refs.shape
        noises = rng.standard_normal(shape) * 1.2e-5 if noise else np.zeros(shape)
        u, y = np.empty((count * 3, 3, N)), np.empty((count * 3, 3, N))
        flat = (count * 3, 2 * N, 3)
        keys = ("phi", "g0", "g1", "k1", "k2")
        simulate(
            refs.reshape(flat), noises.reshape(flat), *(tables[k] for k in keys),
            kp, ki, tau, tau_u, res, ripple, u, y,
        )  # fmt: skip
        uf = np.fft.rfft(u, axis=-1)[..., LINES].reshape(count, 3, 3, -1)
        yf = np.fft.rfft(y, axis=-1)[..., LINES].reshape(count, 3, 3, -1)
        # (realization, experiment, axis, line) to (realization, line, axis, experiment).
        uf, yf = uf.transpose(0, 3, 2, 1), yf.transpose(0, 3, 2, 1) * -(omega**2)[:, None, None]
        g = np.linalg.solve(uf.swapaxes(-1, -2), yf.swapaxes(-1, -2)).swapaxes(-1, -2)
        for value in g:
            done += 1
            mean += (value - mean) / done
    return mean


def side_by_side(runs: int, peer_runs: int, threads: int) -> None:
    """Print times and their ratios."""
    numba.set_num_threads(threads)
    robot = axisight.load_robot("irb6600_like")
    tables = matrices(robot)
    peer(1, True, True, tables, robot)  # compile
    omega = 2 * np.pi * LINES / (N * T)
    true = robot.zoh_response(LINES / (N * T)).values * -(omega**2)[:, None, None]
    clean = [
        peer(1, False, False, tables, robot),
        mc.run(study(ripple=False, noise=False), runs=1).arithmetic_mean.values,
    ]
    for name, value in zip(("NumPy/Numba", "axisight"), clean, strict=True):
        error = np.linalg.norm(value - true, axis=(1, 2)) / np.linalg.norm(true, axis=(1, 2))
        print(f"without noise and ripple, {name}: largest relative error {error.max():.1e}")
    start = time.perf_counter()
    ours = mc.run(study(), runs=runs, threads=threads)
    mine = time.perf_counter() - start
    others = {}
    for n in (1, threads):
        numba.set_num_threads(n)
        start = time.perf_counter()
        theirs = peer(peer_runs, True, True, tables, robot)
        others[n] = (time.perf_counter() - start) * runs / peer_runs
    off = np.abs(theirs - ours.arithmetic_mean.values) / (
        ours.standard_error.values * math.sqrt(runs / peer_runs)
    )
    print(f"with them, means differ by {np.sqrt((off**2).mean()):.2f} standard errors (rms)")
    print(f"{runs} realizations x 3 experiments x 20 s (peer timed on {peer_runs}):")
    print(f"  axisight, {threads} threads     {mine:7.2f} s")
    for n, other in others.items():
        print(f"  NumPy/Numba, {n} threads  {other:7.2f} s, ratio {other / mine:5.1f}")


def scaling(counts: list[int], threads: int) -> None:
    """Print time and peak memory of whole studies with a store, each in a process of its own."""
    for runs in counts:
        command = [sys.executable, __file__, "--one", str(runs), "--threads", str(threads)]
        print(subprocess.run(command, check=True, capture_output=True, text=True).stdout, end="")


def one(runs: int, threads: int) -> None:
    """A whole study with a store."""
    with tempfile.TemporaryDirectory() as out:
        start = time.perf_counter()
        mc.run(study(), runs=runs, threads=threads, out=out)
        taken = time.perf_counter() - start
        size = sum(p.stat().st_size for p in Path(out).rglob("*") if p.is_file())
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        f"  {runs:6d} realizations: {taken:8.2f} s, {1e3 * taken / runs:6.2f} ms each, "
        f"peak memory {peak:6.0f} MB, store {size / 1e6:6.0f} MB"
    )


def main() -> None:
    """Compare, then scale."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=250)
    parser.add_argument("--peer-runs", type=int, default=8)
    parser.add_argument("--threads", type=int, default=available_threads())
    parser.add_argument("--scaling", type=int, nargs="*", default=[250, 1000])
    parser.add_argument("--one", type=int)
    options = parser.parse_args()
    if options.one:
        one(options.one, options.threads)
        return
    side_by_side(options.runs, options.peer_runs, options.threads)
    print("with a store:")
    scaling(options.scaling, options.threads)


if __name__ == "__main__":
    main()
