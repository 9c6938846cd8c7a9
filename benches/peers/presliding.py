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
time without restarts. Everyone runs at a relative tolerance of 1e-6; absolute tolerances are
that times the excursion of each state. Errors are relative RMS errors of the worst position
against SciPy's Radau at 1e-9, which is held against CVODE at 1e-10.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
from collections.abc import Callable

import numpy as np
import scipy
import sksundae
from common import loops, setting, smooth
from common.loops import relative_rms
from common.robot_model import Extras, Lugre
from common.timing import cpu, timed

import axisight
from axisight.effects import Effect, effect_table

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
    values = {name: getattr(p, name) for name in Lugre.__dataclass_fields__}
    return [Effect("lugre_friction", axis + 1, values) for axis in range(n_axes)]


def own_rows(s: setting.Setting, p: Lugre, want: np.ndarray, repeats: int) -> list[tuple]:
    """Our implicit methods, if this version of the package has them."""
    if "lugre_friction" not in effect_table():
        print("axisight: no lugre_friction in this version of the package")
        return []
    rows = []
    for method in METHODS:
        options = {
            "effects": effects(p, s.model.n_axes),
            "method": method,
            "tolerance": TOLERANCE,
        }
        try:
            positions, attrs = setting.ours(s, **options)
        except (axisight.InputError, RuntimeError) as error:
            print(f"axisight {method}: {error}")
            continue
        run = lambda o=options: axisight.simulate(s.robot, s.reference, **o)  # noqa: E731
        seconds, _ = timed(run, repeats)
        evaluations = attrs["right_hand_sides"]
        rows.append((f"axisight {method}", relative_rms(positions, want), seconds, evaluations))
    return rows


def peer_row(label: str, run: Callable[[], np.ndarray], want: np.ndarray) -> tuple:
    """Error and time of one peer; a solver that gives up is reported as such."""
    try:
        seconds, out = timed(run)
    except RuntimeError as error:
        print(f"{label}: {error}")
        return (label, float("nan"), float("nan"), None)
    return (label, relative_rms(out, want), seconds, None)


def case(factor: float, args: argparse.Namespace) -> None:
    """Print both readings for one bristle stiffness."""
    p = friction(factor)
    s = setting.make(args.seconds, Extras(lugre=p))
    print(f"\nbristles {p.stiffness_nm_rad:.0e} Nm/rad, damping {p.damping_nm_s_rad:.3g} Nm s/rad")
    want = loops.radau_sampled(s.sampled, REFERENCE)()
    check = loops.cvode_sampled(s.sampled, REFERENCE / 10)()
    print(f"sampled reference, CVODE against Radau: {relative_rms(check, want):.0e}")
    rows = own_rows(s, p, want, args.repeats)
    best = min((r[2] for r in rows), default=float("nan"))
    for label, prepare in (
        ("scikit-sundae CVODE BDF", loops.cvode_sampled),
        ("SciPy Radau", loops.radau_sampled),
    ):
        rows.append(peer_row(f"{label}, sampled", prepare(s.sampled, TOLERANCE), want))
    want = smooth.scipy_ivp("Radau")(s.smooth, REFERENCE)()
    check = smooth.cvode(s.smooth, REFERENCE / 10)()
    print(f"smooth reference, CVODE against Radau: {relative_rms(check, want):.0e}")
    for label, prepare in (
        ("scikit-sundae CVODE BDF", smooth.cvode),
        ("SciPy Radau", smooth.scipy_ivp("Radau")),
    ):
        rows.append(peer_row(f"{label}, smooth", prepare(s.smooth, TOLERANCE), want))
    print(f"{'':34}{'rel. RMS error':>15}{'CPU s':>10}{'peer/ours':>11}")
    for label, error, seconds, _ in rows:
        print(f"{label:34}{error:15.1e}{seconds:10.4f}{seconds / best:11.2f}")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--repeats", type=int, default=3)
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
