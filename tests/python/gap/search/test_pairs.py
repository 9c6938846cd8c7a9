"""Effects that hide one another: which candidates of an axis are tried in pairs."""

import numpy as np
import pytest

from axisight import Settings
from axisight.gap.fit.data_blocks import layout_of
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.ranking.fitted_hypothesis import trial
from axisight.gap.screening.restart_look_alike import ended_at_bound
from axisight.gap.search.pairs import Pairs
from axisight.gap.views.choice import view_of
from rigid_arm import COULOMB_NM, VISCOUS, arm, log_of

ROBOT = arm()


@pytest.mark.parametrize(
    ("constant", "tried"),
    [
        # Larger than the dry friction: one way it would have to push.
        (-2.0, ["coulomb_friction@3", "torque_offset@3"]),
        (-0.5, ["asymmetric_friction@3"]),
    ],
)
def test_friction_larger_one_way_gives_way_to_its_parts_where_it_is_at_its_bound(
    constant: float, tried: list[str]
):
    logs = [log_of(ROBOT, seed, np.eye(6)[2] * COULOMB_NM, VISCOUS, 20.0) for seed in range(2)]
    for log in logs:
        log.torque_nm[:, 2] += constant * COULOMB_NM[2]
    view = view_of(ROBOT, logs, logs, Settings())
    model = view.fitter.fit([])
    options = view.candidates(model, axes=[3])
    option = next(o for o in options if o.effect.label == "asymmetric_friction@3")
    one = trial(option, view.fitter.fit([option], model))
    assert ended_at_bound(one) is (len(tried) == 2)
    current, layout = held_out_loss(model), layout_of(model)
    floor = view.floor.expected[model.axis] * model.samples
    pairs = Pairs(view.fitter, model, [one], current, floor, layout, Settings())
    partners = pairs._taken_apart([one])
    assert [p.label for p in partners] == tried
    # Each by itself, on the model without the composite.
    assert all(len(p.fitted.free) == 1 for p in partners)
    # Of two that are causes together, each is judged beside the other alone, parts of a composite as well.
    found = pairs.found(2, float((current - floor)[layout.axis == 2].sum()), len(options))
    assert (found is not None) == (len(tried) == 2)
    if found is not None:
        members = [r.trial.label for r, _ in found.members]
        assert sorted(members) == tried
        assert [[e.label for e in m.effects] for m in found.without] == [[x] for x in members[::-1]]
