"""LuGre friction with very stiff bristles in the nonlinear loop: this package, SUNDIALS, SciPy.

Run ``python benches/peers/presliding.py`` from the root of the repository.

Each of the three motors of the 20-state robot gets LuGre friction with a state z of its own,

    z' = w - sigma_0 |w| z / g(w),   g(w) = F_c + (F_s - F_c) exp(-(w / v_s)^2),
    torque = -(sigma_0 z + sigma_1 z'),

with F_c 0.5 Nm, F_s 0.8 Nm, v_s 1 rad/s (sigma_2 w is the motor's viscous friction already).
In sliding, z settles at the rate sigma_0 |w| / g. *Smooth*: sigma_0 = 50 Nm/rad makes that
1e3 1/s at 10 rad/s, as fast as the fastest structural mode. *Stiff*: 1e5 times that,
5e6 Nm/rad; break-away then comes after 1.6e-7 rad of motor angle, the rate in sliding is
1e8 1/s, and a sticking motor oscillates on its
bristles at 2e4 rad/s. sigma_1 damps that oscillation critically, 2 sqrt(sigma_0 J).

Both peers get the compiled model and a compiled Jacobian. *Sampled* and *smooth loop* are as
in ``nonlinear_loop.py``: with a restart at every sample, and the controller in continuous
time without restarts. Everyone runs at a relative tolerance of 1e-6, and again at the loosest that
keeps the relative RMS error of the worst position at 1e-6, as the same tolerance buys very
different accuracies. Absolute tolerances are the relative ones times the excursion of each
state. Ratios are to our fastest run that is accurate enough. Errors are relative RMS errors of the worst position
against SciPy's Radau at 1e-9, which is held against CVODE at 1e-10.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse

import numpy as np
import scipy
import sksundae
from common import diffsol_runs, loops, setting, smooth
from common.loops import relative_rms
from common.robot_model import Extras, Lugre
from common.scan import RTOL, Row, fixed, loosest, peer, print_rows
from common.timing import cpu, timed

import axisight
from axisight.effects import Effect

SMOOTH_STIFFNESS = 50.0
FACTOR = 1e5
TOLERANCE = 1e-6
REFERENCE = 1e-9
MOTOR_INERTIA = 0.0121
METHODS = ("radau5", "rodas4")


def friction(factor: float) -> Lugre:
    """LuGre friction with bristles ``factor`` times as stiff as in the smooth case."""
    stiffness = SMOOTH_STIFFNESS * factor
    damping = 2 * np.sqrt(stiffness * MOTOR_INERTIA)
    return Lugre(stiffness, float(damping), 0.5, 0.8, 1.0)


def effects(p: Lugre, n_axes: int) -> list[Effect]:
    """The same friction as effects of the package."""
    values = {
        "coulomb_nm": p.coulomb_nm,
        "static_ratio": p.static_nm / p.coulomb_nm,
        "stribeck_speed_rad_s": p.stribeck_speed_rad_s,
        "presliding_rad": p.coulomb_nm / p.stiffness_nm_rad,
        "bristle_time_s": p.damping_nm_s_rad / p.stiffness_nm_rad,
    }
    return [Effect("presliding_friction", axis + 1, values) for axis in range(n_axes)]


def own_rows(s: setting.Setting, p: Lugre, want: np.ndarray, args: argparse.Namespace) -> list:
    """Our implicit methods at the fixed tolerance and at equal accuracy, if present."""
    rows = []
    for method in METHODS:
        options = {"effects": effects(p, s.model.n_axes), "method": method}

        def error(rtol: float, options: dict = options) -> float:
            return relative_rms(setting.ours(s, tolerance=rtol, **options)[0], want)

        try:
            tolerances = {TOLERANCE, loosest(error, RTOL, args.wanted)}
        except (axisight.InputError, RuntimeError) as failure:
            print(f"axisight {method}: {failure}")
            continue
        for rtol in sorted(tolerances, reverse=True):
            run = lambda o=options, r=rtol: axisight.simulate(  # noqa: E731
                s.robot, s.reference, tolerance=r, **o
            )
            seconds, _ = timed(run, args.repeats)
            rows.append(Row(f"axisight {method}", f"rtol {rtol:.0e}", error(rtol), seconds))
    return rows


def peer_rows(prepares: dict, task: loops.Task, want: np.ndarray, args: argparse.Namespace) -> list:
    """Each peer at the fixed tolerance and at equal accuracy; one that gives up says so."""
    rows = []
    for label, prepare in prepares.items():
        try:
            rows.append(fixed(label, prepare, task, want, TOLERANCE))
            equal = peer(label, prepare, task, want, args.wanted, args.scan_seconds)
            if equal.settings != rows[-1].settings:
                rows.append(equal)
        except (RuntimeError, ValueError) as failure:
            print(f"{label}: {str(failure)[:100]}")
    return rows


def case(factor: float, args: argparse.Namespace) -> None:
    """Print both readings for one bristle stiffness."""
    p = friction(factor)
    extras = Extras(lugre=p)
    s = setting.make(args.seconds, extras)
    print(f"\nbristles {p.stiffness_nm_rad:.0e} Nm/rad, damping {p.damping_nm_s_rad:.3g} Nm s/rad")
    want = loops.radau_sampled(s.sampled, REFERENCE)()
    check = loops.cvode_sampled(s.sampled, REFERENCE / 10)()
    print(f"sampled reference, CVODE against Radau: {relative_rms(check, want):.0e}")
    own = own_rows(s, p, want, args)
    best = min((r for r in own if r.error <= args.wanted), key=lambda r: r.seconds, default=None)
    peers = {
        "scikit-sundae CVODE BDF": loops.cvode_sampled,
        "SciPy Radau": loops.radau_sampled,
    }
    rows = peer_rows(peers, s.sampled, want, args)
    print_rows("sampled: restart at every sample", own + rows, best)

    want = smooth.scipy_ivp("Radau")(s.smooth, REFERENCE)()
    check = smooth.cvode(s.smooth, REFERENCE / 10)()
    print(f"\nsmooth reference, CVODE against Radau: {relative_rms(check, want):.0e}")
    peers = {
        "scikit-sundae CVODE BDF": smooth.cvode,
        "SciPy Radau": smooth.scipy_ivp("Radau"),
    }
    if args.diffsol:
        whole = diffsol_runs.Smooth(s.model, s.tones, s.feed_forward, s.smooth, "bdf", extras)
        peers["pydiffsol bdf"] = whole.prepare
    rows = peer_rows(peers, s.smooth, want, args)
    print_rows("smooth: no restarts, ours sampled", own + rows, best)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--wanted", type=float, default=1e-6)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--scan-seconds", type=float, default=0.5, help="part for the first scan")
    parser.add_argument("--diffsol", action="store_true", help="add pydiffsol's bdf")
    args = parser.parse_args()
    print(cpu())
    print(
        f"SciPy {scipy.__version__}, scikit-sundae {sksundae.__version__},"
        f" one thread, {args.seconds:g} s at 2 kHz, tolerance {TOLERANCE:.0e}"
    )
    for factor in (1.0, FACTOR):
        case(factor, args)


if __name__ == "__main__":
    main()
