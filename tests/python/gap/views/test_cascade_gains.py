"""Gains of a cascade that is told positions, which nobody knows: fitted beside the simulator's own parameters."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import Robot, Settings, diagnose, load_robot, simulate
from axisight.cli.diagnose import _tolerances
from axisight.errors import InputError, RobotError
from axisight.gap.facts.result import Interval
from axisight.gap.facts.settings import DEFAULT_TOLERANCES
from axisight.gap.simulator.own_parameters import (
    absorbed,
    for_core,
    gain_names,
    uncertain_gains,
    with_values,
)
from axisight.robot_file import Provenance, identified, load_identified, write_identified
from axisight.write_back import write_model
from cascade_arm import PI, SAMPLE_S, Cascade, P, log_of, simulator
from servo_arm import HOME_RAD, MACHINES, NOMINAL, check_unknown_gains, targets

pytest.importorskip("mujoco", reason="MuJoCo comes with the extra `mujoco`")

Array = NDArray[np.float64]
GAINS = ("kv", "kp", "ki")
WIDE = 0.3
UNKNOWN = {**DEFAULT_TOLERANCES, **dict.fromkeys(GAINS, WIDE)}
# Of the stated gains, what the machine's are: a fifth off.
FACTORS = {"kv": (1.2, 0.8, 1.2), "kp": (0.8, 1.2, 0.8), "ki": (1.2, 1.2, 0.8)}
LAWS = {"PI": PI, "P": P}


def own(law: Cascade) -> Cascade:
    """Return the law of a drive with other gains."""
    made = {k: tuple(np.multiply(getattr(law, k), FACTORS[k]).tolist()) for k in GAINS}
    return replace(law, **made)  # type: ignore[arg-type]


def changes(robot: Robot) -> dict[str, float]:
    """Return by what share of the stated ones the gains of `own` are others, by name."""
    return {name: FACTORS[name[3:]][int(name[1]) - 1] - 1 for name in gain_names(robot)}


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return simulator(tmp_path_factory.mktemp("cascade"), NOMINAL, PI)


def positions(robot: Robot) -> Array:
    rate = np.repeat(np.diff(targets(2)[:60], axis=0) * 50.0, round(0.02 / SAMPLE_S), axis=0)
    at_home = robot.with_operating_point(HOME_RAD)
    return np.asarray(simulate(at_home, rate, method="rk4")["position_rad"].values)


@pytest.mark.parametrize("law", LAWS)
def test_changed_gains_are_those_of_a_drive_that_has_them(tmp_path: Path, law: str) -> None:
    stated = simulator(tmp_path, NOMINAL, LAWS[law])
    same = with_values(stated, dict.fromkeys(gain_names(stated), 0.0))
    np.testing.assert_array_equal(positions(same), positions(stated))
    other = positions(simulator(tmp_path, NOMINAL, own(LAWS[law])))
    np.testing.assert_allclose(
        positions(with_values(stated, changes(stated))), other, rtol=0, atol=1e-12
    )
    assert np.abs(other - positions(stated)).max() > 1e-3


def test_a_gain_of_position_is_none_of_controllers_without_one(robot: Robot) -> None:
    """Of the cascade's position loop alone: not the first gain of a law of targets."""
    text = robot.toml.replace("ki = ", "kd = ").replace('"cascade_position"', '"pd_position"')
    text = "\n".join(line for line in text.splitlines() if not line.startswith("kv = "))
    pd = Robot.from_toml(text)
    changed = (
        pd.toml + '\n[[effect]]\nname = "controller_gain"\naxis = 2\nrelative_position = 0.5\n'
    )
    np.testing.assert_array_equal(positions(Robot.from_toml(changed)), positions(pd))


def test_a_fit_has_them_as_effects_behind_the_others(robot: Robot, tmp_path: Path) -> None:
    gains = uncertain_gains(robot, {"kv": WIDE, "j2.ki": 0.1})
    assert [p.name for p in gains] == ["j1.kv", "j2.kv", "j2.ki", "j3.kv"]
    assert (gains[0].lower, gains[0].upper, gains[0].prior) == (-0.95, 4 * WIDE, (0.0, WIDE))
    effects, parameters = for_core(robot, [], gains)
    assert [e.label for e in effects] == [f"controller_gain@{i}" for i in (1, 2, 3)]
    position = "relative_position"
    assert [(p.effect, p.name) for p in parameters] == [
        (0, position), (1, position), (1, "relative_integral"), (2, position),
    ]  # fmt: skip
    assert absorbed(robot, gains) == {e.label for e in effects}
    # A speed loop without an integral has no gain of it.
    plain = simulator(tmp_path, NOMINAL, replace(PI, ki=(1500.0, 0.0, 0.0)))
    names = [f"j{i}.{gain}" for i in (1, 2, 3) for gain in ("kv", "kp", "ki")]
    assert gain_names(plain) == [name for name in names if name not in ("j2.ki", "j3.ki")]
    assert [p.name for p in uncertain_gains(plain, {"ki": WIDE})] == ["j1.ki"]


@pytest.mark.parametrize(("law", "lacks"), [("PI", "coulomb_friction@2"), ("P", None)])
def test_unknown_gains_are_found_beside_what_lacks(
    tmp_path: Path, law: str, lacks: str | None
) -> None:
    """A fifth off, with or without an integral; six or nine gains are no cause, dry friction is."""
    robot = simulator(tmp_path, NOMINAL, LAWS[law])
    arm = NOMINAL if lacks is None else MACHINES[lacks]
    logs = [log_of(arm, own(LAWS[law]), run) for run in (1, 2, 3)]
    settings = Settings(tolerances=UNKNOWN)
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:], settings=settings)
    check_unknown_gains(found, lacks, changes(robot))


@pytest.mark.parametrize(
    ("law", "gain", "name"),
    [
        ("PI", "kv", "relative_position"),
        ("PI", "kp", "relative_proportional"),
        ("P", "kv", "relative_position"),
    ],
)
def test_another_gain_is_a_cause_where_it_is_known(
    tmp_path: Path, law: str, gain: str, name: str
) -> None:
    """Of three that are looked for, those that are as stated are no cost of it."""
    first, second, third = getattr(LAWS[law], gain)
    other = replace(LAWS[law], **{gain: (first, second, 0.8 * third)})
    logs = [log_of(NOMINAL, other, run) for run in (90, 91, 92)]
    robot = simulator(tmp_path, NOMINAL, LAWS[law])
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    assert found.verdict == "explained"
    assert [c.label for c in found.causes] == ["controller_gain@3"]
    for parameter, change in found.causes[0].parameters.items():
        truth = -0.2 if parameter == name else 0.0
        assert change.low < truth < change.high
        assert change.high - change.low < 0.2


def test_a_gain_beyond_its_tolerance_is_told(robot: Robot) -> None:
    """Off by more than three tolerances, as other parameters: found, and the tolerance called wrong."""
    law = replace(PI, kv=(14.0, 14.0, 0.8 * 14.0))
    logs = [log_of(NOMINAL, law, run) for run in (1, 2, 3)]
    settings = Settings(tolerances={**UNKNOWN, "kv": 0.06})
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:], settings=settings)
    assert (found.verdict, found.causes) == ("none", ())
    for name in gain_names(robot):
        assert found.refit[name].value == pytest.approx(-0.2 if name == "j3.kv" else 0.0, abs=0.03)
    assert [(f.name, f.field) for f in found.findings] == [("parameter_at_edge", "j3.kv")]


def test_robot_files_and_drive_data_state_their_tolerance(robot: Robot, tmp_path: Path) -> None:
    stated = dict.fromkeys(GAINS, WIDE)
    table = "[tolerances]\n" + "".join(f"{k} = {x}\n" for k, x in stated.items())
    assert Robot.from_toml(f"{robot.toml}\n{table}").tolerances == stated
    simulator(tmp_path, NOMINAL, PI)
    drives = tmp_path / "arm.drives.toml"
    drives.write_text(f"{drives.read_text()}\n{table}")
    arm = load_robot(tmp_path / "arm.xml", sample_time_s=0.02)
    assert arm.tolerances == stated
    assert Settings().tolerances_of(arm) == UNKNOWN


@pytest.mark.parametrize(
    ("law", "stated", "named"),
    [
        (PI, "kv = 0.0", r"tolerances\.kv.*positive"),
        (PI, "kv = -0.1", r"tolerances\.kv.*positive"),
        (PI, "ki = [0.3, 0.3, 0.3]", r"tolerances\.ki.*number"),
        (PI, "kd = 0.3", r"tolerances\.kd"),
        (P, "ki = 0.3", r"tolerances\.ki"),
    ],
)
def test_a_bad_tolerance_is_refused_by_name(
    tmp_path: Path, law: Cascade, stated: str, named: str
) -> None:
    text = simulator(tmp_path, NOMINAL, law).toml
    with pytest.raises(RobotError, match=named):
        Robot.from_toml(f"{text}\n[tolerances]\n{stated}\n")


def test_gains_of_a_cascade_that_is_told_speeds_have_none(robot: Robot) -> None:
    text = robot.toml.replace("velocity_feedforward = false\n", "")
    text = text.replace('"cascade_position"', '"cascade"')
    assert gain_names(Robot.from_toml(text)) == []
    with pytest.raises(RobotError, match=r"tolerances\.kv"):
        Robot.from_toml(f"{text}\n[tolerances]\nkv = 0.3\n")


def test_options_and_settings_are_refused_by_name(robot: Robot, tmp_path: Path) -> None:
    assert _tolerances(["kv=0.5", "j3.ki=0.3"], robot) == {"kv": 0.5, "j3.ki": 0.3}
    with pytest.raises(InputError, match="kv, kp, ki, or one of a joint"):
        _tolerances(["kd=0.5"], robot)
    with pytest.raises(InputError, match="--tolerance kv: expected a share between 0 and 1"):
        _tolerances(["kv=-0.5"], robot)
    with pytest.raises(InputError, match="kv, kp, or one of a joint"):
        _tolerances(["ki=0.5"], simulator(tmp_path, NOMINAL, P))
    with pytest.raises(InputError, match=r"tolerances: j1\.kv: expected a positive number"):
        uncertain_gains(robot, {"kv": -0.3})


def test_found_gains_are_written_back(robot: Robot, tmp_path: Path) -> None:
    """Into a robot file, which reads as the drive's; a model file has no place for a cascade."""
    refit = {k: Interval(x, x - 0.0196, x + 0.0196) for k, x in changes(robot).items()}
    made = write_model(tmp_path / "arm.xml", robot, [], tmp_path / "new.toml", refit=refit)
    assert made.placed == tuple(refit)
    again = load_robot(made.path)
    for key in GAINS:
        np.testing.assert_allclose(again.controller_gains[key], getattr(own(PI), key))
    assert again.parameters() == robot.parameters()
    np.testing.assert_allclose(
        load_identified(made.path).standard_errors,
        0.01 * np.ravel([[getattr(PI, k)[i] for k in GAINS] for i in range(3)]),
    )
    text = made.path.read_text()
    assert "# identified: j1.kv = 16.8 1/s, standard error 0.14 (0.83 %), before 14" in text
    assert "# identified: j2.kp = 132 Nm s/rad," in text
    assert "# identified: j3.ki = 280 Nm/rad," in text
    simulator(tmp_path, NOMINAL, PI)
    source = tmp_path / "arm.xml"
    made = write_model(source, load_robot(source), [], tmp_path / "new.xml", refit=refit)
    reason = "the controller stands in the drive data, the file has no gains of it"
    assert made.why == dict.fromkeys(refit, reason)
    assert made.path.read_bytes() == source.read_bytes()


def test_an_integral_that_is_not_stated_has_no_place(robot: Robot, tmp_path: Path) -> None:
    lines = robot.toml.splitlines()
    bare = Robot.from_toml("\n".join(line for line in lines if not line.startswith("ki = ")))
    found = identified({"j1.ki": 1500.0}, Provenance("by hand"))
    with pytest.raises(InputError, match=r"expected parameters among .*got 'j1\.ki'"):
        write_identified(bare, tmp_path / "new.toml", found)
