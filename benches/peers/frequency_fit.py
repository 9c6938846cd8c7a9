"""Frequency-domain fit side by side, in one process run: this package and SciPy.

Run ``python benches/peers/frequency_fit.py`` from the root of the repository.

Twelve stiffnesses, dampings and motor inertias of the 20-state robot are fitted to responses
at 5 operating points, 391 lines of 3 by 3 elements each, with 5 % of noise, from starts 30 to
50 % off: weighted logarithmic least squares, the same residuals and starts for both.

The peer is ``scipy.optimize.least_squares`` over the logarithms of the parameters, counted
from the start (with ``x_scale="jac"``, or counted from one, its first steps overshoot), with
the same model in NumPy (`common/linear_arm.py`): one batched ``numpy.linalg.solve`` over the
lines of an operating point. *2-point* leaves the Jacobian to SciPy's finite differences,
*analytic* computes it (exact in the response; only the small matrices are differenced). One
thread, CPU time.
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("RAYON_NUM_THREADS", "1")

from importlib import resources

import numpy as np
from common import linear_arm
from common.timing import cpu, timed
from scipy.optimize import least_squares

import axisight
from axisight.frequency_fit import FrequencyFitOptions, MeasuredResponse, fit_responses

POSES = np.array(
    [[0, 0, 0], [0.5, 0.6, -0.4], [0.2, -0.7, 0.5], [-0.4, 0.3, 0.9], [0.1, 0.9, -0.9]]
)
NAMES = (
    "axis1.stiffness",
    "axis1.damping",
    "axis1.motor_inertia",
    "axis2.stiffness",
    "axis2.damping",
    "axis2.motor_inertia",
    "axis2_roll.stiffness",
    "axis2_yaw.stiffness",
    "axis3.stiffness",
    "axis3.damping",
    "axis3_roll.stiffness",
    "axis3_yaw.stiffness",
)
NOISE = 0.05


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lines", type=int, default=391)
    lines = parser.parse_args().lines
    robot = axisight.load_robot("irb6600_like")
    text = (
        resources.files("axisight.robot.presets").joinpath("irb6600_like.toml").read_text("utf-8")
    )
    arm = linear_arm.Arm.read(text)
    f = np.linspace(1.0, 40.0, lines)
    z = np.exp(2j * np.pi * f * robot.sample_time_s)
    scale = -((2 * np.pi * f[:, None, None]) ** 2)

    rng = np.random.default_rng(1)
    truth = [linear_arm.response(arm, pose, z) * scale for pose in POSES]
    ours = [
        -((2 * np.pi * f[:, None, None]) ** 2) * robot.zoh_response(f, pose).values
        for pose in POSES
    ]
    apart = max(float(np.abs(a / b - 1).max()) for a, b in zip(truth, ours, strict=True))
    print(f"{cpu()}; {len(NAMES)} parameters, {len(POSES)} poses x {lines} lines x 3x3")
    print(f"the two models differ by {apart:.1e}\n")

    noisy = []
    for g in truth:
        error = rng.normal(size=(2, *g.shape)) * np.sqrt(0.5)
        noisy.append(g * (1 + NOISE * (error[0] + 1j * error[1])))
    data = [
        MeasuredResponse(tuple(pose), f, g, "acceleration", NOISE**2 * np.abs(g) ** 2)
        for pose, g in zip(POSES, noisy, strict=True)
    ]
    nominal = axisight.robot_parameters(robot)
    factors = np.where(np.arange(len(NAMES)) % 2, 1.5, 0.7)
    start = np.array([nominal[name] for name in NAMES]) * factors

    def values(x: np.ndarray) -> dict[str, float]:
        return dict(zip(NAMES, (start * np.exp(x)).tolist(), strict=True))

    def pack(z: np.ndarray) -> np.ndarray:
        return np.concatenate([z.real.ravel(), z.imag.ravel()]) * (np.sqrt(2) / NOISE)

    def residuals(x: np.ndarray) -> np.ndarray:
        moved = arm.with_values(values(x))
        pairs = zip(POSES, noisy, strict=True)
        return pack(
            np.array([np.log(linear_arm.response(moved, p, z) * scale / g) for p, g in pairs])
        )

    def jacobian(x: np.ndarray) -> np.ndarray:
        moved = arm.with_values(values(x))
        found = [linear_arm.response_and_gradient(moved, values(x), p, z) for p in POSES]
        relative = np.array([d / g for g, d in found])
        return np.array([pack(relative[:, i]) for i in range(len(NAMES))]).T

    options = FrequencyFitOptions(criterion="weighted_log_least_squares", reweightings=0)

    def own():  # type: ignore[no-untyped-def]
        return fit_responses(robot, data, values(np.zeros(len(start))), options=options)

    def peer(jac, tolerance):  # type: ignore[no-untyped-def]
        stop = {"xtol": tolerance, "ftol": tolerance, "gtol": tolerance}
        return least_squares(residuals, np.zeros(len(start)), jac=jac, x_scale=1.0, **stop)

    own_time, fit = timed(own, 7)
    optimum = np.log(fit.values / start)
    print("| | CPU s | model evaluations | furthest from our optimum | peer/ours |")
    print("|---|---|---|---|---|")
    print(f"| axisight fit_responses | {own_time:.4f} | {fit.evaluations} with gradients | | 1 |")
    for name, jac, tolerance in (
        ("2-point, 1e-10", "2-point", 1e-10),
        ("2-point, 1e-8", "2-point", 1e-8),
        ("analytic, 1e-10", jacobian, 1e-10),
        ("analytic, 1e-8", jacobian, 1e-8),
    ):
        seconds, found = timed(lambda jac=jac, tolerance=tolerance: peer(jac, tolerance))
        count = f"{found.nfev} and {found.njev} Jacobians"
        away = float(np.abs(np.expm1(found.x - optimum)).max())
        row = f"| SciPy, {name} | {seconds:.2f} | {count} | {away:.1e} | {seconds / own_time:.0f} |"
        print(row, flush=True)


if __name__ == "__main__":
    main()
