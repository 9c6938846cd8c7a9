"""Columns whose names say nothing: derivatives show which are positions, and what is as likely stays open."""

import numpy as np
import pytest

from axisight.errors import LogError
from axisight.logs import load_column_map, read_log
from axisight.logs.guessing import guess_columns
from axisight.logs.sources import load_arrays
from columns_data import DEG, GEAR, motion, robot, write_csv
from logs_data import write

N = 3
NAMES = "abcdefghjk"


def columns(order: int = 0, *, velocity: float = 1.0, noise: float = 0.0) -> dict:
    """Position, velocity and torque of three axes under letters, in an order that a number draws."""
    run = motion(N)
    random = np.random.default_rng(order)
    signals = [run["position"][:, k] for k in range(N)]
    signals += [run["velocity"][:, k] * velocity for k in range(N)]
    signals += [run["torque"][:, k] for k in range(N)]
    signals = [s + noise * np.std(s) * random.normal(size=s.size) for s in signals]
    places = random.permutation(len(signals))
    return {NAMES[k]: signals[place] for k, place in enumerate(places)} | {"t": run["time"]}


@pytest.mark.parametrize("order", range(6))
@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_derivatives_show_positions_and_velocities(tmp_path, order, noise):
    """Of noise of a thousandth 0.16 is below 20 Hz, whose derivative is 29 times it: two hundredths of the slowest."""
    made = columns(order, velocity=DEG, noise=noise)
    path = write_csv(tmp_path / "a.csv", made)
    found = guess_columns(path, robot(N))
    run = motion(N)
    pairs = {}
    for axis in found.columns.axis:
        values = made[axis.position.name]
        off = [np.abs(values - run["position"][:, k]).max() for k in range(N)]
        pairs[int(np.argmin(off))] = (axis.position.name, axis.velocity.name)
        assert min(off) < 0.01
        speed = made[axis.velocity.name] / DEG - run["velocity"][:, int(np.argmin(off))]
        assert np.abs(speed).max() < 0.02
        # A factor of 57.3 is of one pair of units alone: the unit is certain.
        assert (axis.position.unit, axis.velocity.unit) == ("rad", "deg/s")
        assert axis.torque is None
    assert sorted(pairs) == list(range(N))
    assert found.text.count("# proposed, check: no name says so") == 2 * N
    for position, velocity in pairs.values():
        said = f"position: {position}, for its derivative goes with {velocity} (correlation 0.99"
        ones = f"position: {position}, for its derivative goes with {velocity} (correlation 1.0"
        assert any(doubt.startswith((said, ones)) for doubt in found.doubts)
    (tmp_path / "columns.toml").write_text(found.text)
    assert load_column_map(tmp_path / "columns.toml") == found.columns


def test_a_map_by_numbers_is_read(tmp_path):
    """With the torques that a person adds."""
    run = motion(1)
    made = {"a": run["torque"][:, 0], "b": run["velocity"][:, 0], "c": run["position"][:, 0]}
    path = write_csv(tmp_path / "a.csv", made | {"d": run["time"]})
    found = guess_columns(path, robot(1))
    assert any(doubt.startswith("time: d, for it alone goes on") for doubt in found.doubts)
    text = found.text.replace("[[axis]]", '[[axis]]\ntorque = { name = "a", unit = "Nm" }')
    (tmp_path / "columns.toml").write_text(text)
    log = read_log(path, tmp_path / "columns.toml", robot=robot(1))
    np.testing.assert_allclose(log.position_rad, run["position"] / GEAR, atol=1e-4)
    np.testing.assert_allclose(log.velocity_rad_s, run["velocity"] / GEAR, atol=1e-2)


def test_an_acceleration_is_no_velocity(tmp_path):
    run = motion(1)
    made = {"t": run["time"], "a": run["position"][:, 0], "b": run["velocity"][:, 0]}
    made["c"] = np.gradient(made["b"], made["t"])
    found = guess_columns(write_csv(tmp_path / "a.csv", made))
    (axis,) = found.columns.axis
    assert (axis.position.name, axis.velocity.name) == ("a", "b")
    assert found.unused["c"] == "goes with the derivative of b: an acceleration, or a torque"


def test_what_is_as_likely_is_not_guessed(tmp_path):
    run = motion(1)
    made = {"t": run["time"], "a": run["position"][:, 0], "b": run["velocity"][:, 0]}
    twice = made | {"c": made["a"] * 1.1 + 0.2}
    with pytest.raises(
        LogError, match=r"goes with b, got a or c, which are as likely; columns: t, a"
    ):
        guess_columns(write_csv(tmp_path / "a.csv", twice))
    # Of two velocities the position is clear, and neither velocity is.
    found = guess_columns(write_csv(tmp_path / "b.csv", made | {"c": made["b"] * 1.1}))
    (axis,) = found.columns.axis
    assert axis.position.name == "a"
    assert axis.velocity is None
    assert any("goes with b or c, of which none is clearly the" in doubt for doubt in found.doubts)


@pytest.mark.parametrize(
    "other",
    [
        # Without a time, with one that only numbers samples, and with two that could be it.
        {},
        {"n": np.arange(1500.0)},
        {"n": 0.004 * np.arange(1500.0), "m": 0.008 * np.arange(1500.0)},
    ],
)
def test_without_a_time_nothing_is_derived(tmp_path, other):
    run = motion(1)
    made = other | {"a": run["position"][:, 0], "b": run["velocity"][:, 0]}
    with pytest.raises(LogError, match="position: expected columns whose names say so"):
        guess_columns(write_csv(tmp_path / "a.csv", made))


def test_names_come_first(tmp_path):
    """Where one says a position, nothing is taken by numbers."""
    run = motion(2)
    made = {"t": run["time"], "q": run["position"][:, 0]}
    made |= {"a": run["position"][:, 1], "b": run["velocity"][:, 1]}
    found = guess_columns(write_csv(tmp_path / "a.csv", made))
    assert [axis.position.name for axis in found.columns.axis] == ["q"]
    assert "proposed, check" not in found.text


@pytest.mark.parametrize("run", ["A", "B", "C"])
def test_a_measured_robot_without_names(shared_data, tmp_path, run):
    """Six axes of a KR 300: positions, speeds and torques of its motors under letters."""
    arrays = load_arrays(shared_data / "kuka_kr300" / run / "data.mat")
    fields = ("rec.act_torque_abs_nm", "rec.act_vel_mot_deg_per_s", "rec.act_pos_mot_deg")
    made = {"t": arrays["rec.time_cont"]}
    truth = {}
    for field in fields:
        for k in range(6):
            letter = "abcdefghjklmnopruxyz"[len(truth)]
            truth[letter] = (field, k)
            made[letter] = arrays[field][k]
    found = guess_columns(write(tmp_path / "a.npz", made))
    got = [(truth[a.position.name], truth[a.velocity.name]) for a in found.columns.axis]
    assert got == [((fields[2], k), (fields[1], k)) for k in range(6)]
