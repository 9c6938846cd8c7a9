"""All faults of a data set are told in one run, the worst first, each with the line that mends it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from axisight.gap import RefusedInputError, check_inputs
from axisight.gap.facts.faults import MEANINGS, Finding
from axisight.gap.gate import pass_gate
from axisight.logs.map_files import parse_column_map
from axisight.logs.mending import mending_line
from spoiled_cases import Case, clean_arm, each, every


def frozen(case: Case) -> Case:
    """Return the case with a position of its second estimation log frozen."""
    log = case.estimation[1]
    position = log.position_rad.copy()
    position[900:1000, 1] = position[900, 1]
    return replace(case, estimation=(case.estimation[0], replace(log, position_rad=position)))


def test_faults_of_rows_and_of_signs_show_in_one_run() -> None:
    case = frozen(every(clean_arm(), "torque_nm", 2, np.negative))
    named = {
        (f.name, f.axis)
        for f in check_inputs(case.robot, case.estimation, case.validation)
        if f.severity == "refuse"
    }
    assert named == {("samples_frozen", 2), ("sign_flipped", 3)}


def test_a_data_set_without_a_sound_log_ends_there() -> None:
    def still(log):
        position = log.position_rad.copy()
        position[900:1000, 1] = position[900, 1]
        return replace(log, position_rad=position)

    case = each(every(clean_arm(), "torque_nm", 2, np.negative), still)
    found = check_inputs(case.robot, case.estimation, case.validation)
    assert {f.name for f in found if f.severity == "refuse"} == {"samples_frozen"}


def test_the_message_has_a_line_for_each_fault_and_what_mends_it() -> None:
    case = frozen(every(clean_arm(), "torque_nm", 2, np.negative))
    with pytest.raises(RefusedInputError) as error:
        pass_gate(case.robot, case.estimation, case.validation)
    lines = str(error.value).splitlines()
    assert [line.partition(":")[0] for line in lines if not line.startswith(" ")] == [
        "samples_frozen",
        "sign_flipped",
    ]
    assert "  column map, axis 3: torque = { ..., sign = -1 }" in lines
    # The same fault of several logs is one line.
    assert "(also in " in str(error.value)


def test_what_rules_out_a_diagnosis_is_first_and_an_unknown_scale_last() -> None:
    names = ("torque_scaled", "sign_flipped", "gravity_flipped", "not_finite")
    axes = (1, 2, None, 3)
    found = tuple(
        Finding(name, "refuse", "expected, got", "run", axis, "torque_cmd")
        for name, axis in zip(names, axes, strict=True)
    )
    told = [line.partition(":")[0] for line in str(RefusedInputError(found)).splitlines()]
    kept = [name for name in told if name in names]
    assert kept == ["not_finite", "gravity_flipped", "sign_flipped", "torque_scaled"]


@pytest.mark.parametrize("name", sorted(MEANINGS))
def test_lines_for_a_column_map_are_ones_that_it_takes(name: str) -> None:
    field = name.partition("_in_")[0].partition("_joint_side")[0]
    column = {"torque": "torque_cmd"}.get(field, field) if name != "sign_flipped" else "torque_cmd"
    line = mending_line(name, 1, f"{column}_1")
    if line is None or not line.startswith("column map, axis 1: "):
        return
    stem, _, inner = line.removeprefix("column map, axis 1: ").partition(" = ")
    keys = inner.strip("{ }").removeprefix("..., ").replace("N", "4096")
    units = {"position": "rad", "torque": "Nm", "velocity_ref": "rad/s"}
    unit = "" if "unit" in keys else f', unit = "{units[stem]}"'
    rest = {k: v for k, v in units.items() if k in ("position", "torque") and k != stem}
    others = "\n".join(f'{k} = {{ name = "b", unit = "{v}" }}' for k, v in rest.items())
    text = f'sample_rate_hz = 100\n[[axis]]\n{stem} = {{ name = "a", {keys}{unit} }}\n{others}\n'
    parse_column_map(text, "columns.toml")


def test_logs_of_several_rates_are_told_the_line_of_one_grid() -> None:
    """Stamps of a host give each log a mean rate of its own."""
    case = clean_arm()
    other = replace(case.validation[0], sample_time_s=1 / 99.0)
    found = check_inputs(case.robot, case.estimation, (other,))
    (fault,) = [f for f in found if f.severity == "refuse"]
    assert fault.name == "sample_time_differs"
    assert case.estimation[0].name in fault.message
    assert "resample_hz = 100 in [time]" in fault.message
