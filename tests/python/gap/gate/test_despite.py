"""Faults of logs that a diagnosis refuses, and goes on despite where it is asked to."""

from __future__ import annotations

from dataclasses import replace

import jsonschema
import numpy as np
import pytest
from typer.testing import CliRunner

from axisight import Log, Settings, diagnose
from axisight.cli import app
from axisight.errors import InputError
from axisight.gap import check_inputs, verdict_schema
from axisight.gap.facts.faults import MEANINGS, NEEDED, RefusedInputError
from rigid_arm import RATE_HZ, arm, log_of

ROBOT = arm()
LOGS = [log_of(ROBOT, seed, np.zeros(6), np.zeros(6), 20.0) for seed in range(3)]


def without_rows(log: Log) -> Log:
    """Return a log that lost twenty rows in the middle, and was stamped anew."""
    kept = np.r_[0:1000, 1020 : log.n_samples]
    return replace(
        log,
        position_rad=log.position_rad[kept],
        torque_nm=log.torque_nm[kept],
        time_s=np.arange(len(kept)) / RATE_HZ,
    )


def test_a_fault_is_flagged_where_one_goes_on_despite_it() -> None:
    estimation = [without_rows(LOGS[0]), LOGS[1]]
    with pytest.raises(RefusedInputError, match="rows_missing"):
        diagnose(robot=ROBOT, estimation=estimation, validation=LOGS[2:])
    settings = Settings(bootstrap=50, despite=("rows_missing",))
    found = diagnose(robot=ROBOT, estimation=estimation, validation=LOGS[2:], settings=settings)
    (fault,) = [f for f in found.findings if f.name == "rows_missing"]
    assert fault.severity == "flag"
    assert fault.message.endswith("(used all the same, as asked for)")
    verdict = found.to_verdict()
    assert verdict["settings"]["despite"] == ["rows_missing"]
    jsonschema.validate(verdict, verdict_schema())


def test_other_faults_stay_refused() -> None:
    estimation = [without_rows(LOGS[0]), LOGS[1]]
    found = check_inputs(ROBOT, estimation, LOGS[2:], despite=["axes_swapped"])
    assert [(f.name, f.severity) for f in found] == [("rows_missing", "refuse")]
    nothing = check_inputs(ROBOT, LOGS[:2], LOGS[2:], despite=["rows_missing"])
    assert not [f for f in nothing if f.name == "rows_missing"]


@pytest.mark.parametrize("name", ["rows_mising", "rates_differ", "not_finite"])
def test_what_cannot_be_gone_on_despite_is_refused(name: str) -> None:
    with pytest.raises(InputError, match=f"despite: expected names among .*, got '{name}'"):
        check_inputs(ROBOT, LOGS[:2], LOGS[2:], despite=[name])


def test_what_is_needed_has_a_meaning() -> None:
    assert MEANINGS.keys() > NEEDED


def test_the_option_of_the_command_is_for_one_diagnosis(tmp_path) -> None:
    arguments = ["diagnose", "--fleet", str(tmp_path), "--despite", "rows_missing"]
    out = CliRunner().invoke(app, arguments)
    assert out.exit_code != 0
    assert "--despite" in out.output
