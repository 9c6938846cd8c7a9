"""The corner plot: panels, intervals, misuse."""

import pytest

from axisight.errors import InputError
from axisight.posterior import plot_corner
from posterior_data import COULOMB, INERTIA, MASS, VISCOUS, one_hypothesis, two_hypotheses


def test_panels_and_correlations():
    figure = plot_corner(one_hypothesis(), [VISCOUS, COULOMB, MASS], number=200)
    shown = [axes for axes in figure.axes if axes.axison]
    assert len(figure.axes) == 9 and len(shown) == 6
    written = [text.get_text() for axes in shown for text in axes.texts]
    assert "-0.78" in written
    assert figure.axes[6].get_xlabel() == "axis1\nviscous_friction [Nm s/rad]"


def test_causes_come_first_and_the_strongest_correlations_next():
    figure = plot_corner(two_hypotheses(), number=50)
    names = [figure.axes[20 + k].get_xlabel().replace("\n", ".") for k in range(2)]
    assert "coulomb_nm" in names[0] and "viscous_friction" in names[1]


@pytest.mark.parametrize(
    ("names", "says"),
    [
        ([VISCOUS], "two to twelve names, got 1"),
        ([VISCOUS, "mass"], "got 'mass'"),
        (INERTIA, "expected"),
    ],
)
def test_misuse(names, says):
    with pytest.raises(InputError, match=says):
        plot_corner(one_hypothesis(), names)
