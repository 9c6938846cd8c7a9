"""Repeats of real machines: nothing is invented between sessions, and a known change is found."""

import pytest

from axisight.errors import InputError
from axisight.logs import ColumnMap, read_log
from axisight.repeats import compare_days


def odrive(folder, names):
    axis = {
        "position": {"name": "data", "index": "1,:", "unit": "counts", "counts_per_rev": 8192},
        "torque": {"name": "data", "index": "2,:", "unit": "A", "scale": 0.03},
    }
    time = {"name": "data", "index": "0,:", "resample_hz": 400.0}
    columns = ColumnMap.model_validate({"time": time, "axis": [axis]})
    return [read_log(folder / "odrive_cogging" / f"{name}.mat", columns) for name in names]


SESSIONS = ("slow2", "slow_goodgains_2")


@pytest.mark.parametrize("kind", ["comp", "nocomp"])
def test_two_sessions_of_a_motor_do_not_differ(shared_data, kind):
    names = [f"{session}/{kind}_{run}" for session in SESSIONS for run in (1, 2)]
    found = compare_days(
        odrive(shared_data, names), [n.split("/")[0] for n in names], torque_held=False
    )
    assert not found.moved
    # One run against the mean of its session: 0.6 to 0.9 % of the torque.
    assert 0.006 < found.torque["floor"].item() < 0.009


def test_compensated_cogging_is_a_difference(shared_data):
    names = [
        f"{session}/{kind}_{run}"
        for kind in ("comp", "nocomp")
        for session in SESSIONS
        for run in (1, 2)
    ]
    days = [n.split("/")[1].split("_")[0] for n in names]
    found = compare_days(odrive(shared_data, names), days, torque_held=False)
    torque = found.torque.isel(axis=0)
    assert torque["moved"].item()
    assert torque["between_nm"].item() > 10 * torque["within_nm"].item()


def test_runs_that_start_elsewhere_are_refused(shared_data):
    logs = odrive(shared_data, [f"slow2/comp_{run}" for run in range(3)])
    with pytest.raises(InputError, match=r"expected the motion of slow2/comp_0\.mat"):
        compare_days(logs, ["a"] * 3)


def test_three_motions_of_an_arm_are_refused(shared_data):
    def signal(name, axis, unit):
        return {"name": f"rec.{name}", "index": f"{axis},:", "unit": unit}

    axes = [
        {
            "position": signal("act_pos_mot_deg", axis, "deg"),
            "torque": signal("act_torque_abs_nm", axis, "Nm"),
        }
        for axis in range(6)
    ]
    columns = ColumnMap.model_validate({"time": {"name": "rec.time_cont"}, "axis": axes})
    logs = [read_log(shared_data / "kuka_kr300" / run / "data.mat", columns) for run in "ABC"]
    with pytest.raises(InputError, match=r"expected .*motion"):
        compare_days(logs, ["a", "a", "b"])
