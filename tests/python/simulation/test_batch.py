"""Batches: the same bits as each run alone, whatever the threads, the neighbours and the place."""

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import axisight
from axisight import Effect, InputError, Robot, _core, load_robot
from axisight.simulation import sensor_noise

Array = NDArray[np.float64]
ARM = load_robot("irb6600_like")
N, RUNS = 60, 17
# Eight go in lock-step: one, some, a full group, one more, two full and one.
SIZES = (1, 5, 8, 9, 17)
SAME_BITS = [("nonlinear", "rk4"), ("nonlinear", "rkn4"), ("linear", "dopri5"), ("linear", "rk4")]
SIGNALS = (
    "torque_cmd_nm",
    "position_rad",
    "motor_position_rad",
    "joint_position_rad",
    "torque_disturbance_nm",
    "position_disturbance_rad",
)
RIPPLE = [
    Effect(
        "torque_ripple", 1, {"order_1": 36.0, "sine_1_nm": 0.11, "order_u": 18.0, "sine_u": 0.04}
    ),
    Effect("resolver_ripple", 2, {"order_1": 12.0, "sine_1_rad": 2e-4}),
    Effect("input_delay", 3, {"delay_s": 7e-4}),
]


def references(runs: int = RUNS, n: int = N) -> Array:
    """Every run and axis at its own frequency and size."""
    run, axis = np.arange(runs)[:, None, None], np.arange(3)
    t = np.arange(n)[:, None] * ARM.sample_time_s
    return (4 + 0.5 * run) * np.sin(2 * np.pi * (5 + run + 3 * axis) * t)


def assert_same_bits(batch: xr.Dataset, alone: list[xr.Dataset]) -> None:
    assert batch.sizes["run"] == len(alone)
    for i, one in enumerate(alone):
        for name in SIGNALS:
            assert np.array_equal(batch[name].values[i], one[name].values), (i, name)


@pytest.fixture(scope="module")
def alone() -> dict[tuple[str, str], list[xr.Dataset]]:
    return {
        (model, method): [
            axisight.simulate(ARM, r, effects=RIPPLE, model=model, method=method, substeps=2)
            for r in references()
        ]
        for model, method in [*SAME_BITS, ("nonlinear", "dopri5")]
    }


def test_runs_differ(alone: dict[tuple[str, str], list[xr.Dataset]]) -> None:
    """So that equal bits mean something: no two runs, and no two ways to compute them, do."""
    for runs in alone.values():
        assert len({run["torque_cmd_nm"].values.tobytes() for run in runs}) == RUNS
    first = [runs[0]["torque_cmd_nm"].values.tobytes() for runs in alone.values()]
    assert len(set(first)) == len(first)


@pytest.mark.parametrize(
    ("model", "method"),
    [*SAME_BITS, ("nonlinear", "dopri5"), ("nonlinear", "radau5"), ("nonlinear", "auto")],
)
def test_threads_do_not_matter(model: str, method: str) -> None:
    runs = [
        axisight.simulate_batch(
            ARM,
            references(),
            effects=RIPPLE,
            noise_seed=3,
            model=model,
            method=method,
            threads=threads,
        )
        for threads in (1, 2, 3, 0)
    ]
    assert (runs[0]["status"] == "completed").all()
    for run in runs[1:]:
        assert run.identical(runs[0])


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize(("model", "method"), SAME_BITS)
def test_fixed_steps_give_the_bits_of_the_run_alone(
    model: str, method: str, size: int, alone: dict[tuple[str, str], list[xr.Dataset]]
) -> None:
    options = {"effects": RIPPLE, "model": model, "method": method, "substeps": 2, "threads": 1}
    batch = axisight.simulate_batch(ARM, references()[:size], **options)
    assert_same_bits(batch, alone[model, method][:size])
    # At any place: turned by three and back to front.
    order = np.roll(np.arange(size), 3)[::-1]
    turned = axisight.simulate_batch(ARM, references()[order], **options)
    assert_same_bits(turned, [alone[model, method][i] for i in order])


def test_error_control_keeps_a_run_within_the_tolerance(
    alone: dict[tuple[str, str], list[xr.Dataset]],
) -> None:
    """Steps differ, each wrong in speed by its share: kp makes a torque of that.

    A motor on its controller forgets it over J / (kp T) = 3.5 samples; as much again for
    the two sides.
    """
    tolerance, speed = 1e-7, 12.0
    batch = axisight.simulate_batch(ARM, references(), effects=RIPPLE, tolerance=tolerance)
    bound = tolerance * speed * 2 * 0.0121 / ARM.sample_time_s
    single = alone["nonlinear", "dopri5"]
    off = [
        batch["torque_cmd_nm"].values[i] - one["torque_cmd_nm"].values
        for i, one in enumerate(single)
    ]
    assert np.abs(off).max() < bound
    # A group takes the steps of its most demanding run, each run all of them.
    for group in (slice(0, 8), slice(8, 16)):
        cost = batch["right_hand_sides"].values[group]
        assert len(set(cost.tolist())) == 1
        assert cost[0] >= max(one.attrs["right_hand_sides"] for one in single[group])
    assert batch["right_hand_sides"].values[16] == single[16].attrs["right_hand_sides"]


@pytest.mark.parametrize("method", ["radau5", "rodas4", "auto"])
def test_implicit_methods_take_runs_one_by_one(method: str) -> None:
    effects = [
        Effect(
            "presliding_friction",
            1,
            {"coulomb_nm": 0.5, "presliding_rad": 1e-5, "bristle_time_s": 1e-5},
        ),
        *RIPPLE,
    ]
    options = {"effects": effects, "method": method, "tolerance": 1e-5, "noise_seed": 2}
    batch = axisight.simulate_batch(ARM, references(9, 30), **options)
    runs = [axisight.simulate(ARM, r, run=i, **options) for i, r in enumerate(references(9, 30))]
    assert_same_bits(batch, runs)
    cost = [run.attrs["right_hand_sides"] for run in runs]
    assert batch["right_hand_sides"].values.tolist() == cost
    assert len(set(cost)) > 1


@pytest.mark.parametrize("cutoff_hz", [None, 80.0])
@pytest.mark.parametrize(("model", "method"), SAME_BITS[:2])
def test_noise_of_a_run_is_that_of_its_number(
    model: str, method: str, cutoff_hz: float | None
) -> None:
    options = {"noise_seed": 5, "noise_cutoff_hz": cutoff_hz, "model": model, "method": method}
    batch = axisight.simulate_batch(ARM, references(10), first_run=40, **options)
    runs = [axisight.simulate(ARM, r, run=40 + i, **options) for i, r in enumerate(references(10))]
    assert_same_bits(batch, runs)
    assert batch["run"].values.tolist() == list(range(40, 50))
    for i in (0, 9):
        noise = sensor_noise(ARM, 5, 40 + i, N, cutoff_hz)
        assert np.array_equal(batch["position_disturbance_rad"].values[i], noise)
    given = axisight.simulate_batch(
        ARM,
        references(10),
        noise=np.stack([sensor_noise(ARM, 5, 40 + i, N, cutoff_hz) for i in range(10)]),
        model=model,
        method=method,
    )
    assert np.array_equal(given["torque_cmd_nm"], batch["torque_cmd_nm"])


@pytest.mark.parametrize(("model", "method"), SAME_BITS[:2])
def test_torque_driven_batches_with_start_and_resolution(model: str, method: str) -> None:
    start = (0.2, -0.1, 0.3)
    options = {"start_rad": start, "model": model, "method": method}
    options |= {"position_resolution_rad": 1e-4, "effects": RIPPLE}
    torque = ARM.equilibrium(start)["motor_torque_nm"].values + references(9) / 10
    batch = axisight.simulate_batch(ARM, torque_nm=torque, **options)
    assert_same_bits(batch, [axisight.simulate(ARM, torque_nm=t, **options) for t in torque])
    assert np.array_equal(batch["torque_cmd_nm"], torque)
    steps = batch["position_rad"].values / 1e-4
    assert np.abs(steps - np.round(steps)).max() < 1e-8


@pytest.mark.parametrize("bad", [0, 3, 7, 8, 16])
@pytest.mark.parametrize(("model", "method"), [("nonlinear", "rk4"), ("nonlinear", "dopri5")])
def test_a_failed_run_is_blank_from_there_on_and_spoils_no_neighbour(
    model: str, method: str, bad: int, alone: dict[tuple[str, str], list[xr.Dataset]]
) -> None:
    inputs = references()
    # Speeds whose products overflow, from sample 20 on.
    inputs[bad, 20:] = 1e200
    options = {"effects": RIPPLE, "model": model, "method": method, "substeps": 2}
    batch = axisight.simulate_batch(ARM, inputs, **options)
    failed = axisight.simulate(ARM, inputs[bad], **options)
    stop = failed.attrs["stopped_at"]
    assert failed.attrs["status"] in ("diverged", "step_size_collapsed")
    assert 20 <= stop < 30
    assert failed.sizes["time"] == stop + 1
    assert batch["status"].values[bad] == failed.attrs["status"]
    assert batch["stopped_at"].values[bad] == stop
    for name in SIGNALS:
        got = batch[name].values[bad]
        assert np.array_equal(got[: stop + 1], failed[name].values)
        assert np.isnan(got[stop + 1 :]).all()
    others = [i for i in range(RUNS) if i != bad]
    assert (batch["status"].values[others] == "completed").all()
    assert (batch["stopped_at"].values[others] == -1).all()
    assert not np.isnan(batch["torque_cmd_nm"].values[others]).any()
    if method == "rk4":
        without = axisight.simulate_batch(ARM, references()[others], **options)
        for name in SIGNALS:
            assert np.array_equal(batch[name].values[others], without[name].values)
    else:
        # Runs of its group were done again, each alone.
        group = [i for i in others if i // 8 == bad // 8]
        for i in group:
            want = alone[model, method][i]["torque_cmd_nm"].values
            assert np.array_equal(batch["torque_cmd_nm"].values[i], want)


def test_an_unstable_loop_diverges_in_every_run_at_its_own_sample() -> None:
    text = ARM.toml
    assert "kp = [7.039" in text
    robot = Robot(_core.Robot.from_toml(text.replace("kp = [7.039", "kp = [-7.039")))
    scale = np.array([1e-6, 1e-3, 1.0])[:, None, None]
    batch = axisight.simulate_batch(robot, scale * references(3, 400), method="rk4")
    assert (batch["status"] == "diverged").all()
    stops = batch["stopped_at"].values
    # Growth is exponential: a smaller start takes longer.
    assert stops[0] > stops[1] > stops[2] > 0
    for i, stop in enumerate(stops):
        assert np.isfinite(batch["torque_cmd_nm"].values[i, : stop + 1]).all()
        assert np.isnan(batch["torque_cmd_nm"].values[i, stop + 1 :]).all()


def test_two_masses_take_inputs_without_axes() -> None:
    robot = load_robot("two_mass_axis")
    flat = references(5)[..., 0]
    options = {"method": "rk4", "noise": np.full_like(flat, 1e-5)}
    batch = axisight.simulate_batch(robot, flat, **options)
    full = {"method": "rk4", "noise": np.full((5, N, 1), 1e-5)}
    assert batch.identical(axisight.simulate_batch(robot, flat[..., None], **full))
    assert_same_bits(
        batch, [axisight.simulate(robot, r, method="rk4", noise=np.full(N, 1e-5)) for r in flat]
    )


def test_misuse_names_the_field() -> None:
    good = references(2)

    def refused(match: str, *args: object, **options: object) -> None:
        with pytest.raises(InputError, match=match):
            axisight.simulate_batch(ARM, *args, **options)

    refused(r"velocity_ref_rad_s.*n_runs.*different lengths", [good[0], good[1][:-1]])
    refused(r"velocity_ref_rad_s.*n_runs.*\(60, 3\)", good[0])
    refused(r"torque_nm.*\(2, 60, 2\)", torque_nm=good[..., :2])
    refused(r"velocity_ref_rad_s.*at least one.*\(0, 60, 3\)", good[:0])
    refused(r"velocity_ref_rad_s.*at least one.*\(2, 0, 3\)", good[:, :0])
    refused("velocity_ref_rad_s.*real numbers.*complex", good * 1j)
    refused("exactly one", good, torque_nm=good)
    refused("exactly one")
    refused(r"noise: expected the shape.*\(2, 60, 3\).*\(1, 60, 3\)", good, noise=good[:1])
    refused(r"noise.*n_runs.*\(60, 3\)", good, noise=good[0])
    refused("noise, noise_seed", good, noise=good, noise_seed=1)
    refused("noise_cutoff_hz.*noise_seed", good, noise_cutoff_hz=10.0)
    refused("threads.*-1", good, threads=-1)
    refused("run: .*-1", good, noise_seed=1, first_run=-1)
    refused("seed: .*-1", good, noise_seed=-1)
    refused("start_rad.*3 finite", good, start_rad=[0.0])
    bad = good.copy()
    bad[1, 7, 2] = np.nan
    refused("velocity_ref.*finite.*NaN at sample 7", bad)
    refused("noise.*finite.*NaN at sample 7", good, noise=bad)
