"""Bode plots and element matrices: what they show, and what they refuse."""

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import axisight
from axisight import frf
from axisight.errors import InputError
from axisight.frf import Flag, frequency_response

F_HZ = np.array([1.0, 2.0, 4.0, 8.0, 16.0])


def made(n_out=1, n_in=1, *, f=F_HZ, variance=0.01, delay_s=0.0, gain=2.0, **options):
    """A pure gain behind a delay, gain (10 output + input) / 11 in element (output, input)."""
    turn = np.exp(-2j * np.pi * f * delay_s)
    gains = gain * (10 * np.arange(1, n_out + 1)[:, None] + np.arange(1, n_in + 1)) / 11
    g = turn[:, None, None] * gains
    v = np.full(g.shape, variance)
    return frequency_response(f, g, estimator="made", variance=v, **options)


def band(axes, k=0):
    """Lower and upper edge at each frequency that a filled band has."""
    found = [c for c in axes.collections if isinstance(c, PolyCollection)][k]
    points = np.concatenate([p.vertices for p in found.get_paths()])
    x = np.unique(points[:, 0])
    at = [points[points[:, 0] == value, 1] for value in x]
    return x, np.array([a.min() for a in at]), np.array([a.max() for a in at])


def test_band_edges_are_those_of_the_confidence_disc():
    figure = axisight.plot_bode(made(variance=0.04))
    top, bottom = figure.axes
    radius = 0.2 * np.sqrt(-np.log(0.05))  # known variance
    x, low, high = band(top)
    np.testing.assert_allclose(x, F_HZ)
    np.testing.assert_allclose(low, 20 * np.log10(2 - radius), rtol=1e-12)
    np.testing.assert_allclose(high, 20 * np.log10(2 + radius), rtol=1e-12)
    np.testing.assert_allclose(band(bottom)[2], np.degrees(np.arcsin(radius / 2)), rtol=1e-12)


@pytest.mark.parametrize("as_attribute", [True, False])
def test_few_degrees_of_freedom_widen_the_band(as_attribute):
    found = made(variance=0.01)
    if as_attribute:
        found.attrs["degrees_of_freedom"] = 3
    else:
        found["degrees_of_freedom"] = found["variance"] * 0 + 3
    radius = np.sqrt(0.01 * 3 * (0.05 ** (-1 / 3) - 1))
    np.testing.assert_allclose(frf.confidence_radius(found).values, radius, rtol=1e-12)
    _, _, high = band(axisight.plot_bode(found).axes[0])
    np.testing.assert_allclose(high, 20 * np.log10(2 + radius), rtol=1e-12)


def test_a_disc_that_holds_zero_has_no_lower_end_and_any_phase():
    top, bottom = axisight.plot_bode(made(variance=4.0)).axes
    assert (band(top)[1] < top.get_ylim()[0]).all()
    _, low, high = band(bottom)
    np.testing.assert_allclose(high - low, 360)


def test_unknown_variance_has_no_band():
    top, bottom = axisight.plot_bode(made(variance=np.nan)).axes
    for axes in (top, bottom):
        assert not any(len(p.vertices) for c in axes.collections for p in c.get_paths())
    assert len(axisight.plot_bode(made().drop_vars("variance")).axes) == 2


def test_flagged_lines_are_marked_and_named():
    flag = np.array([0, Flag.ILL_CONDITIONED, 0, Flag.RANK_DEFICIENT, Flag.NO_EXCITATION])
    found = made(flag=flag)
    found["response"][3:] = np.nan
    figure = axisight.plot_bode(found)
    marks = {line.get_marker(): line.get_xdata() for line in figure.axes[0].lines[1:]}
    np.testing.assert_array_equal(marks["^"], [2.0])
    np.testing.assert_array_equal(marks["x"], [8.0, 16.0])
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names == ["ill-conditioned", "no estimate"]
    assert not axisight.plot_bode(made()).legends


def test_wrapped_phase_is_broken_where_it_jumps():
    f = np.arange(1.0, 100.0)
    delayed = made(f=f, delay_s=0.02)  # 7.2 degrees a line: a jump every 50 lines
    (line,) = axisight.plot_bode(delayed).axes[1].lines
    phase = line.get_ydata()
    assert np.nanmax(np.abs(phase)) <= 180
    assert np.isnan(phase).sum() == 2
    steps = np.abs(np.diff(phase))
    assert np.nanmax(steps) < 7.3


def test_unwrapped_phase_is_that_of_the_delay():
    f = np.arange(1.0, 100.0)
    delayed = made(f=f, delay_s=0.02)
    delayed["response"][40] = np.nan  # a line without estimate does not stop it
    delayed["flag"][40] = Flag.RANK_DEFICIENT
    axes = axisight.plot_bode(delayed, unwrap=True).axes[1]
    known = np.arange(len(f)) != 40
    phase = axes.lines[0].get_ydata()
    np.testing.assert_allclose(phase[known], -7.2 * f[known], atol=1e-9)
    assert np.isnan(phase[40])
    assert axes.get_ylim()[0] < -7.2 * f[-1]


def test_elements_stand_where_they_belong_and_share_axes():
    figure = axisight.plot_response_matrix(made(3, 2))
    assert len(figure.axes) == 3 * 2 * 2
    magnitude = np.array(figure.axes).reshape(3, 2, 2)[:, 0]
    phase = np.array(figure.axes).reshape(3, 2, 2)[:, 1]
    for o in range(3):
        for i in range(2):
            gain = 2 * (10 * (o + 1) + i + 1) / 11
            np.testing.assert_allclose(magnitude[o, i].lines[0].get_ydata(), 20 * np.log10(gain))
    for grid in (magnitude, phase):
        assert len({axes.get_ylim() for axes in grid.flat}) == 1
        assert len({axes.get_xlim() for axes in grid.flat}) == 1
    low, high = magnitude[0, 0].get_ylim()
    assert low < 20 * np.log10(2) < 20 * np.log10(2 * 32 / 11) < high
    assert [axes.get_title() for axes in magnitude[0]] == ["input 1", "input 2"]
    assert [axes.get_ylabel() for axes in magnitude[:, 0]] == ["output 1", "output 2", "output 3"]
    assert all(axes.get_xlabel() == "frequency [Hz]" for axes in phase[-1])


def test_labels_carry_units():
    found = made(2, 2, output_unit="rad/s^2")
    assert axisight.plot_bode(found).axes[0].get_ylabel() == "magnitude\n[dB re 1 rad/s²/Nm]"
    figure = axisight.plot_response_matrix(found)
    assert figure.get_supylabel() == "magnitude [dB re 1 rad/s²/Nm] and phase [deg]"
    figure = axisight.plot_response_matrix(found, phase=False)
    assert figure.get_supylabel() == "magnitude [dB re 1 rad/s²/Nm]"
    assert len(figure.axes) == 4


def test_frequencies_are_round_numbers(tmp_path):
    figure = axisight.plot_bode(made())
    figure.savefig(tmp_path / "figure.png")
    low, high = figure.axes[1].get_xlim()
    labels = [
        label.get_text()
        for label in figure.axes[1].get_xticklabels()
        if low <= label.get_position()[0] <= high and label.get_text()
    ]
    assert labels == ["1", "2", "5", "10"]


def test_several_responses_are_drawn_over_one_another_and_named(tmp_path):
    both = {"before": made(2, 2), "after": made(2, 2, gain=3.0, f=F_HZ * 2)}
    for figure in (
        axisight.plot_bode(both, output=2, input=1),
        axisight.plot_response_matrix(both),
        axisight.plot_response_matrix(both, width_in=3.5, phase=False),
    ):
        assert isinstance(figure, Figure)
        assert [t.get_text() for t in figure.legends[0].get_texts()] == ["before", "after"]
        assert len({line.get_color() for line in figure.axes[0].lines}) == 2
        low, high = figure.axes[0].get_xlim()
        assert low < F_HZ[0] and high > 2 * F_HZ[-1]
        figure.savefig(tmp_path / "figure.png")
        assert (tmp_path / "figure.png").stat().st_size > 5_000


@pytest.mark.parametrize("plot", [axisight.plot_bode, axisight.plot_response_matrix])
def test_what_is_no_response_is_refused(plot):
    with pytest.raises(InputError, match="expected at least one, got none"):
        plot({})
    with pytest.raises(InputError, match="variable response"):
        plot(made().drop_vars("response"))
    with pytest.raises(InputError, match="responses\['a'\]: expected a frequency response"):
        plot({"a": made()["response"]})
    nothing = made()
    nothing["response"][:] = np.nan
    with pytest.raises(InputError, match="only NaN"):
        plot(nothing)


@pytest.mark.parametrize("plot", [axisight.plot_bode, axisight.plot_response_matrix])
def test_responses_that_do_not_belong_together_are_refused(plot):
    with pytest.raises(InputError, match=r"expected rad/Nm as in 'a', got rad/A in 'b'"):
        plot({"a": made(), "b": made(input_unit="A")})
    with pytest.raises(InputError, match=r"expected inputs \[1, 2\] as in 'a', got \[1\] in 'b'"):
        plot({"a": made(2, 2), "b": made(2, 1)})


def test_element_that_is_not_there_is_refused():
    with pytest.raises(InputError, match=r"output: expected one of \[1, 2\], got 3"):
        axisight.plot_bode(made(2, 1), output=3)
    with pytest.raises(InputError, match="input: expected a whole number from 1, got 0"):
        axisight.plot_bode(made(2, 1), input=0)
