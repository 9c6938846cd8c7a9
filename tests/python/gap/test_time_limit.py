"""A diagnosis whose time is up: what was found by then, said as such, whenever the search stops."""

import itertools
import math
from functools import cache

import jsonschema
import pytest
from typer.testing import CliRunner

from axisight import Effect, Log, Settings, diagnose
from axisight.cli import app
from axisight.errors import InputError
from axisight.gap import Diagnosis, verdict_schema
from axisight.gap.facts.trace import STAGES
from gap_data import HELD, PLAN, bare_axis, bare_case, logs_of, scattered
from rigid_arm import arm, log_of

FRICTION = [
    Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.05}),
    Effect("backlash", 1, {"half_width_rad": 2e-4}),
]


@cache
def loop_logs() -> tuple[list[Log], list[Log]]:
    machine = scattered(bare_axis(), 4)
    return logs_of(machine, FRICTION, PLAN), logs_of(machine, FRICTION, HELD)


@cache
def arm_logs() -> list[Log]:
    return [log_of(arm(), seed, seconds=12.0) for seed in (1, 2, 3)]


def in_loop(limit: float) -> Diagnosis:
    fitted, held = loop_logs()
    settings = Settings(bootstrap=20, threads=1, time_limit_s=limit)
    return diagnose(robot=bare_axis(), estimation=fitted, validation=held, settings=settings)


def of_arm(limit: float) -> Diagnosis:
    *fitted, held = arm_logs()
    settings = Settings(bootstrap=20, threads=1, time_limit_s=limit)
    return diagnose(robot=arm(), estimation=fitted, validation=held, settings=settings)


@pytest.fixture
def counting(monkeypatch):
    """A clock that moves on by one second whenever a fit or an evaluation asks for the time."""
    ticks = itertools.count()
    monkeypatch.setattr("axisight.gap.fit.time_limit._now_s", lambda: float(next(ticks)))


def without_times(found: Diagnosis) -> dict:
    out = found.to_verdict()
    del out["provenance"]["seconds"]
    return out


def test_a_limit_that_is_not_reached_changes_nothing():
    free = in_loop(math.inf)
    assert free.trace.stopped is None and free.verdict == "explained"
    assert without_times(in_loop(1e6)) == without_times(free)


@pytest.mark.usefixtures("counting")
@pytest.mark.parametrize(
    ("run", "evaluations", "stage"),
    [
        (in_loop, 1, "screening"),
        (in_loop, 110, "fitting"),
        (of_arm, 5, "screening"),
    ],
)
def test_wherever_it_stops_it_says_so_and_claims_no_explanation(run, evaluations, stage):
    found = run(float(evaluations))
    stop = found.trace.stopped
    assert (stop.limit_s, stop.stage) == (evaluations, stage) and stage in STAGES
    assert found.verdict == "unknown" and found.p_unknown == (0.95 if stop.causes else 1.0)
    assert found.headline.startswith(stop.words) and "--time-limit" in found.next_experiment
    jsonschema.validate(found.to_verdict(), verdict_schema())


@pytest.mark.usefixtures("counting")
def test_causes_of_finished_rounds_are_kept():
    """The first round adds the friction of all axes. The second, which finds no more, is cut short."""
    found = of_arm(5.0)
    assert found.trace.stopped.round == 2 and len(found.trace.stopped.causes) == 12
    assert "with 12 causes found" in found.headline and found.verdict == "unknown"
    jsonschema.validate(found.to_verdict(), verdict_schema())


@pytest.mark.parametrize("limit", [0.0, -1.0, math.nan, "60", True])
def test_a_limit_that_is_none_is_refused(limit):
    with pytest.raises(InputError, match="time_limit_s: expected more than 0 s"):
        in_loop(limit)


def test_the_command_line_stops_and_says_so(tmp_path):
    case = bare_case(tmp_path / "case", loop_logs()[0])
    page, verdict = tmp_path / "report.html", tmp_path / "verdict.json"
    given = ["diagnose", str(case), "--report", str(page), "--json", str(verdict)]
    shown = CliRunner().invoke(app, [*given, "--time-limit", "1e-6"])
    assert shown.exit_code == 0, shown.output
    assert "The search stopped at its time limit of 1e-06 s" in " ".join(shown.output.split())
    assert "stopped at its time limit" in page.read_text("utf-8")
    refused = CliRunner().invoke(app, [*given, "--force", "--time-limit", "0"])
    assert refused.exit_code == 2 and "expected more than 0 s" in refused.output
