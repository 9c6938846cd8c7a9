"""Verdicts from the spread over realizations, and what a quick run writes and draws."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy import stats

from axisight_thesis import Item, write_item
from axisight_thesis.chapter8_figures import error_item
from axisight_thesis.chapter8_setting import Design, excited_lines
from axisight_thesis.chapter8_study import Experiments
from axisight_thesis.decision import all_of, interval, positive


def test_verdict_is_that_of_students_test():
    rng = np.random.default_rng(1)
    seen = set()
    for mean in np.linspace(-2, 2, 41):
        values = mean + rng.normal(size=6)
        expected = stats.ttest_1samp(values, 0).pvalue < 0.05
        verdict = positive(values)
        assert (verdict is not None) == expected
        assert verdict is None or verdict == (values.mean() > 0)
        seen.add(verdict)
    assert seen == {True, False, None}


def test_one_value_decides_nothing_and_equal_ones_do():
    assert positive([1.0]) is None
    assert positive([1.0, 1.0]) is True
    assert interval([1.0, 2.0, 3.0]) == f"+2.00 ± {stats.t.ppf(0.975, 2) / np.sqrt(3):.2f}"


@pytest.mark.parametrize(
    ("verdicts", "expected"),
    [((True, True), True), ((True, None), None), ((None, False), False), ((False, True), False)],
)
def test_several_verdicts(verdicts, expected):
    assert all_of(verdicts) is expected


def test_quick_writes_one_small_picture(tmp_path):
    figure = Figure(figsize=(4, 3))
    made = Item("figure-1.1", "x", {}, {"": figure})
    (only,) = write_item(made, tmp_path, quick=True)
    assert only.suffix == ".png"
    both = write_item(made, tmp_path)
    assert [path.suffix for path in both] == [".pdf", ".png"]
    assert both[0].stat().st_size > 0


def test_the_mean_of_one_realization_is_not_drawn():
    lines = excited_lines()
    nothing = np.ones((len(lines), 3, 3), complex)
    one = Experiments(lines / 10, nothing, nothing, nothing, nothing, 1.1 * nothing)
    design = Design("T1", square=False)

    def labels(found):
        figure = error_item("figure-8.4", design, found, nothing).figures[""]
        return [text.get_text() for text in figure.legends[0].get_texts()]

    assert labels([one]) == ["one realization"]
    two = [one, replace(one, estimate=0.8 * nothing)]
    assert labels(two) == ["one realization", "mean of 2"]
