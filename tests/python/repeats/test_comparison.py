"""What moved between days: identities, recovery, false findings, and words about the runs."""

import json
from dataclasses import replace

import numpy as np
import pytest
import scipy.stats

import axisight
from axisight.errors import InputError
from axisight.repeats import compare_days, plot_days
from axisight.statistics.one_way import power_of_shift
from repeat_data import COULOMB, INERTIA, VISCOUS, log, runs, simulated_days

# Torques of the closed form belong to the samples.
HELD = {"torque_held": False}


def test_parameters_of_a_run_are_recovered():
    logs, days = runs(2, 3, scatter=0.0)
    found = compare_days(logs, days, **HELD).parameters
    truth = {"viscous_friction": VISCOUS, "coulomb_friction": COULOMB, "inertia": INERTIA}
    for name, value in truth.items():
        got = found["value"].sel(parameter=f"axis1.{name}").values
        # Filter and central differences are within 1 % in the band of the motion.
        np.testing.assert_allclose(got, value, rtol=0.01)


def test_a_change_adds_to_the_estimates_and_nothing_else():
    """Identity: the regression is linear, so a torque d * v adds d to viscous friction of that run alone."""
    logs, days = runs(2, 3)
    before = compare_days(logs, days, **HELD).parameters["run_value"]
    v = np.gradient(logs[0].position_rad[:, 1], logs[0].sample_time_s)
    torque = logs[5].torque_nm.copy()
    torque[:, 1] += 0.002 * v
    after = compare_days([*logs[:5], replace(logs[5], torque_nm=torque)], days, **HELD)
    step = (after.parameters["run_value"] - before).isel(run=5)
    assert step.sel(parameter="axis2.viscous_friction").item() == pytest.approx(0.002, rel=1e-3)
    others = step.drop_sel(parameter="axis2.viscous_friction")
    # Relative to the change: other columns of the axis see only the error of the filter.
    assert np.abs(others.values).max() < 1e-3 * COULOMB
    unchanged = (after.parameters["run_value"] - before).isel(run=slice(0, 5))
    assert np.abs(unchanged.values).max() < 1e-12


def test_tests_and_intervals_are_those_of_scipy():
    logs, days = runs(2, 4, change=0.03)
    found = compare_days(logs, days, **HELD).parameters.sel(parameter="axis2.viscous_friction")
    one, two = found["run_value"].values[:4], found["run_value"].values[4:]
    oracle = scipy.stats.ttest_ind(two, one)
    assert found["p_value"].item() == pytest.approx(oracle.pvalue, rel=1e-9)
    interval = oracle.confidence_interval(0.95)
    got = found.sel(day="day1")
    assert got["change_lower"].item() == pytest.approx(interval.low, rel=1e-9)
    assert got["change_upper"].item() == pytest.approx(interval.high, rel=1e-9)


def test_scatter_from_run_to_run_is_recovered():
    """Noise within a run and friction that scatters add up; 39 degrees of freedom give 12 %, times 3."""
    logs, days = runs(2, 20, scatter=0.02)
    found = compare_days(logs, days, **HELD).parameters.sel(parameter="axis1.viscous_friction")
    assert found["std_between_runs"].item() == pytest.approx(0.02 * VISCOUS, rel=0.36)
    quiet = compare_days(*runs(2, 20, scatter=0.0), **HELD).parameters
    quiet = quiet.sel(parameter="axis1.viscous_friction")
    assert quiet["std_within_run"].item() == pytest.approx(quiet["std_of_run"].item(), rel=0.36)


def test_floor_is_the_noise_of_the_torque():
    """Of 20 intervals of 95 % one misses on average; 5 or more have a chance of 0.3 %."""
    missed = 0
    for seed in range(10):
        logs, days = runs(2, 5, scatter=0.0, seed=seed)
        torque = compare_days(logs, days, **HELD).torque
        share = 0.01 / logs[0].torque_nm.std(axis=0)
        np.testing.assert_allclose(torque["floor"], share, rtol=0.04)
        missed += int(((torque["floor_lower"] > share) | (torque["floor_upper"] < share)).sum())
    assert missed <= 4


def test_bands_add_up_to_the_whole():
    logs, days = runs(2, 3)
    found = compare_days(logs, days, **HELD)
    bands = found.places.sel(place=[p for p in found.places["place"].values if p.endswith("Hz")])
    total = np.sqrt((bands["within_nm"] ** 2).sum("place"))
    np.testing.assert_allclose(total, found.torque["within_nm"], rtol=1e-9)


def test_fewer_changes_than_the_level_are_false():
    """24 pairs of days of a simulated axis: 5 % of them are 1, and 6 or more have a chance of 0.1 %."""
    false = sum(
        bool(compare_days(*simulated_days(seed, change=0.0)[:2]).moved) for seed in range(24)
    )
    assert false <= 5


def test_a_change_of_five_per_cent_is_found():
    found = []
    for seed in range(12):
        logs, days, axis = simulated_days(seed, change=0.05)
        moved = compare_days(logs, days).moved
        found.append(f"axis{axis}.viscous_friction" in moved)
    # The power is above 99 %: two misses in 12 have a chance below 0.7 %.
    assert sum(found) >= 11


@pytest.mark.parametrize(
    ("change", "least", "most"), [(0.0, 0, 8), (0.05, 57, 60)], ids=["none", "five_per_cent"]
)
def test_days_of_an_arm(change, least, most):
    """60 arms: a false finding in 3 of them is expected, 9 or more have a chance of 0.3 %."""
    robot = axisight.load_robot("irb6600_like")
    count = 0
    for seed in range(60):
        logs, days, axis = simulated_days(seed, change=change, preset="irb6600_like")
        moved = compare_days(logs, days, robot=robot).moved
        count += f"axis{axis}.viscous_friction" in moved if change else bool(moved)
    assert least <= count <= most


def test_stated_power_is_that_of_simulation():
    """Of a change near the least one of half the power: the mean stated power against how often it is found."""
    share, found, spreads = 0.022, [], []
    for seed in range(60):
        result = compare_days(*runs(2, 5, seed=seed, change=share), **HELD)
        found.append("axis2.viscous_friction" in result.moved)
        spread = result.parameters["std_of_run"].sel(parameter="axis2.viscous_friction").item()
        spreads.append(spread)
    # With the scatter of all machines together, the power of one test is a number and no estimate.
    limit = result.parameters.attrs["significance"]
    variance = np.array([np.mean(np.square(spreads))])
    power = power_of_shift(np.array([5, 5]), variance, limit, np.array([share * VISCOUS]))[0]
    assert 0.2 < power < 0.9
    assert abs(np.mean(found) - power) < 4 * np.sqrt(power * (1 - power) / 60)


def test_a_load_is_no_friction():
    robot = axisight.load_robot("irb6600_like")
    logs, days, _ = simulated_days(1, change=0.0, preset="irb6600_like", per_day=4)
    q = robot.gear_ratio
    heavy = []
    for one in logs:
        joint = np.zeros((one.n_samples, robot.n_joints))
        joint[:, robot.axis_joints] = one.position_rad * q
        added = 0.002 * robot.gravity(joint)[:, robot.axis_joints] * q
        late = days[logs.index(one)] == "day1"
        heavy.append(replace(one, torque_nm=one.torque_nm + late * added))
    found = compare_days(heavy, days, robot=robot)
    assert found.moved
    assert not [name for name in found.moved if "friction" in name]


def test_echoes_do_not_count():
    """A change of 40 % in friction shows in other parameters by what the filter leaves, far below it."""
    logs, days = runs(2, 6, scatter=0.0, change=0.4)
    found = compare_days(logs, days, **HELD)
    assert [n for n in found.moved if n.startswith("axis")] == ["axis2.viscous_friction"]
    assert found.moved[-1] == "torque of axis 2"


def warmer(per_day=6, *, spread_c, slope=-0.02, change=0.0):
    """Days 8 degC apart, friction falls by 2 % a degree; runs of a day differ by ``spread_c`` altogether."""
    rng = np.random.default_rng(5)
    logs, days = [], []
    for day in range(2):
        for run in range(per_day):
            celsius = 30.0 + 8.0 * day + spread_c * (run / (per_day - 1) - 0.5)
            viscous = VISCOUS * (1 + slope * (celsius - 30.0) + change * day)
            viscous *= 1 + 0.002 * rng.normal()
            logs.append(
                log(f"{day}{run}", seed=run + 10 * day, viscous=viscous, temperature_c=celsius)
            )
            days.append(f"day{day}")
    # Not in the order of the temperature, which would be a drift.
    order = np.concatenate([rng.permutation(per_day), per_day + rng.permutation(per_day)])
    return [logs[i] for i in order], days


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"spread_c": 4.0}, "which explains the change"),
        ({"spread_c": 4.0, "change": -0.2}, "at equal temperature it moved too"),
        ({"spread_c": 0.0}, "equally warm"),
    ],
)
def test_friction_follows_the_temperature(options, words):
    found = compare_days(*warmer(**options), **HELD)
    assert "axis1.viscous_friction" in found.moved
    assert any("axis1.viscous_friction" in text and words in text for text in found.findings)


def test_findings_about_runs():
    logs, days = runs(2, 2, scatter=0.0, change=0.3)
    said = " ".join(compare_days(logs, days, **HELD).findings)
    assert "2 runs more than days" in said
    assert "no temperature was logged" in said
    drift = [log(f"{i}", seed=i, viscous=VISCOUS * (1 - 0.02 * (i % 6))) for i in range(12)]
    said = " ".join(compare_days(drift, ["a"] * 6 + ["b"] * 6, **HELD).findings)
    assert "follows the order of the runs" in said


def test_columns_that_the_motion_does_not_separate_are_named():
    """Motion in one direction: Coulomb friction is an offset."""
    logs, days = runs(2, 3)
    t = logs[0].time_s[:, None]
    one_way = [replace(x, position_rad=np.tile(50 * t + np.sin(3 * t), (1, 2))) for x in logs]
    found = compare_days(one_way, days, **HELD)
    assert "axis1.coulomb_friction" not in found.parameters["parameter"]
    assert any("does not separate axis1.coulomb_friction" in text for text in found.findings)


def test_one_day_gives_the_floor_and_no_test():
    logs, _ = runs(1, 4)
    found = compare_days(logs, ["a"] * 4, **HELD)
    assert not found.tested and not found.moved
    assert (found.torque["floor"] > 0).all()
    assert np.isnan(found.torque["p_value"]).all()
    assert any("one day" in text for text in found.findings)


def test_misuse_is_refused():
    logs, days = runs(2, 2)
    with pytest.raises(InputError, match="days: expected one for each of 4 logs, got 3"):
        compare_days(logs, days[:3])
    with pytest.raises(InputError, match="two runs or more of one day"):
        compare_days(logs[1:3], ["a", "b"])
    with pytest.raises(InputError, match="reference: expected one of day0, day1, got 'x'"):
        compare_days(logs, days, reference="x")
    with pytest.raises(InputError, match="level"):
        compare_days(logs, days, level=0.0)
    with pytest.raises(InputError, match="robot: expected 2 axes"):
        compare_days(logs, days, robot=axisight.load_robot("irb6600_like"))
    with pytest.raises(InputError, match="found"):
        plot_days(logs)


def test_document_and_picture_hold_the_tables():
    found = compare_days(*runs(3, 3, change=0.3), reference="day1", **HELD)
    said = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert said["schema"] == "axisight.repeat/1" and said["moved"] == list(found.moved)
    one = next(p for p in said["parameters"] if p["name"] == "axis2.viscous_friction")
    assert one["moved"] and one["days"][1]["change"] == 0
    assert one["days"][2]["change"] == pytest.approx(0.3 * VISCOUS, rel=0.1)
    titles = [axes.get_title() for axes in plot_days(found).axes]
    assert sum("moved" in title for title in titles) == len(
        [n for n in found.moved if n.startswith("axis")]
    )
