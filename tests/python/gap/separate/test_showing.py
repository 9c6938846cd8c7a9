"""The experiment that shows what detection limits leave too coarse: shown where it is there, and within limits."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from axisight import Diagnosis, Effect, InputError, Log, diagnose
from axisight.cli import app
from axisight.excitation import read_references
from axisight.gap import ExperimentLimits
from axisight.gap.facts.experiment import Experiment, ShowingExperiment
from axisight.gap.separate.limits import Range, within_limits
from axisight.gap.separate.waves import seen_range
from gap_data import bare_axis, bare_case, log_of, scattered

MACHINE = scattered(bare_axis(), 4)
# Below what these logs show of it, which is tested.
SIZE = 6e11
HARDER = Effect("nonlinear_stiffness", 1, {"cubic_nm_rad3": SIZE})
LIMITS = ExperimentLimits(velocity_rad_s=10.0, torque_nm=20.0)


def quiet(seed: int, size_rad_s: float = 0.5) -> np.ndarray:
    """A slow motion, that hardly bends the gear."""
    step = MACHINE.sample_time_s
    time = np.arange(round(4 / step)) * step
    lines = np.arange(0.25, 1.0, 0.25)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    wave = np.cos(2 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
    return (np.sin(np.pi / 2 * np.minimum(time, 1.0)) ** 4 * size_rad_s * wave)[:, None]


def logs_of(effects: list[Effect], size_rad_s: float = 0.5) -> list[Log]:
    waves = [quiet(s, size_rad_s) for s in (1, 2, 3)]
    return [log_of(MACHINE, effects, wave, k) for k, wave in enumerate(waves)]


def shown(logs: list[Log], more: list[Log], **asked: object) -> Diagnosis:
    return diagnose(robot=bare_axis(), estimation=[*logs[:2], *more], validation=logs[2:], **asked)


def limit_of(found: Diagnosis) -> float | None:
    return next(x.value for x in found.detection_limits if x.effect == HARDER.name)


@pytest.fixture(scope="module")
def before() -> Diagnosis:
    return shown(logs_of([HARDER]), [], to_show=HARDER, within=LIMITS)


def runs(made: Experiment | None, effects: list[Effect]) -> list[Log]:
    assert made is not None
    reference = made.references.period[0]
    return [log_of(MACHINE, effects, reference, 7 + k) for k in range(made.repeats)]


def test_what_these_logs_do_not_show_is_shown(before: Diagnosis):
    """Recovery from known truth: nothing is named before, the effect and nothing else after."""
    assert before.verdict == "none"
    limit = limit_of(before)
    assert limit is None or limit > SIZE
    made = before.experiment
    assert isinstance(made, ShowingExperiment)
    assert made.decides
    assert before.next_experiment == str(made)
    after = shown(logs_of([HARDER]), runs(made, [HARDER]))
    assert (after.verdict, [c.label for c in after.causes]) == ("explained", [HARDER.label])


def test_a_machine_without_it_is_seen_to_have_less(before: Diagnosis):
    """Oracle: the limit that a diagnosis states once the runs are there is the one that was promised.

    The experiment counts the new runs alone: old ones make it smaller, by what they show, which is next to
    nothing here. A tenth is what sensitivities of the model with the effect and of that without differ by.
    """
    made = before.experiment
    assert isinstance(made, ShowingExperiment)
    after = shown(logs_of([]), runs(made, []))
    assert after.verdict == "none"
    limit = limit_of(after)
    assert limit is not None
    assert limit == pytest.approx(SIZE / made.share, rel=0.1)


def test_it_stays_within_limits(before: Diagnosis):
    made = before.experiment
    assert made is not None
    assert np.abs(made.references.period).max() <= 10.0 * (1 + 1e-9)
    for log in runs(made, [HARDER]):
        assert np.abs(log.torque_nm).max() < 1.05 * 20.0


def test_limits_take_the_place_of_what_was_seen():
    logs = logs_of([])
    seen = seen_range(logs)

    def limited(limits: ExperimentLimits) -> Range:
        return within_limits(seen, limits, bare_axis(), np.zeros(1))

    stated = limited(LIMITS)
    assert seen.speed[0] < 2.0
    assert (stated.speed.tolist(), stated.torque.tolist()) == ([10.0], [20.0])
    assert (stated.back, stated.forth) == (seen.back, seen.forth)
    further = limited(ExperimentLimits(travel_rad=[7.0]))
    assert (further.back.tolist(), further.forth.tolist()) == ([-7.0], [7.0])
    assert (further.speed, further.torque) == (seen.speed, seen.torque)


def test_ten_times_smaller_takes_more_than_there_is():
    tiny = HARDER.with_values({"cubic_nm_rad3": 1e8})
    made = shown(logs_of([]), [], to_show=tiny).experiment
    assert isinstance(made, ShowingExperiment)
    assert not made.decides
    assert str(made).startswith(
        "No motion within the limits of speed, travel and torque shows nonlinear"
    )


def test_what_a_plainer_law_makes_up_for_does_not_show():
    """Closed form: at speeds far below Stribeck's, what friction has in excess there is dry friction."""
    excess = {"excess_nm": 0.05, "smoothing_rad_s": 0.1, "stribeck_speed_rad_s": 1.0}
    slow = Effect("stribeck_friction", 1, excess)
    alike = slow.with_values({"stribeck_speed_rad_s": 500.0})
    seen, hidden = (
        shown(logs_of([]), [], to_show=e, within=LIMITS).experiment for e in (slow, alike)
    )
    assert isinstance(seen, ShowingExperiment)
    assert isinstance(hidden, ShowingExperiment)
    assert seen.share > 2.0
    assert hidden.share < 0.01 * seen.share


def test_what_is_named_already_needs_no_experiment():
    friction = Effect("viscous_friction", 1, {"viscous_nm_s_rad": 0.2})
    found = shown(logs_of([friction]), [], to_show=friction)
    assert [c.label for c in found.causes] == ["viscous_friction@1"]
    assert found.experiment is None
    assert found.next_experiment is not None
    assert "viscous friction on axis 1: these logs show one already" in found.next_experiment


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ({"within": LIMITS}, "within: expected with separate or to_show"),
        ({"to_show": Effect("backlash", 1)}, "to_show: expected backlash@1 of a size"),
        ({"to_show": Effect("backlash", 2, {"half_width_rad": 1e-4})}, "axis"),
        (
            {"separate": True, "within": ExperimentLimits(velocity_rad_s=-1.0)},
            "experiment, velocity_rad_s: expected pos",
        ),
        (
            {"separate": True, "within": ExperimentLimits(torque_nm=[1.0, 2.0])},
            "experiment, torque_nm: expected 1 finite",
        ),
    ],
)
def test_what_is_asked_wrongly_is_refused_before_anything_runs(asked: dict[str, object], says: str):
    with pytest.raises(InputError, match=says):
        shown(logs_of([]), [], progress=refused, **asked)


def refused(what: str, _done: int, _total: int) -> None:
    assert what == "looking at the logs", what


def test_the_command_designs_what_is_to_show(tmp_path: Path):
    case = bare_case(tmp_path / "case", logs_of([]))
    command = ["diagnose", str(case)]
    asked = ["--to-show", "nonlinear_stiffness@1 cubic_nm_rad3=6e11", "--velocity-limit", "10"]
    out = ["--next-experiment", str(tmp_path / "next"), "--torque-limit", "20"]
    alone = CliRunner().invoke(app, [*command, *asked])
    assert alone.exit_code == 2
    assert "--to-show: expected --next-experiment FOLDER beside it" in " ".join(
        alone.output.split()
    )
    done = CliRunner().invoke(app, [*command, *asked, *out])
    assert done.exit_code == 0, done.output
    says = (tmp_path / "next" / "experiment.txt").read_text("utf-8")
    assert "nonlinear stiffness on axis 1 (cubic_nm_rad3 = 6e+11) if it is there" in says
    speed = np.abs(read_references(tmp_path / "next" / "references.parquet").period).max()
    assert speed <= 10.0 * (1 + 1e-9)


@pytest.mark.parametrize("half_width_rad", [2e-7, 1e-6, 4e-6])
def test_play_of_a_gear_that_is_hardly_bent_is_found(half_width_rad: float):
    """Recovery: the largest torque bends this gear by 1.6e-5 rad, a sixth of what other gear laws begin with."""
    play = Effect("backlash", 1, {"half_width_rad": half_width_rad})
    found = shown(logs_of([play]), [])
    assert (found.verdict, [c.label for c in found.causes]) == ("explained", ["backlash@1"])
    value = found.causes[0].parameters["half_width_rad"].value
    assert value == pytest.approx(half_width_rad, rel=0.2)


def test_what_no_colour_of_noise_makes_is_not_nothing():
    """Noise drowns the torque of these logs, but not where they were made to look: a hundred times as much."""
    play = Effect("backlash", 1, {"half_width_rad": 1e-6})
    found = shown(logs_of([play], 0.1), [])
    assert found.gap.before < found.gap.floor
    assert max(a.excess for a in found.axes) > 50.0
    assert found.verdict == "unknown"
    assert shown(logs_of([], 0.1), []).verdict == "none"
