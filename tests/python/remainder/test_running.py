"""A remainder in a simulation and in a file: the same torque as along a whole motion."""

from pathlib import Path

import numpy as np
import pytest
from remainder_data import motion, records

from axisight.errors import InputError
from axisight.remainder import (
    Motion,
    Remainder,
    RunningRemainder,
    Term,
    fit_remainder,
    last_way,
    load_remainder,
    save_remainder,
)


def term(**changes: object) -> Term:
    given: dict[str, object] = {
        "axis": 1,
        "acts": "way",
        "variable": "travel",
        "of_axis": 1,
        "x": np.array([0.0, 0.5, 2.0]),
        "value": np.array([0.0, 1.0, 3.0]),
        "standard_error": np.full(3, 0.1),
        "corner_rad_s": 0.05,
        "gain": 0.5,
        "significance": 5.0,
    }
    return Term(**{**given, **changes})  # type: ignore[arg-type]


@pytest.fixture
def remainder() -> Remainder:
    terms = (
        term(),
        term(acts="direction", variable="speed", of_axis=2, x=np.array([-3.0, 0.0, 3.0])),
        term(axis=2, acts="load", variable="angle", of_axis=2, period=1.7),
    )
    return Remainder(terms, np.array([5.0, 4.0]), np.array([0.1, 0.1]))


def test_travel_is_that_since_the_last_reversal() -> None:
    up, down = np.linspace(0, 1, 101), np.linspace(1, 0.4, 61)
    position = np.concatenate([up, down[1:]])[:, None]
    zero = np.zeros_like(position)
    at = Motion(
        name="to and fro",
        time_s=np.linspace(0.0, 1.6, len(position)),
        position_rad=position,
        velocity_rad_s=zero,
        acceleration_rad_s2=zero,
        load_nm=zero,
    )
    expected = np.concatenate([up, 1 - down[1:]])
    np.testing.assert_allclose(at.travel_rad[:, 0], expected, atol=1e-12)
    np.testing.assert_array_equal(at.way[:, 0], np.where(np.arange(len(position)) <= 100, 1, -1))


def test_moment_by_moment_is_the_whole_motion(remainder: Remainder) -> None:
    at = motion(4)
    # The smallest way back of a whole motion is a share of its travel.
    running = RunningRemainder(
        remainder, reverses_rad=3e-4 * float(np.ptp(at.position_rad, axis=0)[0])
    )
    every = [
        running(
            *(
                x[i]
                for x in (
                    at.time_s,
                    at.position_rad,
                    at.velocity_rad_s,
                    at.acceleration_rad_s2,
                    at.load_nm,
                )
            )
        )
        for i in range(len(at.time_s))
    ]
    whole = remainder.torque(at)
    began = 5  # before the first motion the direction is not known in a simulation
    np.testing.assert_allclose(np.array(every)[began:], whole[began:], atol=1e-12)


def test_a_run_that_begins_anew_forgets(remainder: Remainder) -> None:
    running = RunningRemainder(remainder, start_way=[1.0, 0.0])
    zero = np.zeros(2)
    first = running(0.0, zero, zero, zero, zero)
    running(1.0, zero + 1.0, zero, zero, zero)
    np.testing.assert_array_equal(running(0.0, zero, zero, zero, zero), first)


def test_misuse_of_a_start_is_refused(remainder: Remainder) -> None:
    for given in ([1.0], [1.0, 0.5], [1.0, np.nan]):
        with pytest.raises(InputError, match="start_way"):
            RunningRemainder(remainder, start_way=given)
    with pytest.raises(InputError, match="reverses_rad"):
        RunningRemainder(remainder, reverses_rad=0.0)
    with pytest.raises(InputError, match="temperature_c"):
        RunningRemainder(remainder, temperature_c=[20.0, np.nan])


def test_the_first_speed_tells_the_way(remainder: Remainder) -> None:
    """Below the corner of its terms, 0.05 rad/s here, an axis stands."""
    zero = np.zeros(2)
    for speed, way in ((0.2, 1), (-0.2, -1), (0.04, 0)):
        running = RunningRemainder(remainder)
        at = running.at(0.0, zero, np.array([speed, 0.0]), zero, zero)
        np.testing.assert_array_equal(at.way[0], [way, 0])


def test_the_end_of_a_log_tells_the_way() -> None:
    t = np.linspace(0.0, 1.0, 200)[:, None]
    there_and_back = np.minimum(t, 1.5 - t)
    noise = np.random.default_rng(0).normal(0.0, 1e-3, (200, 3))
    way = last_way(np.hstack([t, there_and_back, 0 * t]) + noise)
    np.testing.assert_array_equal(way, [1, -1, 0])
    with pytest.raises(InputError, match="position_rad"):
        last_way(t[:, 0])


def test_a_given_temperature_counts_until_a_call_gives_one() -> None:
    warm = term(
        acts="torque", variable="temperature", x=np.array([20.0, 40.0]), value=np.array([2.0, 4.0])
    )
    zero = np.zeros(2)
    running = RunningRemainder(
        Remainder((warm,), np.full(2, 9.0), zero), temperature_c=[30.0, 30.0]
    )
    assert not running.lacks_temperature
    assert running(0.0, zero, zero, zero, zero)[0] == pytest.approx(3.0)
    assert running(0.1, zero, zero, zero, zero, np.array([40.0, 20.0]))[0] == pytest.approx(4.0)


def test_a_file_holds_the_same_torque(remainder: Remainder, tmp_path: Path) -> None:
    path = tmp_path / "remainder.toml"
    save_remainder(remainder, path)
    at = motion(5)
    np.testing.assert_allclose(
        load_remainder(path).torque(at), remainder.torque(at), rtol=0, atol=0
    )
    with pytest.raises(InputError):
        save_remainder(remainder, path)
    path.write_text(path.read_text().replace('acts = "way"', 'acts = "wax"'))
    with pytest.raises(InputError, match="acts: expected one of"):
        load_remainder(path)


def test_a_fitted_remainder_is_a_dataset() -> None:
    found = fit_remainder(records(lambda at: 0.5 * at.load_nm[:, 1]), most_terms=1)
    data = found.dataset()
    assert data["value"].dims == ("term", "point")
    assert data["variable"].values.tolist() == ["load"]
    assert "grows in proportion" in str(data["hint"].values[0])


def test_temperatures_are_asked_for(remainder: Remainder) -> None:
    warm = Remainder((term(acts="speed", variable="temperature"),), np.ones(2), np.ones(2))
    with pytest.raises(InputError, match="temperature_c"):
        warm.torque(motion(1))
    assert warm.torque(motion(1, temperature=True)).shape == (2000, 2)
