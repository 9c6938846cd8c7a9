"""Where the time of an identification goes: one run of each method, profiled on one thread.

Prints for each method the time, the share in compiled code (this package's core, NumPy, SciPy and built-in functions),
and the Python function of this package with the largest time of its own. Array arithmetic written in a function counts
as its own time.

Run: OPENBLAS_NUM_THREADS=1 python benches/room_profiles.py [METHOD...]
"""

from __future__ import annotations

import cProfile
import pstats
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scipy.signal

import axisight
from axisight import blackbox, excitation, frf, graybox, identifiability, rigid_body
from axisight.calibration import Positions, calibrate, nominal_geometry
from axisight.frequency_fit import model_response
from axisight.records import ArbitraryRecords
from axisight.records.experiment import Experiment

Run = Callable[[], Any]
STEP_S = 1e-3
PACKAGE = str(Path(axisight.__file__).parent)


def experiment(samples: int = 20_000) -> Experiment:
    """Return two outputs of a lightly damped system under white noise."""
    rng = np.random.default_rng(0)
    u = rng.normal(size=(samples, 2))
    y = np.zeros_like(u)
    for i in range(2):
        for j in range(2):
            pole = 0.97 * np.exp(0.3j * (1 + i + j))
            system = np.poly([pole, pole.conj()]).real
            y[:, i] += scipy.signal.lfilter([0.0, 0.3, 0.1 * (i + j)], system, u[:, j])
    return Experiment(STEP_S, u, y + 0.05 * rng.normal(size=y.shape))


def response() -> Any:
    """Return the response of the two-mass axis with a relative noise of 1 %."""
    robot = axisight.load_robot("two_mass_axis").with_effects([])
    lines_hz = np.arange(1.0, 40.0, 0.1)
    g = model_response(robot, lines_hz, robot.operating_point, quantity="acceleration").values
    rng = np.random.default_rng(1)
    noise = rng.normal(size=(*g.shape, 2)) @ [1, 1j] / np.sqrt(2)
    return frf.frequency_response(
        lines_hz,
        g * (1 + 0.01 * noise),
        estimator="model",
        variance=(0.01 * abs(g)) ** 2,
        output_unit="rad/s^2",
    )


def arm_motion(samples: int = 20_000) -> tuple[rigid_body.TorqueModel, tuple[Any, ...], Any]:
    """Return a torque model of the three-axis arm, a motion and its torques."""
    robot = axisight.load_robot("irb6600_like")
    model = rigid_body.TorqueModel(robot, terms=rigid_body.USUAL_TERMS, side="motor")
    t = np.arange(samples)[:, None] * 5e-3
    omega = 2 * np.pi * np.array([0.11, 0.17, 0.23])
    joints = [np.zeros((samples, robot.n_joints)) for _ in range(3)]
    for k, (joint, wave) in enumerate(
        zip(joints, (np.sin, np.cos, lambda x: -np.sin(x)), strict=True)
    ):
        joint[:, robot.axis_joints] = sum(
            0.3 / h * (h * omega) ** k * wave(h * omega * t) for h in (1, 3, 7)
        )
    rng = np.random.default_rng(2)
    torque = model.matrix(*joints) @ model.nominal
    return model, tuple(joints), torque + 0.2 * rng.normal(size=torque.shape)


def calibration_run() -> Run:
    """Return the calibration of a three-axis arm from 200 positions."""
    robot = axisight.load_robot("cobot_like")
    geometry = nominal_geometry(robot, tool_position_m=(0.2, 0.05, 0.1))
    rng = np.random.default_rng(3)
    q = rng.uniform(-1.2, 1.2, (200, 6))
    position = geometry.tool_location(q, np.zeros_like(q))[1]
    noisy = position + 1e-4 * rng.normal(size=position.shape)
    return lambda: calibrate(robot, Positions(q, noisy), nominal=geometry)


def runs() -> dict[str, Callable[[], Run]]:
    """Return by method what prepares its run."""

    def local(method: Callable[..., Any]) -> Callable[[], Run]:
        def prepare() -> Run:
            data = experiment()
            records = ArbitraryRecords(STEP_S, data.input[None], data.output[None])
            return lambda: method(records, threads=1)

        return prepare

    def black_box(method: Callable[..., Any], **options: Any) -> Callable[[], Run]:
        def prepare() -> Run:
            data = experiment()
            return lambda: method(data, **options)

        return prepare

    def rational() -> Run:
        data = response()
        return lambda: blackbox.fit_rational(data, 6)

    def chain() -> Run:
        data = response()
        return lambda: graybox.fit_chain(data, 2, gear_ratio=1 / 224.3)

    def consistent() -> Run:
        model, motion, torque = arm_motion()
        return lambda: rigid_body.identify_consistent(model, *motion, torque, threads=1)

    def regression() -> Run:
        model, motion, torque = arm_motion()
        return lambda: rigid_body.identify_rigid_body(
            model, *motion, torque, deficient="group", threads=1
        )

    def trajectory() -> Run:
        model, _, _ = arm_motion(10)
        limits = rigid_body.MotionLimits(np.tile([-0.5, 0.5], (3, 1)), 1.0, 3.0)
        return lambda: rigid_body.optimize_trajectory(
            model, limits, fundamental_hz=0.1, starts=1, max_iterations=30
        )

    def optimal() -> Run:
        robot = axisight.load_robot("irb6600_like")
        flat = excitation.multisine(10.0, robot.sample_time_s, band_hz=(1, 40)).scaled(rms=4.0)
        return lambda: excitation.optimal_spectrum(robot, flat, "axis1.stiffness")

    def planned() -> Run:
        robot = axisight.load_robot("irb6600_like")
        names = [f"axis{i}.stiffness" for i in (1, 2, 3)]
        parameters = [axisight.robot_parameter(robot, name) for name in names]
        signal = excitation.multisine(1.0, robot.sample_time_s, band_hz=(1, 40)).scaled(peak=5.0)
        reference = np.tile(signal.period[:, None], (2, 3))
        return lambda: identifiability.identifiability(
            identifiability.of_simulation(robot, reference, parameters, torque_std_nm=2.0)
        )

    return {
        "subspace": black_box(blackbox.state_space, order=8),
        "ARX": black_box(blackbox.arx, na=4, nb=4),
        "output error": black_box(blackbox.output_error, nf=2, nb=3),
        "orders of ARX": black_box(blackbox.arx_orders, na=range(1, 9), nb=range(1, 9)),
        "ARMAX": black_box(blackbox.armax, na=4, nb=4, nc=2),
        "state space by prediction errors": black_box(blackbox.state_space_pem, order=8),
        "vector fitting": rational,
        "local polynomial": local(frf.local_polynomial),
        "local rational": local(frf.local_rational),
        "calibration": calibration_run,
        "trajectory": trajectory,
        "regression": regression,
        "consistent bodies": consistent,
        "chain of masses": chain,
        "identifiability": planned,
        "optimal spectrum": optimal,
    }


def profile(name: str, run: Run) -> str:
    """Return a row: method, time, compiled share, largest Python function and its share."""
    run()  # imports and caches
    profiler = cProfile.Profile()
    profiler.runcall(run)
    stats = pstats.Stats(profiler).stats  # type: ignore[attr-defined]
    own = {key: value[2] for key, value in stats.items()}
    total = sum(own.values())
    python = {key: seconds for key, seconds in own.items() if key[0].startswith(PACKAGE)}
    (path, _, function), most = max(python.items(), key=lambda item: item[1])
    where = f"{Path(path).relative_to(PACKAGE).with_suffix('')}.{function}"
    compiled = 1 - sum(python.values()) / total
    return f"| {name} | {total:.2f} | {compiled:.0%} | `{where}` | {most / total:.0%} |"


def main() -> None:
    """Print the table."""
    wanted = sys.argv[1:]
    print("| method | time (s) | elsewhere | largest function in Python | its share |")
    print("|---|---|---|---|---|")
    for name, prepare in runs().items():
        if not wanted or name in wanted:
            print(profile(name, prepare()), flush=True)


if __name__ == "__main__":
    main()
