"""The work of a diagnosis, counted by stage: a rule that doubles it is seen here, on whatever machine."""

from collections.abc import Mapping
from dataclasses import astuple

import pytest

from axisight import Diagnosis, Effect, Settings, diagnose
from axisight.gap.facts.trace import STAGES, Work
from gap_data import HELD, PLAN, bare_axis, logs_of, scattered
from rigid_arm import arm, log_of

# Rounding may take a fit a step further on another machine, with an evaluation or two; a new rule takes more.
LEEWAY, STEPS_MORE = 1.15, 2

FRICTION = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.05})
PLAY = Effect("backlash", 1, {"half_width_rad": 2e-4})


def in_loop(effects: list[Effect], threads: int) -> Diagnosis:
    robot = bare_axis()
    machine = scattered(robot, 4)
    return diagnose(
        robot=robot,
        estimation=logs_of(machine, effects, PLAN),
        validation=logs_of(machine, effects, HELD),
        settings=Settings(bootstrap=20, threads=threads),
    )


def of_arm(threads: int) -> Diagnosis:
    """Friction on six axes, by inverse dynamics."""
    *fitted, held = (log_of(arm(), seed, seconds=12.0) for seed in (1, 2, 3))
    settings = Settings(bootstrap=20, threads=threads)
    return diagnose(robot=arm(), estimation=fitted, validation=held, settings=settings)


def check(found: Diagnosis, most: Mapping[str, Work]) -> None:
    """Check the work of each stage, and of all together."""
    assert found.trace.stopped is None
    assert set(found.trace.work_by_stage) == set(most) <= set(STAGES)
    for stage, done in found.trace.work_by_stage.items():
        for counted, allowed in zip(astuple(done), astuple(most[stage]), strict=True):
            assert counted <= max(LEEWAY * allowed, allowed + STEPS_MORE * (allowed > 0)), stage
    whole = sum(most.values(), Work())
    assert found.trace.work == sum(found.trace.work_by_stage.values(), Work())
    for counted, allowed in zip(astuple(found.trace.work), astuple(whole), strict=True):
        assert 0 < counted <= LEEWAY * allowed


@pytest.mark.parametrize(
    ("effects", "most"),
    [
        (
            [],
            {
                "refit": Work(fits=1, steps=2, evaluations=4),
                "screening": Work(linearizations=1),
                "fitting": Work(fits=1, evaluations=1),
                "measuring": Work(linearizations=13),
            },
        ),
        (
            [FRICTION],
            {
                "refit": Work(fits=1, steps=1, evaluations=2),
                "screening": Work(linearizations=89),
                "fitting": Work(fits=6, steps=14, evaluations=23),
                "refining": Work(fits=2, steps=3, evaluations=8, linearizations=5),
                "judging": Work(linearizations=1),
                "adding": Work(fits=1, evaluations=1),
            },
        ),
        (
            [PLAY],
            {
                "refit": Work(fits=1, steps=1, evaluations=3),
                "screening": Work(linearizations=77),
                "fitting": Work(fits=4, steps=13, evaluations=23),
                "refining": Work(fits=1, steps=3, evaluations=5),
                "judging": Work(linearizations=1),
                "adding": Work(fits=1, steps=1, evaluations=2),
            },
        ),
    ],
    ids=["nothing", "dry friction", "play"],
)
def test_a_search_in_closed_loop_does_no_more_than_it_did(
    effects: list[Effect], most: Mapping[str, Work]
):
    found = in_loop(effects, threads=2)
    check(found, most)
    # Threads share the work, and add none.
    assert in_loop(effects, threads=1).trace.work_by_stage == found.trace.work_by_stage


def test_a_search_on_six_axes_does_no_more_than_it_did():
    most = {
        "refit": Work(fits=1, steps=1, evaluations=2),
        "screening": Work(fits=1, steps=3, evaluations=8, linearizations=4),
        "fitting": Work(fits=2, evaluations=2),
        "measuring": Work(fits=1, steps=1, evaluations=3, linearizations=45),
    }
    check(of_arm(threads=2), most)
