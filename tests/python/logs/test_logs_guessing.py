"""Column maps proposed from names and numbers: they read what was written, and say what is open."""

import re

import numpy as np
import pytest

from axisight.errors import LogError
from axisight.logs import check_log, load_column_map, read_log
from axisight.logs.guessing import guess_columns
from axisight.logs.guessing.names import meaning_of
from axisight.logs.guessing.series import Series, series_of
from axisight.logs.sources import load_arrays
from columns_data import (
    DEG,
    GEAR,
    MAKERS,
    RPM,
    maker_columns,
    motion,
    robot,
    write_csv,
    write_lerobot,
)
from logs_data import native_columns, write

N = 6
JOINTS = ("pan", "lift", "elbow", "roll", "bend", "flange")


def table(
    time: str, position: str, velocity: str = "", torque: str = "", /, **factors: float
) -> dict:
    """Columns by names with the number, from 1, at {} or the joint at {j}; SI times factors."""
    run = motion(N)
    named = {"position": position, "velocity": velocity, "torque": torque}
    out = {time: run["time"] * factors.get("time", 1.0)}
    for field, name in named.items():
        for k in range(N if name else 0):
            values = run[field][:, k] * factors.get(field, 1.0)
            out[name.format(k + 1, j=JOINTS[k])] = values
    return out


def shuffled(columns: dict) -> dict:
    keys = list(columns)
    np.random.default_rng(4).shuffle(keys)
    return {key: columns[key] for key in keys}


DEGREES = {"time": 1e3, "position": DEG, "velocity": RPM}
# Name -> (columns, units of time, position and velocity)
FILES = {
    "units after": (
        table("t_ms", "J{}_pos_deg", "J{}_vel_rpm", "J{}_torque_Nm", **DEGREES),
        ("ms", "deg", "rpm"),
    ),
    "units in brackets": (
        table("Time [ms]", "Angle {} [deg]", "Speed {} [rpm]", "Moment {} [Nm]", **DEGREES),
        ("ms", "deg", "rpm"),
    ),
    "units before the number": (
        table("time_us", "pos_rad_{}", "vel_deg_per_s_{}", "tau_nm_{}", time=1e6, velocity=DEG),
        ("us", "rad", "deg/s"),
    ),
    "SI without units": (table("t", "q{}", "dq{}", "tau{}"), ("s", "rad", "rad/s")),
    "degrees and rpm without units": (
        table("time", "q_{}", "qd_{}", "effort_{}", **DEGREES),
        ("ms", "deg", "rpm"),
    ),
    "rad and rpm without units": (
        table("stamp", "angle{}", "speed{}", "trq{}", time=1e9, velocity=RPM),
        ("ns", "rad", "rpm"),
    ),
    "degrees and rad/s without units": (
        table("stamp", "jointAngle{}", "jointSpeed{}", "jointTorque{}", position=DEG),
        ("s", "deg", "rad/s"),
    ),
    "degrees by their size": (
        table("timestamp", "position{}", "velocity{}", "torque{}", position=DEG, velocity=DEG),
        ("s", "deg", "deg/s"),
    ),
    "velocity says it": (
        table("t", "Pos.A{}", "Vel.A{} (deg/s)", "Effort.A{}", position=DEG, velocity=DEG),
        ("s", "deg", "deg/s"),
    ),
    "no velocity": (table("secs", "theta[{}]", "", "tau[{}]"), ("s", "rad", None)),
    "joints by name": (
        table("/time", "/{j}/position", "/{j}/velocity", "/{j}/effort"),
        ("s", "rad", "rad/s"),
    ),
    "joints before": (
        table("t", "{j}_pos_deg", "{j}_vel_degps", "{j}_torque", position=DEG, velocity=DEG),
        ("s", "deg", "deg/s"),
    ),
}


@pytest.mark.parametrize("shuffle", [False, True])
@pytest.mark.parametrize("name", FILES)
def test_a_guess_reads_what_was_written(tmp_path, name, shuffle):
    columns, (time, position, velocity) = FILES[name]
    arm = robot(N, list(JOINTS))
    path = write_csv(tmp_path / "run.csv", shuffled(columns) if shuffle else columns)
    found = guess_columns(path, arm)
    assert found.named is None
    (tmp_path / "columns.toml").write_text(found.text)
    assert load_column_map(tmp_path / "columns.toml") == found.columns
    assert found.columns.time.unit == time
    assert {axis.position.unit for axis in found.columns.axis} == {position}
    got = {None if axis.velocity is None else axis.velocity.unit for axis in found.columns.axis}
    assert got == {velocity}
    assert found.columns.side == "joint"
    log = read_log(path, tmp_path / "columns.toml", robot=arm)
    run = motion(N)
    np.testing.assert_allclose(log.position_rad, run["position"] / GEAR, rtol=1e-6, atol=1e-4)
    np.testing.assert_allclose(log.torque_nm, run["torque"] * GEAR, rtol=1e-6, atol=1e-6)
    if velocity is not None:
        np.testing.assert_allclose(log.velocity_rad_s, run["velocity"] / GEAR, atol=1e-2)
    # Every choice has its reason.
    for field in ("position", "torque", *(["velocity"] if velocity else [])):
        assert re.search(rf"^# {field}: .+: .+", found.text, re.MULTILINE)


def test_small_motions_in_degrees_are_known_by_their_speeds(tmp_path):
    for velocity, unit in ((1.0, "rad/s"), (RPM, "rpm")):
        small = {"position": 0.05 * DEG, "velocity": 0.05 * velocity}
        path = write_csv(tmp_path / "a.csv", table("t", "q{}", "dq{}", "tau{}", **small))
        axis = guess_columns(path).columns.axis[0]
        assert (axis.position.unit, axis.velocity.unit) == ("deg", unit)


def test_signals_of_matrices_are_their_rows_or_columns():
    q = motion(N)["position"]
    for array in (q, q.T):
        found, other = series_of({"q": array, "t": q[:, 0], "k": np.ones(3)})
        np.testing.assert_array_equal(np.column_stack([s.values for s in found[:N]]), q)
        assert list(other) == ["k"]


@pytest.mark.parametrize("kind", [".npz", ".h5", ".mat"])
@pytest.mark.parametrize("across", [True, False])
def test_matrices(tmp_path, kind, across):
    run = motion(N)
    columns = {"t": run["time"], "q": run["position"], "dq": run["velocity"], "tau": run["torque"]}
    columns = {k: v if across or v.ndim == 1 else v.T for k, v in columns.items()}
    path = write(tmp_path / f"a{kind}", columns | {"gain": np.float64(3.0), "K": np.ones(N)})
    found = guess_columns(path)
    log = read_log(path, found.columns, robot=robot(N))
    np.testing.assert_allclose(log.position_rad, run["position"] / GEAR)
    assert log.velocity_rad_s is not None
    assert "one value" in found.unused["gain"]
    assert "shape (6,)" in found.unused["K"]


@pytest.mark.parametrize("n_axes", [6, 7])
@pytest.mark.parametrize("maker", MAKERS)
def test_names_of_a_maker_are_known(tmp_path, maker, n_axes):
    path = write_csv(tmp_path / "a.csv", shuffled(maker_columns(maker, n_axes)))
    found = guess_columns(path, robot(n_axes))
    assert found.named == maker
    assert f"--columns {maker}" in found.text
    (tmp_path / "columns.toml").write_text(found.text)
    log = read_log(path, tmp_path / "columns.toml", robot=robot(n_axes))
    np.testing.assert_allclose(
        log.position_rad, motion(n_axes)["position"] / GEAR, rtol=1e-6, atol=1e-4
    )


def test_angles_of_a_maker_in_other_units_are_none(tmp_path):
    columns = maker_columns("ur-rtde", 6)
    for k in range(6):
        columns[f"actual_q_{k}"] = columns[f"actual_q_{k}"] * DEG
    found = guess_columns(write_csv(tmp_path / "a.csv", columns), robot(6))
    assert found.named is None
    assert found.columns.axis[0].position.unit == "deg"
    assert any("names are those of ur-rtde, but actual_q_" in doubt for doubt in found.doubts)


def test_a_gripper_beyond_the_axes_of_the_robot(tmp_path):
    folder = write_lerobot(tmp_path / "set", n_axes=7)
    found = guess_columns(folder, robot(6))
    assert found.named == "lerobot"
    assert "axes = 6  # those of the robot; the file has 7" in found.text
    assert found.doubts == ("axes: the first 6 of 7",)
    (tmp_path / "columns.toml").write_text(found.text)
    assert read_log(folder, tmp_path / "columns.toml", robot=robot(6)).n_axes == 6


def test_states_without_efforts(tmp_path):
    found = guess_columns(write_lerobot(tmp_path / "set", effort=False))
    assert found.columns.axis[5].position.name == "observation.state[5]"
    assert found.columns.axis[5].torque is None
    assert found.columns.axis[5].position_ref.name == "action[5]"


def test_native_columns_need_no_map(tmp_path):
    with pytest.raises(LogError, match="it needs no map"):
        guess_columns(write(tmp_path / "a.csv", native_columns()))


def test_speeds_of_a_maker_in_other_units_are_none(tmp_path):
    columns = maker_columns("abb", 6)
    columns |= {f"speed_J{k}": columns[f"speed_J{k}"] / DEG for k in range(1, 7)}
    found = guess_columns(write_csv(tmp_path / "a.csv", columns), robot(6))
    assert found.named is None
    assert any("names are those of abb, but speed_J1 is 0.01745" in d for d in found.doubts)
    axis = found.columns.axis[0]
    assert (axis.position.unit, axis.velocity.unit) == ("deg", "rad/s")


def test_doubtful_times(tmp_path):
    columns = table("t", "q{}", "dq{}", "tau{}")
    found = guessed(tmp_path, columns | {"t": columns["t"] * 50})
    assert any("ms by 5000 Hz; s would be 5 Hz" in doubt for doubt in found.doubts)
    columns["t_ms"] = columns.pop("t")
    found = guessed(tmp_path, columns)
    assert any("t_ms says ms, which makes 2.5e+05 Hz" in doubt for doubt in found.doubts)


def test_joints_by_name_without_a_robot(tmp_path):
    found = guessed(tmp_path, FILES["joints by name"][0])
    assert any("in the order of the file (pan, lift," in doubt for doubt in found.doubts)


def test_an_episode_of_lerobot(tmp_path):
    write_lerobot(tmp_path / "set", 2)
    assert guess_columns(tmp_path / "set#1").named == "lerobot"
    with pytest.raises(LogError, match="set#0 to set#1"):
        guess_columns(tmp_path / "set")


# What is open is said and left out.


def guessed(tmp_path, columns: dict, arm=None):
    return guess_columns(write_csv(tmp_path / "a.csv", columns), arm)


def test_currents_wait_for_the_torque_constant(tmp_path):
    found = guessed(tmp_path, table("t", "q{}", "dq{}", "motor_current_{}"))
    assert all(axis.torque is None for axis in found.columns.axis)
    # Of motors, where positions are those of joints.
    assert "of the motors" in found.unused["motor_current_1 and 5 like it"]
    found = guessed(tmp_path, table("t", "q{}", "dq{}", "i{}"))
    assert '# torque = { name = "i3", unit = "A", scale = ... }' in found.text
    assert any("state the Nm (or N) per A" in doubt for doubt in found.doubts)
    with pytest.raises(LogError, match="expected a torque"):
        read_log(tmp_path / "a.csv", found.columns, robot=robot(6))
    done = found.text.replace("# torque = {", "torque = {").replace("...", "2.0")
    (tmp_path / "c.toml").write_text(done)
    log = read_log(tmp_path / "a.csv", tmp_path / "c.toml", robot=robot(6))
    np.testing.assert_allclose(log.torque_nm, 2.0 * motion(6)["torque"] * GEAR, atol=1e-6)


@pytest.mark.parametrize(
    "name", ["tau{} [mNm]", "tau{}_mNm", "torque_{} (%)", "torque{}_percent", "Moment {} [kNm]"]
)
def test_units_that_maps_do_not_have_wait_for_a_scale(tmp_path, name):
    found = guessed(tmp_path, table("t", "q{}", "dq{}", name))
    assert found.columns.axis[0].torque is None
    assert 'unit = "Nm", scale = ... }' in found.text
    assert any("state the Nm (or N) per " in doubt for doubt in found.doubts)
    with pytest.raises(LogError, match="expected a unit of angles or lengths, got mrad"):
        guessed(tmp_path, table("t", "q{}_mrad", "", name))


def test_axes_that_names_keep_apart_are_said(tmp_path):
    columns = table("t", "wrist_{}_pos", "", "wrist_{}_effort")
    columns["elbow_pos"] = columns["wrist_1_pos"]
    found = guessed(tmp_path, columns)
    assert any("fewer axes are left out: elbow_pos" in doubt for doubt in found.doubts)


def test_targets_errors_and_the_tool_are_told_from_measurements(tmp_path):
    columns = table("t", "actual_pos_{}", "actual_vel_{}", "measured_torque_{}")
    columns |= table("t", "target_pos_{}", "target_vel_{}", "torque_cmd_{}")
    columns |= table("t", "pos_error_{}", "acc_{}", "tau_ext_{}")
    columns["tcp_speed_1"] = columns["t"]
    columns["comment"] = ["x"] * len(columns["t"])
    found = guessed(tmp_path, columns)
    axis = found.columns.axis[3]
    assert axis.position.name == "actual_pos_4"
    assert axis.velocity.name == "actual_vel_4"
    assert axis.velocity_ref.name == "target_vel_4"
    assert axis.torque.name == "measured_torque_4"
    reasons = {name.split(" ")[0]: why for name, why in found.unused.items()}
    assert axis.position_ref.name == "target_pos_4"
    assert "difference" in reasons["pos_error_1"]
    assert "accelerations" in reasons["acc_1"]
    assert "tool" in reasons["tau_ext_1"]
    assert "tool" in reasons["tcp_speed_1"]
    assert reasons["comment"] == "no numbers: row 1 is 'x'"
    assert set(reasons) >= {"torque_cmd_1"}
    assert all(name in found.text for name in found.unused)


def test_velocities_that_are_none_are_left_out(tmp_path):
    columns = table("t", "q{}", "dq{}", "tau{}")
    for k in range(1, 7):
        columns[f"dq{k}"] = np.random.default_rng(k).standard_normal(columns["t"].size)
    found = guessed(tmp_path, columns)
    assert found.columns.axis[0].velocity is None
    assert "does not follow the derivative" in found.unused["dq1 and 5 like it"]
    # On the other side of a gear.
    found = guessed(tmp_path, table("t", "q{}", "dq{}", "tau{}", velocity=1 / GEAR))
    assert found.columns.axis[0].velocity is None
    assert "50 times the derivative" in found.unused["dq1 and 5 like it"]
    # Another unit than the name says, and another sign.
    found = guessed(tmp_path, table("t", "q{}_rad", "vel{}_rpm", velocity=DEG))
    assert "which is deg/s, where the name says rpm" in found.unused["vel1_rpm and 5 like it"]
    found = guessed(tmp_path, table("t", "q{}", "dq{}", velocity=-1.0))
    assert "another sign" in found.unused["dq1 and 5 like it"]


def test_several_torques_are_a_choice_that_is_left(tmp_path):
    columns = table("t", "q{}", "dq{}", "tau_a{}") | table("t", "q{}", "dq{}", "tau_b{}")
    found = guessed(tmp_path, columns)
    assert found.columns.axis[0].torque is None
    (doubt,) = [doubt for doubt in found.doubts if doubt.startswith("torque")]
    assert "tau_a1 and 5 like it or tau_b1" in doubt


def test_motors_by_name_and_by_size(tmp_path):
    found = guessed(tmp_path, table("t", "motor_pos_{}", "", "motor_torque_{}"))
    assert found.columns.side == "motor"
    found = guessed(tmp_path, table("t", "q{}", "dq{}", "tau{}", position=800, velocity=800))
    assert (found.columns.side, found.columns.axis[0].position.unit) == ("motor", "rad")
    assert any(doubt.startswith("side: motor by size") for doubt in found.doubts)
    columns = table("t", "q_mot_{}", "", "tau{}", position=100)
    columns |= table("t", "q_link_{}_deg", position=DEG)
    found = guessed(tmp_path, columns)
    axis = found.columns.axis[1]
    assert (axis.position.name, axis.joint_position.name) == ("q_mot_2", "q_link_2_deg")


def test_axes_of_the_robot(tmp_path):
    columns = table("t", "q{}", "dq{}", "tau{}")
    found = guessed(tmp_path, columns, robot(5))
    assert len(found.columns.axis) == 5
    assert found.unused["q6"] == "beyond the 5 axes of the robot"
    with pytest.raises(LogError, match="axis: expected positions of 7 axes, got columns for 6"):
        guessed(tmp_path, columns, robot(7))
    found = guessed(tmp_path, {k: v for k, v in columns.items() if k != "q3"})
    assert any("numbers have a gap (1, 2, 4, 5, 6)" in doubt for doubt in found.doubts)


def test_one_joint_of_another_arm_is_no_axis_apart(tmp_path):
    """Where not every joint of the robot is named, none is: all stay together, in the order of the file."""
    columns = table("t", "position.{j}", "velocity.{j}", "effort.{j}")
    found = guessed(tmp_path, columns, robot(6, [JOINTS[2], *"abcde"]))
    assert [axis.position.name for axis in found.columns.axis] == [f"position.{j}" for j in JOINTS]
    assert any(doubt.startswith("axes: in the order of the file") for doubt in found.doubts)


def test_what_no_word_says_is_refused_with_the_words(tmp_path):
    with pytest.raises(
        LogError, match=r"say so \(q, .*pos, .*angle, .*a column map can name any other"
    ):
        guessed(tmp_path, table("t", "A{}_x"))


def test_nan_is_no_obstacle_to_a_guess_but_to_reading(tmp_path):
    columns = table("t", "q{}", "dq{}", "tau{}")
    columns["q2"][17] = np.nan
    columns["tau4"][3] = np.nan
    found = guessed(tmp_path, columns)
    assert found.columns.axis[0].velocity.unit == "rad/s"
    report = check_log(tmp_path / "a.csv", found.columns)
    assert {f.column for f in report.findings if f.name == "not_finite"} == {"q2", "tau4"}


def test_irregular_stamps_and_semicolons(tmp_path):
    columns = table("time_ms", "q{}", "dq{}", "tau{}", time=1e3)
    columns["time_ms"] += np.random.default_rng(0).uniform(-0.5, 0.5, columns["time_ms"].size)
    path = tmp_path / "a.csv"
    text = write_csv(path, columns, ";").read_text().replace(".", ",")
    path.write_text(text)
    found = guess_columns(path)
    assert found.columns.time.resample_hz == "mean"
    assert found.columns.csv.decimal == ","
    assert read_log(path, found.columns, robot=robot(6)).is_resampled


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (lambda c: {k: v for k, v in c.items() if k != "t"}, "time: expected a column"),
        (lambda c: c | {"t": c["t"] * 0}, "time: expected a column"),
        (lambda c: c | {"t": np.where(c["t"] > 1, np.nan, c["t"])}, "time: expected a column"),
        (lambda c: c | {"t": c["t"] * 1e12}, "expected steps of a unit"),
        (lambda c: c | {"time2": c["t"] * 3}, "expected one column that is the time"),
        (lambda c: {k: v for k, v in c.items() if k[0] != "q"}, "position: expected columns"),
        (lambda c: {k.replace("q", "target_q"): v for k, v in c.items()}, "only targets: target_q"),
        (lambda c: c | table("t", "angle{}"), "a choice of q1 and 5 like it, angle1 and 5"),
        (lambda c: {k.replace("q", "q_counts_"): v for k, v in c.items()}, "counts_per_rev"),
    ],
)
def test_what_cannot_be_guessed_lists_the_columns(tmp_path, columns, words):
    made = columns(table("t", "q{}", "", "tau{}"))
    with pytest.raises(LogError, match=re.escape(words)) as caught:
        guessed(tmp_path, made)
    listed = str(caught.value).split("columns: ")[1]
    assert listed.split(", ") == list(made)


@pytest.mark.parametrize(
    ("name", "meaning"),
    [
        ("actual_qd_0", ("velocity", False, None, None, 0)),
        ("q_d[2]", ("position", True, None, None, 2)),
        ("tau_J_d[3]", ("torque", True, None, None, 3)),
        ("AIPos.A1", ("position", False, None, None, 1)),
        ("ASPos.A1", ("position", True, None, None, 1)),
        ("PositionCmptd3", ("position", True, None, None, 3)),
        ("tau_calculated_3", ("torque", True, None, None, 3)),
        ("MACur.A6", ("current", None, None, None, 6)),
        ("GearTorque.A6", ("torque", None, None, "joint", 6)),
        ("joint_temperatures_4", ("temperature", None, None, "joint", 4)),
        ("rec.act_vel_mot_deg_per_s", ("velocity", False, "deg/s", "motor", "rec")),
        ("Motor speed 2 [1/min]", ("velocity", None, "rpm", "motor", 2)),
        ("torque_3 (N·m)", ("torque", None, "Nm", None, 3)),
        ("torque_3 [mNm]", ("torque", None, "mNm", None, 3)),
        ("motor_cur_2_mA", ("current", None, "ma", "motor", 2)),
        ("current_2_a", ("current", None, "A", None, 2)),
        ("J5", ("", None, None, None, 5)),
        ("ms", ("time", None, "ms", None, "")),
        ("dq_d_5", ("velocity", True, None, None, 5)),
        ("Joint_5", ("position", None, None, "joint", 5)),
        ("tau_ext_hat_filtered[1]", ("other", None, None, None, 1)),
    ],
)
def test_what_a_name_says(name, meaning):
    found = meaning_of(Series(name, np.zeros(3)))
    assert (found.quantity, found.wanted, found.unit, found.side, found.axis) == meaning


# Real logs.


def test_kr300(shared_data):
    for run in ("A", "B", "C"):
        path = shared_data / "kuka_kr300" / run / "data.mat"
        found = guess_columns(path)
        assert found.columns.side == "motor"
        assert found.columns.time.name == "rec.time_cont"
        axis = found.columns.axis[2]
        assert (axis.position.name, axis.position.unit) == ("rec.act_pos_mot_deg", "deg")
        assert (axis.velocity.name, axis.velocity.unit) == ("rec.act_vel_mot_deg_per_s", "deg/s")
        assert axis.joint_position.name == "rec.act_pos_se_deg"
        # Which of two torques nobody can know.
        assert axis.torque is None
        assert any("act_torque_abs_nm" in d and "act_torque_rel_nm" in d for d in found.doubts)
        assert any("always zero, no sensor?" in doubt for doubt in found.doubts)


def test_emps_offers_what_follows_the_acceleration(shared_data):
    found = guess_columns(shared_data / "emps/DATA_EMPS.mat")
    (axis,) = found.columns.axis
    assert (axis.position.name, found.columns.time.unit) == ("qm", "s")
    assert axis.torque is None
    assert any("with the acceleration go vir" in doubt for doubt in found.doubts)


@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("fditools_multisine/MultisineTypeA.mat", "a choice of theta_mx, theta_my"),
        ("staubli_tx40/pos_read_data.csv", "time: expected a column"),
        ("odrive_cogging/slow2/comp_0.mat", "position: expected columns"),
    ],
)
def test_logs_that_a_person_has_to_map(shared_data, file, words):
    with pytest.raises(LogError, match=words):
        guess_columns(shared_data / file)


def test_the_stamps_of_the_bench_are_in_us(shared_data, tmp_path):
    arrays = load_arrays(shared_data / "fditools_multisine/MultisineTypeA.mat")
    kept = {k: arrays[k] for k in ("time", "fs", "theta_mx", "iq_adx", "omega_max")}
    found = guess_columns(write(tmp_path / "a.npz", kept))
    assert (found.columns.time.unit, found.columns.sample_rate_hz) == ("us", "fs")
    assert "a bound, by its name" in found.unused["omega_max"]
    assert '# torque = { name = "iq_adx", unit = "A", scale = ... }' in found.text


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("time,position_1,torque_1\n[s],[deg],[Nm]\n", "position_1 (no numbers: row 1 is '[deg]')"),
        ('time,q,tau\n0.0,"[0.0, 1.0]","[2.0, 3.0]"\n', "q (no numbers: row 1 is '[0.0, 1.0]')"),
        (
            "stamp,q,tau\n1.5.2024 12:00:00.000,0.0,1.0\n",
            "stamp (no numbers: row 1 is '1.5.2024",
        ),
    ],
)
def test_columns_of_texts_are_named_with_their_first_text(tmp_path, rows, said):
    path = tmp_path / "run.csv"
    path.write_text(rows + rows.splitlines()[-1] + "\n")
    with pytest.raises(LogError) as refused:
        guess_columns(path)
    assert said in str(refused.value)
    assert str(refused.value).endswith("write one number into each cell")


def with_stamps(columns: dict, time: np.ndarray) -> dict:
    """Return columns of a motion, as they were recorded at other times."""
    moved = {k: np.interp(time, columns["t"], x) for k, x in columns.items() if k != "t"}
    return {"t": time, **moved}


def test_velocities_fit_positions_though_most_stamps_come_early(tmp_path):
    """Three steps of four are 7 % shorter than the mean: by the median the derivatives would be too large."""
    columns = table("t", "pos_{}", "vel_{}", "tau_{}")
    step = float(np.diff(columns["t"])[0])
    steps = step * np.tile([0.93, 0.93, 0.93, 1.21], len(columns["t"]) // 4)
    time = np.concatenate([[0.0], np.cumsum(steps)])
    found = guessed(tmp_path, with_stamps(columns, time[time <= columns["t"][-1]]))
    axis = found.columns.axis[0]
    assert (axis.velocity.name, axis.velocity.unit) == ("vel_1", "rad/s")


def test_a_map_has_the_line_that_bridges_a_hole(tmp_path):
    columns = table("t", "pos_{}", "vel_{}", "tau_{}")
    kept = np.delete(np.arange(len(columns["t"])), np.s_[400:440])
    found = guessed(tmp_path, {k: np.asarray(x)[kept] for k, x in columns.items()})
    rate = round(1.0 / float(np.median(np.diff(columns["t"]))))
    assert f"# resample_hz = {rate}  # take off the # to bridge" in found.text
    assert any("hole" in doubt for doubt in found.doubts)


def turning() -> dict[str, np.ndarray]:
    """Return a pendulum that swings over: joint-side angle up to 32 rad, speed, torque."""
    t = np.arange(2000) / 200
    speed = 4 * np.cos(2 * t) + 3
    return {"t": t, "theta": 2 * np.sin(2 * t) + 3 * t, "omega": speed, "tau": -8 * np.sin(2 * t)}


@pytest.mark.parametrize("unit", ["rad", "deg"])
@pytest.mark.parametrize("named", ["omega_{}_s", "omega_ref_{}_s", "theta_ref_{}"])
def test_a_unit_in_another_name_says_that_of_several_turns(tmp_path, named, unit):
    run = turning()
    factor = DEG if unit == "deg" else 1.0
    made = {"t": run["t"], "theta": run["theta"] * factor, "tau": run["tau"]}
    made[named.format(unit)] = run["omega" if named.startswith("omega") else "theta"] * factor
    found = guess_columns(write_csv(tmp_path / "a.csv", made))
    (axis,) = found.columns.axis
    assert axis.position.unit == unit
    other = axis.velocity or axis.velocity_ref or axis.position_ref
    assert other.name == named.format(unit)
    assert other.unit.startswith(unit)
    assert not any(doubt.startswith("position: ") for doubt in found.doubts)


def test_a_target_in_another_unit_than_its_positions(tmp_path):
    """The target is in rad by its name, and the positions are 57.3 times as much."""
    run = turning()
    made = {"t": run["t"], "theta": run["theta"] * DEG, "tau": run["tau"]}
    found = guess_columns(write_csv(tmp_path / "a.csv", made | {"theta_ref_rad": run["theta"]}))
    (axis,) = found.columns.axis
    assert axis.position.unit == "deg"
    assert axis.position_ref is None or axis.position_ref.unit == "rad"


@pytest.mark.parametrize("speed", [False, True])
def test_several_turns_of_which_nothing_tells_the_unit_are_doubtful(tmp_path, speed):
    run = turning()
    made = {name: values for name, values in run.items() if speed or name != "omega"}
    found = guess_columns(write_csv(tmp_path / "a.csv", made))
    said = (
        "position: deg by size (31.8), doubtful: in rad a joint turns 5.1 times, or it is a motor"
    )
    assert any(doubt.startswith(said) for doubt in found.doubts)
    assert f"# doubtful: {said}" in found.text
