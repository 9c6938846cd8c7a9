"""Signals of a diagnosis: what the gap was taken from, and files that other tools open."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from axisight import Diagnosis, Effect, Log, diagnose, load_robot, read_log, signal_files, simulate
from axisight.cli import app
from axisight.errors import InputError, MissingExtraError
from axisight.logs.sources_bag import load_bag
from axisight.signal_files.first_view import first_view
from import_data import URDF, written
from model_logs import written_log

BARE = URDF.replace('<dynamics damping="0.7" friction="1.5"/>', "")
BARE = BARE[: BARE.index("  <transmission")] + "</robot>"
NAMES = ["measured", "simulated_before", "simulated_after", "residual_before", "residual_after"]


def files(folder: Path) -> list[Path]:
    """A URDF and three logs of a machine with dry friction in its shoulder."""
    path = written(folder, BARE)
    robot = load_robot(path)
    friction = np.array([1.5, 0.0])
    return [
        path,
        *(
            written_log(folder, k, robot, lambda _, v: friction * np.tanh(v / 0.01))
            for k in range(3)
        ),
    ]


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    """The diagnosis of an arm by inverse dynamics."""
    model, *logs = files(tmp_path_factory.mktemp("arm"))
    robot = load_robot(model, sample_time_s=0.01)
    read = [read_log(log, None, robot=robot) for log in logs]
    return diagnose(robot=robot, estimation=read[:2], validation=read[2:], signals=True)


def gap_of(found: Diagnosis, stage: str) -> float:
    """Return the gap on the validation logs by the residuals of the signals."""
    held = [s for s in found.signals if s.attrs["role"] == "validation"]
    squares = [(s[f"residual_{stage}_torque_nm"] ** 2).mean("time_s") for s in held]
    variance = [s["measured_torque_nm"].var("time_s") for s in held]
    return float(np.sqrt(np.mean([s / v for s, v in zip(squares, variance, strict=True)])))


def test_residuals_are_those_of_the_gap(arm: Diagnosis):
    assert [(s.attrs["log"], s.attrs["role"]) for s in arm.signals] == [
        ("run0", "estimation"),
        ("run1", "estimation"),
        ("run2", "validation"),
    ]
    assert arm.mode == "inverse_dynamics"
    assert all(s.attrs["lowpass_hz"] == arm.provenance["cutoff_hz"] for s in arm.signals)
    assert list(arm.signals[0]["joint"].values) == ["shoulder", "elbow"]
    # The gap is relative to the torque as it was logged, the signals are low-passed.
    assert gap_of(arm, "before") == pytest.approx(arm.gap.before, rel=0.01)
    assert gap_of(arm, "after") == pytest.approx(arm.gap.after, rel=0.01)
    assert arm.gap.after < 0.1 * arm.gap.before
    # Inverse dynamics simulates no motion.
    assert not [name for name in arm.signals[0] if re.match("simulated.*position", name)]


def test_viewers_begin_at_the_largest_gap(arm: Diagnosis):
    assert arm.gap.before_per_axis[0] > arm.gap.before_per_axis[1]
    for data in arm.signals:
        np.testing.assert_array_equal(data["gap_before"], arm.gap.before_per_axis)
    found = first_view(arm.signals)
    assert (found.log, found.axis) == (2, 0)
    residual = arm.signals[2]["residual_before_torque_nm"]
    here = residual.sel(time_s=slice(found.start_s, found.stop_s))
    # Dry friction of one size, but at rest and at reversals.
    assert float((here[:, 0] ** 2).mean()) >= float((residual[:, 0] ** 2).mean())


def test_in_closed_loop_they_are_as_logged():
    robot = load_robot("two_mass_axis")
    t = robot.sample_time_s * np.arange(4000)
    machine = Effect("coulomb_friction", 1, {"coulomb_nm": 1.0})
    logs = []
    for k in range(3):
        reference = (
            20 * np.sin(2 * np.pi * (0.7 + 0.4 * k) * t)[:, None] * np.minimum(t, 1)[:, None]
        )
        run = simulate(robot, reference, effects=[machine], noise_seed=k)
        logs.append(
            Log(
                name=f"log{k}",
                sample_time_s=robot.sample_time_s,
                time_s=t,
                torque_nm=run["torque_cmd_nm"].values,
                position_rad=run["position_rad"].values,
                velocity_ref_rad_s=reference,
                source=Path(f"log{k}"),
            )
        )
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:], signals=True)
    assert found.mode == "closed_loop"
    assert "lowpass_hz" not in found.signals[0].attrs
    held = found.signals[2]
    np.testing.assert_array_equal(held["measured_torque_nm"], logs[2].torque_nm)
    np.testing.assert_array_equal(held["measured_position_rad"], logs[2].position_rad)
    # The simulator with the friction of the machine moves as the machine does.
    off = {
        stage: float(
            abs(held[f"simulated_{stage}_position_rad"] - held["measured_position_rad"]).max()
        )
        for stage in ("before", "after")
    }
    assert off["after"] < 0.1 * off["before"]
    assert gap_of(found, "before") == pytest.approx(found.gap.before, rel=1e-9)
    assert gap_of(found, "after") == pytest.approx(found.gap.after, rel=1e-9)


def test_unasked_there_are_none(arm: Diagnosis, tmp_path: Path):
    assert Diagnosis.__dataclass_fields__["signals"].default == ()
    with pytest.raises(InputError, match=r"expected those of diagnose\(\.\.\., signals=True\)"):
        signal_files.write_signals((), tmp_path / "out.parquet")
    assert "signals" not in arm.to_verdict()


def test_a_table_has_every_log(arm: Diagnosis, tmp_path: Path):
    path = signal_files.write_signals(arm.signals, tmp_path / "new" / "out.parquet")
    made = pq.read_table(path)
    names = [*(f"{name}_torque_nm" for name in NAMES), "measured_position_rad"]
    columns = [f"{name}_{axis}" for name in names for axis in (1, 2)]
    assert made.column_names == ["log", "role", "time_s", *columns]
    rows = made.to_pandas()
    for data in arm.signals:
        mine = rows[rows["log"] == data.attrs["log"]]
        assert set(mine["role"]) == {data.attrs["role"]}
        np.testing.assert_array_equal(mine["time_s"], data["time_s"])
        for name in names:
            columns = [f"{name}_{axis}" for axis in (1, 2)]
            np.testing.assert_array_equal(mine[columns], data[name])
    said = json.loads(made.schema.metadata[b"axisight"])
    assert said["joints"] == ["shoulder", "elbow"]
    assert said["units"] == ["Nm", "Nm"]
    assert said["mode"] == "inverse_dynamics"
    assert said["note"] == f"all signals are low-passed at {said['lowpass_hz']:.4g} Hz"


def test_a_recording_has_joint_states(arm: Diagnosis, tmp_path: Path):
    path = signal_files.write_signals(arm.signals, tmp_path / "out.mcap")
    arrays = load_bag(path)
    for data in arm.signals:
        topic = f"{data.attrs['role']}.{data.attrs['log']}"
        for name in NAMES:
            # The hundredths of a second are stamps in whole nanoseconds.
            time = arrays[f"{topic}.{name}.time_s"]
            np.testing.assert_allclose(time, data["time_s"], atol=1e-9)
            for i, joint in enumerate(("shoulder", "elbow")):
                found = arrays[f"{topic}.{name}.effort.{joint}"]
                np.testing.assert_array_equal(found, data[f"{name}_torque_nm"].values[:, i])
        for i, joint in enumerate(("shoulder", "elbow")):
            found = arrays[f"{topic}.measured.position.{joint}"]
            np.testing.assert_array_equal(found, data["measured_position_rad"].values[:, i])


def test_names_of_logs_become_topics(arm: Diagnosis, tmp_path: Path):
    named = [arm.signals[0].assign_attrs(log=name) for name in ("2 März", "2_M_rz", "a")]
    arrays = load_bag(signal_files.write_signals(named, tmp_path / "out.mcap"))
    topics = {name.split(".measured")[0] for name in arrays if ".measured." in name}
    assert topics == {"estimation.log_2_M_rz", "estimation.log_2_M_rz_2", "estimation.a"}


def test_misuse_is_named_before_the_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    there = written(tmp_path, "x", "there.parquet")
    for target, message in (
        (
            tmp_path / "out.csv",
            r"expected \.parquet, \.mcap or \.rrd for signals, got '\.csv'",
        ),
        (there, "exists: choose another name"),
        (there / "out.mcap", "expected a folder to write into"),
    ):
        with pytest.raises(InputError, match=message):
            signal_files.check_target(target)
    signal_files.check_target(there, overwrite=True)
    with pytest.raises(InputError, match="got an input"):
        signal_files.check_target(there, overwrite=True, inputs=[there])
    monkeypatch.setattr("axisight.signal_files.target.find_spec", lambda _: None)
    with pytest.raises(MissingExtraError, match=r"pip install 'axisight\[ros\]'"):
        signal_files.check_target(tmp_path / "out.mcap")
    with pytest.raises(MissingExtraError, match=r"pip install 'axisight\[rerun\]'"):
        signal_files.check_target(tmp_path / "out.rrd")


def test_the_command_writes_them(tmp_path: Path):
    model, *logs = files(tmp_path)
    start = ["diagnose", *map(str, [model, *logs[:2]]), "--validation", str(logs[2]), "--signals"]
    result = CliRunner().invoke(app, [*start, str(logs[0])])
    assert (result.exit_code, "got an input" in " ".join(result.output.split())) == (2, True)
    target, layout = tmp_path / "out.mcap", tmp_path / "out.foxglove.json"
    result = CliRunner().invoke(app, [*start, str(target), "--json", str(layout)])
    assert result.exit_code == 2
    assert "--signals, out.foxglove.json: expected another file" in " ".join(result.output.split())
    result = CliRunner().invoke(app, [*start, str(target), "--max-causes", "1"])
    assert result.exit_code == 0, result.output
    assert f"signals: {target}\nlayout for Foxglove: {layout}\n" in result.output
    assert "validation.run2.measured.effort.elbow" in load_bag(target)
    assert "Largest gap: shoulder in run2" in layout.read_text(encoding="utf-8")
