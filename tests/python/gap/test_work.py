"""The work of a search, counted: a rule that doubles it is seen here, on whatever machine."""

from dataclasses import astuple

import pytest

from axisight import Effect, Settings, diagnose
from axisight.gap.facts.trace import Work
from gap_data import HELD, PLAN, bare_axis, logs_of, scattered

# Rounding may take a fit a step further on another machine; a new rule takes more.
LEEWAY = 1.15


def work(effects: list[Effect], threads: int) -> Work:
    robot = bare_axis()
    machine = scattered(robot, 4)
    found = diagnose(
        robot=robot,
        estimation=logs_of(machine, effects, PLAN),
        validation=logs_of(machine, effects, HELD),
        settings=Settings(bootstrap=20, threads=threads),
    )
    return found.trace.work


@pytest.mark.parametrize(
    ("effects", "most"),
    [
        ([], Work(fits=2, steps=2, evaluations=5, linearizations=19)),
        (
            [Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.05})],
            Work(fits=10, steps=19, evaluations=37, linearizations=100),
        ),
        (
            [Effect("backlash", 1, {"half_width_rad": 2e-4})],
            Work(fits=7, steps=18, evaluations=33, linearizations=83),
        ),
    ],
    ids=["nothing", "dry friction", "play"],
)
def test_a_search_does_no_more_than_it_did(effects: list[Effect], most: Work):
    done = work(effects, threads=2)
    for counted, allowed in zip(astuple(done), astuple(most), strict=True):
        assert 0 < counted <= LEEWAY * allowed
    # Threads share the work, and add none.
    assert work(effects, threads=1) == done
