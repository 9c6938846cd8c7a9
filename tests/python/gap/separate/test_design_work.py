"""The work of a design, counted: what rivals share is computed once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from axisight import Diagnosis, diagnose, load_robot
from axisight.gap.facts.axis_names import placed
from axisight.gap.facts.experiment import SeparatingExperiment
from axisight.gap.separate import asked, design
from axisight.gap.separate.rivals import Rivals
from axisight.gap.separate.route import Route


@pytest.fixture(scope="module", autouse=True)
def benches(request: pytest.FixtureRequest) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(request.config.rootpath / "benches"))
        yield


def test_a_design_on_six_axes_computes_what_rivals_share_once() -> None:
    """Counts, not seconds: of three rivals, each plays the machine along every motion once.

    A fit for each pair, and one without the rivals for each machine: nine for all motions together, and nine for each
    of seven finalists. A third of them compute the sensitivities to the arm's own parameters.
    """
    import next_experiment_six_axes as bench  # noqa: PLC0415 - a bench, on the path just now

    found, cost, _ = bench.run("inverse dynamics")
    made = found.experiment
    assert isinstance(made, SeparatingExperiment)
    rivals = len(made.rivals)
    assert rivals == 3
    # Three shapes of sums at three levels, three other shapes at three levels, slow triangles at two: on axis 2 alone
    # and on all axes, beside the usual motion; and three rounds of six variants where a sum of sines is best.
    motions = 2 * (3 * 3 + 3 * 3 + 2) + 1
    assert cost.motions in (rivals * motions, rivals * (motions + 3 * 6))
    rounds = 1 + 3 * (cost.motions > rivals * motions)
    groups = rounds + 7
    assert cost.fits <= groups * rivals * rivals
    assert cost.whole_fits <= groups * rivals


def run(bench: ModuleType, name: str, folder: Path) -> Diagnosis:
    row = bench.ROWS[name]
    path = folder / "arm.xml"
    path.write_text(bench.Machine().mjcf(), "utf-8")
    robot = load_robot(path, sample_time_s=1 / bench.RATE_HZ)
    logs = [
        row.machine.log(row.course(k), k, with_targets=row.with_targets, cut_s=row.cut_s)
        for k in (1, 2, 3)
    ]
    return diagnose(
        robot=robot, estimation=logs[:2], validation=logs[2:], separate=True, within=bench.FREE
    )


@pytest.mark.parametrize("name", ["offset, drag", "cable, spring of gravity, targets, axis 2"])
def test_shared_sensitivities_change_no_design(
    name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Oracle: every fit with its own sensitivities.

    Own parameters move within tolerances of some per cent, and sensitivities with them; a log-likelihood ratio is a
    second-order effect of that. The number of runs and the motion stay.
    """
    pytest.importorskip("mujoco")
    import next_experiment_targets as bench  # noqa: PLC0415 - a bench, on the path just now

    shared = run(bench, name, tmp_path).experiment
    own = design._Compared.left

    def alone(self: design._Compared, *given: object) -> object:
        self._own = {}
        return own(self, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(design._Compared, "left", alone)
    fresh = run(bench, name, tmp_path).experiment
    assert isinstance(shared, SeparatingExperiment)
    assert isinstance(fresh, SeparatingExperiment)
    assert (str(shared.plan), shared.repeats) == (str(fresh.plan), fresh.repeats)
    assert shared.log_ratio == pytest.approx(fresh.log_ratio, rel=0.05)


@pytest.mark.parametrize(
    ("name", "asked_for"),
    [
        # A lag, a delay and a current loop: a motion tells the first two apart.
        ("lag, delay", [2]),
        # No motion within one direction of the logs tells an offset from the spring of gravity.
        ("offset, Coulomb friction", [2, 3]),
    ],
)
def test_more_rivals_are_told_apart_only_where_no_motion_decides_between_the_closest(
    name: str, asked_for: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Counts, not seconds: a design for three hypotheses costs 2.5 times one for two."""
    import separating as bench  # noqa: PLC0415 - a bench, on the path just now

    told: list[int] = []

    def counted(route: Route, question: Rivals) -> object:
        told.append(len(question.labels))
        return design.designed(route, question)

    monkeypatch.setattr(asked, "designed", counted)
    row = bench.ROWS[name]
    robot = bench.simulator(row)
    machine = bench.machine_of(robot)
    refs = [row.wave(seed, robot.sample_time_s) for seed in (1, 2, 3)]
    logs = [bench.log_of(machine, row.withheld, r, k) for k, r in enumerate(refs)]
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:], separate=True)
    assert told == asked_for
    made = found.experiment
    assert isinstance(made, SeparatingExperiment) and made.decides
    assert len(made.rivals) == asked_for[-1]
    # A pair that the motion does not tell apart is said, and is not among those that it tells apart.
    assert bool(made.alike) == (len(asked_for) > 1)
    tells, rest = str(made).split(" The true one", 1)
    for one, other in made.alike:
        assert placed(one) in tells and placed(other) not in tells and placed(other) in rest
