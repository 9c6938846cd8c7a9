"""Plausible mistakes are refused or flagged by their name before a diagnosis, and nothing else is."""

import importlib.util
import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import wrong_inputs  # noqa: F401 (enters its mistakes into the table)
from axisight import (
    Effect,
    Log,
    Robot,
    Settings,
    diagnose,
    load_robot,
    read_case,
    read_log,
    simulate,
)
from axisight.cli import app
from axisight.cli.identify_common import read_logs
from axisight.errors import CaseError, InputError, LogError
from axisight.gap import RefusedInputError, check_fit_inputs, check_inputs
from axisight.gap.facts.faults import MEANINGS
from axisight.gap.gate.log_only import check_log_alone
from axisight.gap.intake.inputs import read_inputs
from axisight.gap.prepare.used_part import Used
from rigid_arm import COULOMB_NM, VISCOUS, arm, log_of
from spoiled_cases import TABLE, Case, clean_arm, clean_loop, each, late, loop_case
from wrong_files import write_case

CLEAN = {"loop": clean_loop, "arm": clean_arm}
GATE = [m for m in TABLE if m.kind != "file"]
FILES = [m for m in TABLE if m.kind == "file"]


def found(case: Case):
    return check_inputs(case.robot, case.estimation, case.validation)


def refusals(case: Case) -> list[str]:
    return [str(f) for f in found(case) if f.severity == "refuse"]


# Mistakes.


def test_the_table_has_all_kinds():
    assert len(TABLE) >= 43
    assert len({m.id for m in TABLE}) == len(TABLE)
    assert {m.name for m in TABLE} <= MEANINGS.keys() | {"rates_differ"}


@pytest.mark.parametrize("mistake", GATE, ids=lambda m: m.id)
def test_a_mistake_is_named(mistake):
    findings = found(mistake.spoil(CLEAN[mistake.kind]()))
    seen = [(f.name, f.severity, f.axis) for f in findings]
    of_the_name = [f for f in findings if (f.name, f.severity) == (mistake.name, mistake.severity)]
    assert of_the_name, seen
    if mistake.severity == "flag":
        # A position that rests at its limit and comes back with a jump stood still, too.
        also = {"samples_frozen"} if mistake.name == "position_clipped" else set()
        assert {f.name for f in findings if f.severity == "refuse"} <= also, seen
    if mistake.axis is not None:
        assert mistake.axis in {f.axis for f in of_the_name}, seen
    for finding in findings:
        assert finding.name in MEANINGS
        assert finding.field
        assert str(finding).startswith(f"{finding.name}: ")


@pytest.mark.parametrize("mistake", FILES, ids=lambda m: m.id)
def test_a_mistake_in_files_is_named(mistake, tmp_path):
    folder = write_case(clean_loop(), tmp_path / "case")
    mistake.spoil(folder)
    with pytest.raises(InputError) as error:
        read = read_inputs([folder], None, [], None)
        diagnose(robot=read.robot, estimation=read.estimation, validation=read.validation)
    names = re.findall(r"\[(\w+)\]", str(error.value)) or str(error.value).split(":")[:1]
    assert mistake.name in names, str(error.value)


def test_milliseconds_in_one_file_are_asked_for(tmp_path):
    folder = write_case(clean_loop(), tmp_path / "case")
    next(m for m in FILES if m.spoil.__name__ == "one_file_in_milliseconds").spoil(folder)
    with pytest.raises(LogError, match="time in ms"):
        read_case(folder)


# Through the whole diagnosis.


@pytest.mark.parametrize(
    "name",
    ["position_in_degrees", "torques_swapped", "one_glitch_of_a_position", "gravity_upwards"],
)
def test_a_diagnosis_refuses_by_name(name):
    mistake = next(m for m in GATE if m.spoil.__name__ == name)
    case = mistake.spoil(clean_loop())
    with pytest.raises(RefusedInputError, match=mistake.name) as error:
        diagnose(robot=case.robot, estimation=case.estimation, validation=case.validation)
    assert isinstance(error.value, CaseError) and isinstance(error.value, LogError)
    assert mistake.name in {f.name for f in error.value.findings}
    assert "expected" in str(error.value) and "got" in str(error.value)


def test_a_flag_is_in_diagnosis_and_verdict():
    mistake = next(m for m in GATE if m.spoil.__name__ == "zero_of_one_axis_off_arm")
    case = mistake.spoil(clean_arm())
    settings = Settings(bootstrap=20, max_causes=1)
    out = diagnose(
        robot=case.robot, estimation=case.estimation, validation=case.validation, settings=settings
    )
    assert "position_offset" in {finding.name for finding in out.findings}
    (entry,) = [f for f in out.to_verdict()["findings"] if f["name"] == "position_offset"]
    assert entry["axis"] == 2 and entry["severity"] == "flag"


@pytest.mark.parametrize("name", ["files_in_millinewtonmetres", "truncated_file"])
def test_the_command_refuses_with_status_2(name, tmp_path):
    mistake = next(m for m in FILES if m.spoil.__name__ == name)
    folder = write_case(clean_loop(), tmp_path / "case")
    mistake.spoil(folder)
    out = tmp_path / "verdict.json"
    result = CliRunner().invoke(app, ["diagnose", str(folder), "--json", str(out)])
    assert result.exit_code == 2, result.output
    assert mistake.name in result.output
    assert not out.exists()


def test_check_and_identify_know_rows(tmp_path):
    spoil = next(m for m in GATE if m.spoil.__name__ == "position_frozen_for_200_ms").spoil
    folder = write_case(spoil(clean_loop()), tmp_path / "case")
    log = str(folder / "logs" / "multisine_0.parquet")
    checked = CliRunner().invoke(app, ["check", log])
    assert checked.exit_code == 1
    assert "stood still" in " ".join(checked.output.split())
    robot = str(folder / "robot.toml")
    identified = CliRunner().invoke(app, ["identify", "rigid-body", robot, log])
    assert identified.exit_code == 2
    text = " ".join(identified.output.split())
    assert "samples_frozen: multisine_0: position_2: " in text and "stood still" in text
    axis = ["identify", "axis", log, log, "--robot", robot, "--axis", "2"]
    identified = CliRunner().invoke(app, axis)
    assert identified.exit_code == 2
    assert "samples_frozen" in identified.output


@pytest.mark.parametrize("mistake", GATE, ids=lambda m: m.id)
def test_a_log_to_fit_to_is_looked_at_for_itself(mistake):
    """What shows without a simulator has the same name as in a diagnosis."""
    case = mistake.spoil(CLEAN[mistake.kind]())
    alone = {(f.name, f.severity) for f in check_fit_inputs(case.robot, case.logs)}
    by_rows = "rows_ samples_ not_ channel_ torque_sat position_spike position_wr position_cl gear"
    if mistake.name.startswith(tuple(by_rows.split())):
        assert (mistake.name, mistake.severity) in alone, alone
    names = {name for name, severity in alone if severity == "refuse"}
    assert names <= {f.name for f in found(case)} | {"log_repeated"}


def test_part_of_a_log_is_judged_by_itself(tmp_path):
    """The advice to cut the log where a channel stood still can be followed."""
    spoil = next(m for m in GATE if m.spoil.__name__ == "position_frozen_for_200_ms").spoil
    folder = write_case(spoil(clean_loop()), tmp_path / "case")
    log = folder / "logs" / "multisine_0.parquet"
    columns, robot = None, load_robot(folder / "robot.toml")
    (whole,) = read_logs([log], columns, robot, unchecked=True)
    assert {f.name for f in check_fit_inputs(robot, [whole])} == {"samples_frozen"}
    until = next(f for f in check_fit_inputs(robot, [whole])).message
    begin = float(re.search(r"from (\S+) s on", until)[1])
    (part,) = read_logs([log], columns, robot, unchecked=False, used=Used(0.0, begin - 0.1))
    assert check_fit_inputs(robot, [part]) == ()


@pytest.mark.parametrize("kind", CLEAN)
def test_clean_logs_to_fit_to_pass_without_a_word(kind):
    case = CLEAN[kind]()
    assert check_fit_inputs(case.robot, case.logs) == ()
    assert check_fit_inputs(None, case.logs) == ()


# No false alarms.


@pytest.mark.parametrize("kind", CLEAN)
def test_clean_cases_pass_without_a_word(kind):
    assert found(CLEAN[kind]()) == ()


LARGE = [
    Effect("coulomb_friction", 2, {"coulomb_nm": 8.0, "smoothing_rad_s": 0.05}),
    Effect("stribeck_friction", 3, {"coulomb_nm": 3.0, "excess_nm": 3.0}),
    Effect("presliding_friction", 2, {"coulomb_nm": 5.0}),
    Effect("viscous_friction", 1, {"viscous_nm_s_rad": 0.2}),
    Effect("load_dependent_friction", 2, {"coefficient": 0.3}),
    Effect("payload", None, {"mass_kg": 250.0, "x_m": 1.0, "y_m": 0.0, "z_m": 0.0}),
    Effect("backlash", 2, {"half_width_rad": 1e-3}),
    Effect("joint_stiffness", 1, {"relative_change": -0.5}),
    Effect("input_delay", 2, {"delay_s": 1e-3}),
    Effect("actuator_bandwidth", 1, {"time_constant_s": 2e-3}),
    Effect("resolver_ripple", 1, {"order_1": 2.0, "cosine_1_rad": 3e-3, "sine_1_rad": 1e-3}),
    Effect("torque_ripple", 1, {"order_1": 6.0, "cosine_1_nm": 2.0}),
    Effect("transmission_error", 3, {"order": 2.0, "cosine_rad": 3e-4}),
    Effect("torque_constant", 2, {"relative_error": -0.2}),
    Effect("torque_offset", 3, {"offset_nm": 5.0}),
    Effect("gravity_compensation", 2, {"sine_nm": 3000.0, "cosine_nm": -3000.0}),
    Effect("torque_saturation", 1, {"limit_nm": 8.0}),
]


def without_references(case: Case) -> Case:
    return each(case, lambda log: replace(log, velocity_ref_rad_s=None))


@pytest.mark.parametrize("effect", LARGE, ids=lambda e: e.name)
def test_large_effects_pass(effect):
    case = loop_case((effect,), seed=2)
    for seen in (case, without_references(case)):
        findings = found(seen)
        assert not [f for f in findings if f.severity == "refuse"]
        # A limit shows in the log; nothing else does.
        assert {f.name for f in findings} <= {"torque_saturated"}


def other_controller(robot: Robot, kp: float, ki: float) -> Robot:
    """Return the robot with other gains than its file states."""
    gains = robot.controller_gains
    text = re.sub(r"kp = \[.*\]", f"kp = {(gains['kp'] * kp).tolist()}", robot.toml)
    return Robot.from_toml(re.sub(r"ki = \[.*\]", f"ki = {(gains['ki'] * ki).tolist()}", text))


@pytest.mark.parametrize(("kp", "ki"), [(2.0, 1.0), (0.5, 1.0), (1.0, 3.0), (1.0, 0.3), (0.7, 2.0)])
def test_a_machine_with_other_gains_is_not_refused(kp, ki):
    case = clean_loop()
    machine = other_controller(case.robot, kp, ki)

    def rerun(log):
        out = simulate(machine, log.velocity_ref_rad_s, noise_seed=1, method="rk4")
        torque, position = out.torque_cmd_nm.values, out.position_rad.values
        return replace(log, torque_nm=torque, position_rad=position)

    # Runs of one seed have the noise in common, not the references.
    findings = found(each(case, rerun))
    assert not [str(f) for f in findings if f.severity == "refuse"]


def test_an_axis_that_stands_is_nowhere_late():
    """What settles at the start of a log leaves the law once a shift has cut the start off."""

    def rerun(log):
        reference = log.velocity_ref_rad_s.copy()
        reference[:, 0] = 0.0
        out = simulate(clean_loop().robot, reference, noise_seed=1, method="rk4")
        torque = out.torque_cmd_nm.values.copy()
        n = round(0.02 / log.sample_time_s)
        torque[:n, 0] += 3 * torque[:, 0].std() * np.linspace(1, 0, n)
        position = out.position_rad.values
        return replace(log, velocity_ref_rad_s=reference, torque_nm=torque, position_rad=position)

    assert not [f for f in found(each(clean_loop(), rerun)) if f.name == "axis_delayed"]


def test_a_cascade_has_its_own_law():
    case = clean_loop()
    gains = case.robot.controller_gains
    text = case.robot.toml.replace('"pi_velocity"', '"cascade"')
    text = re.sub(
        r"ki = \[.*\]", f"ki = {(5 * gains['ki']).tolist()}\nkv = [20.0, 20.0, 20.0]", text
    )
    robot = Robot.from_toml(text)

    def rerun(log):
        out = simulate(robot, log.velocity_ref_rad_s, noise_seed=1, method="rk4")
        torque, position = out.torque_cmd_nm.values, out.position_rad.values
        return replace(log, torque_nm=torque, position_rad=position)

    cascade = replace(each(case, rerun), robot=robot)
    assert found(cascade) == ()
    shifted = each(cascade, lambda log: late(log, 41, None, "torque_nm"))
    named = {(f.name, f.severity) for f in found(shifted)}
    assert ("time_shifted", "refuse") in named


def test_a_drive_that_filters_its_torque_passes():
    def filtered(log):
        step = 80 / 4096
        share = 1 - np.exp(-2 * np.pi * 300 * log.sample_time_s)
        torque = log.torque_nm.copy()
        for k in range(1, len(torque)):
            torque[k] = torque[k - 1] + share * (log.torque_nm[k] - torque[k - 1])
        return replace(log, torque_nm=np.round(torque / step) * step)

    assert found(each(clean_loop(), filtered)) == ()


@pytest.mark.parametrize("bits", [9, 10, 12, 14, 16, 20])
def test_an_encoder_of_few_bits_is_no_frozen_channel(bits):
    step = 2 * np.pi / 2**bits

    def coarse(log):
        return replace(log, position_rad=np.round(log.position_rad / step) * step)

    assert not refusals(each(clean_loop(), coarse))


def test_numbers_of_few_digits_are_no_jumps():
    """Five digits, as text files have them: steps grow tenfold where a position passes 100 rad."""

    def written(log):
        turned = log.position_rad + np.array([98.0, -101.0, 99.5])
        digits = 4 - np.floor(np.log10(np.abs(turned)))
        return replace(log, position_rad=np.round(turned * 10**digits) / 10**digits)

    named = {f.name for f in found(each(without_references(clean_loop()), written))}
    assert not named & {"rows_missing", "rows_shuffled", "rows_repeated", "position_jumps"}
    assert not named & {"samples_frozen", "position_spike"}


ARMS = {
    "friction threefold": (1.0, 0.0, 3.0),
    "no friction": (1.0, 0.0, 0.0),
    "masses a fifth larger": (1.2, 0.0, 1.0),
    "payload of a tenth of the arm": (1.0, 3.0, 1.0),
}


@pytest.mark.parametrize("name", ARMS)
def test_large_effects_of_an_arm_pass(name):
    masses, payload_kg, friction = ARMS[name]
    own = arm().parameters()
    values = {n: v * masses for n, v in own.items() if n.endswith(".mass")}
    machine = arm().with_parameters({**values, "j6.mass": values["j6.mass"] + payload_kg})
    coulomb, viscous = friction * np.array(COULOMB_NM), friction * np.array(VISCOUS)
    logs = tuple(log_of(machine, seed, coulomb, viscous, seconds=20.0) for seed in range(3))
    assert found(Case(arm(), logs[:2], logs[2:])) == ()


PRACTICE = ["09001", "09002", "09003", "09005", "09011", "09012", "09013", "09014", "09015"]


@pytest.mark.parametrize("number", PRACTICE)
def test_practice_cases_pass(shared, number):
    folder = shared / "cases" / f"case_{number}"
    if not folder.is_dir():
        pytest.skip(f"no practice case {number}")
    read = read_inputs([folder], None, [], None)
    case = Case(read.robot, read.estimation, read.validation)
    assert {f.name for f in found(case)} <= {"torque_saturated"}
    assert not refusals(case)
    assert {f.name for f in found(without_references(case))} <= {"torque_saturated"}


def test_irregular_stamps_that_were_interpolated_are_no_fault_of_rows():
    def interpolated(log):
        # An axis that creeps over a coarse encoder, between two stamps by straight lines.
        counts = 7e-4 * np.round(0.02 * log.time_s[:, None] * np.ones(3) / 7e-4)
        own = np.arange(0.0, log.duration_s, 3.1 * log.sample_time_s)
        held = np.column_stack(
            [np.interp(log.time_s, own, np.interp(own, log.time_s, c)) for c in counts.T]
        )
        return replace(log, position_rad=held, notes=("resampled linearly from 9 stamps",))

    logs = each(without_references(clean_loop()), interpolated).logs
    assert not [f for log in logs for f in check_log_alone(log) if f.severity == "refuse"]


# Real machines.


def test_real_machines_are_not_refused(shared_data, repository):
    examples = repository / "examples"
    robot = load_robot(examples / "emps/robot.toml")
    names = ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")
    columns = examples / "emps/columns.toml"
    first, second = (read_log(shared_data / "emps" / name, columns) for name in names)
    assert check_inputs(robot, [first], [second]) == ()
    spec = importlib.util.spec_from_file_location("rigid_run", examples / "rigid_body/run.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclass looks its module up
    spec.loader.exec_module(module)

    def log_of_record(record):
        n, step = len(record.torque_nm), record.sample_time_s
        # Motor angles of the gears alone: a coupling of axes has no place in a robot file.
        motor = record.position_rad / record.robot.gear_ratio
        name = record.name
        return Log(
            name=name, source=Path(name), sample_time_s=step, time_s=step * np.arange(n),
            torque_nm=record.torque_nm, position_rad=motor,
        )  # fmt: skip

    tx40 = module.read_tx40(shared_data / "staubli_tx40")
    whole = log_of_record(tx40)
    assert check_inputs(tx40.robot, [whole.part(0.0, 5.0)], [whole.part(5.0)]) == ()
    runs = [module.read_kr300(shared_data / "kuka_kr300", run) for run in "ABC"]
    logs = [log_of_record(run) for run in runs]
    # A counterbalance carries two thirds of the load of axis 2; the robot file has none.
    noted = check_inputs(runs[0].robot, logs[:2], logs[2:])
    assert {(f.name, f.severity, f.axis) for f in noted} == {("torque_scaled", "flag", 2)}


# The page.


def test_every_name_is_on_the_page(repository):
    page = (repository / "docs" / "refused.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \| ([^|]*) \|", page, re.MULTILINE))
    assert rows.keys() == MEANINGS.keys()
    for name, meaning in MEANINGS.items():
        assert rows[name].strip() == meaning


def test_files_of_a_case_stay(tmp_path):
    folder = write_case(clean_loop(), tmp_path / "case")
    before = {p: p.read_bytes() for p in Path(folder).rglob("*") if p.is_file()}
    read = read_inputs([folder], None, [], None)
    assert check_inputs(read.robot, read.estimation, read.validation) == ()
    assert {p: p.read_bytes() for p in before} == before
    shutil.rmtree(folder)
