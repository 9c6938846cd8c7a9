"""benches/outside: the arms of every draw can bear every effect, and say their axes rightly."""

from importlib import import_module

import pytest

DRAWS = {
    "two engines": ["drake", "exudyn"],
    "DART": ["dart"],
    "Bullet": ["bullet"],
    "Jiminy": ["jiminy"],
}


@pytest.fixture
def outside(request, monkeypatch):
    monkeypatch.syspath_prepend(str(request.config.rootpath / "benches"))
    return import_module("outside.models"), import_module("outside.draw")


@pytest.mark.parametrize("engines", DRAWS.values(), ids=DRAWS)
def test_every_effect_and_stranger_has_an_arm(outside, engines):
    models, draw = outside
    arms = models.arms_of(engines)
    kinds = {**draw.SINGLE, **draw.STRANGERS}
    homeless = [name for name, kind in kinds.items() if not any(arm in kind.axes for arm in arms)]
    assert homeless == []


def test_axes_that_are_drawn_exist(outside):
    models, draw = outside
    driven = {name: len(build().driven) for name, build in models.ARMS.items()}
    assert driven == draw.AXES
    assert set(driven) == set(draw.WEIGHTS)
    for name, kind in {**draw.SINGLE, **draw.STRANGERS}.items():
        for arm, axes in kind.axes.items():
            assert axes, (name, arm)
            assert max(axes) < driven[arm], (name, arm)
