"""Figures of the report: few points that keep every peak, paths that are the points, round ticks."""

import re

import numpy as np
import pytest

from axisight.report.curves import path, thin
from axisight.report.figures import overlay_figure, points_per_line
from axisight.report.scale import Scale
from diagnosis_data import explained


def drawn(text: str) -> list[list[tuple[int, int]]]:
    """The points of a path, piece by piece."""
    pieces = []
    for piece in text.split("M")[1:]:
        steps = np.array([int(n) for n in re.findall(r"-?\d+", piece)]).reshape(-1, 2)
        pieces.append([tuple(point) for point in np.cumsum(steps, axis=0).tolist()])
    return pieces


def test_a_path_is_its_points():
    x, y = np.array([0.0, 1.2, 2.0, 7.0]), np.array([3.0, -4.4, 5.0, 5.0])
    assert drawn(path(x, y)) == [[(0, 3), (1, -4), (2, 5), (7, 5)]]


def test_a_path_is_broken_where_nothing_is_known():
    y = np.array([np.nan, 1.0, 2.0, np.nan, 4.0, np.inf])
    assert drawn(path(np.arange(6.0), y)) == [[(1, 1), (2, 2)], [(4, 4), (4, 4)]]
    assert path(np.arange(2.0), np.full(2, np.nan)) == ""


def test_thinning_keeps_every_glitch():
    time_s = np.arange(100_000) / 1000.0
    values = np.sin(time_s)
    glitches = [17, 31_234, 31_240, 99_998]
    values[glitches] = [50.0, -60.0, 70.0, -80.0]
    kept_s, kept = thin(time_s, values, 2_000)
    assert kept.size <= 2_000
    assert np.all(np.diff(kept_s) > 0)
    assert set(values[glitches]) <= set(kept)


def test_points_are_shared_among_figures():
    assert points_per_line(1) == 2_000
    assert points_per_line(24) == 1_000
    assert points_per_line(10_000) == 200


@pytest.mark.parametrize("low, high", [(-0.3, 0.7), (0, 1e-5), (-7e6, 2e6), (99.2, 101.1)])
def test_ticks_are_round_and_within(low, high):
    ticks = Scale(low, high).ticks(6)
    assert 3 <= len(ticks) <= 7
    shares = [share for share, _ in ticks]
    assert np.allclose(np.diff(shares), shares[1] - shares[0])
    assert shares[0] >= -1e-6 and shares[-1] <= 1 + 1e-6
    texts = [text for _, text in ticks]
    assert len(set(texts)) == len(texts)
    values = [float(text.replace("−", "-")) for text in texts]
    assert np.allclose([low + s * (high - low) for s in shares], values, atol=1e-9 * (high - low))


def test_a_constant_stands_in_the_middle():
    for value in (0.0, -3.0):
        assert Scale.around(np.full(5, value)).share(np.array(value)) == pytest.approx(0.5)
    assert Scale.around(np.full(3, np.nan)) == Scale(0.0, 1.0)


def test_curves_stand_where_their_values_are():
    diagnosis = explained()
    overlay = diagnosis.overlays[1]
    figure = overlay_figure(diagnosis, overlay, 100_000)
    torque, error = figure["panels"]
    values = {
        "measured": overlay.measured_nm, "before": overlay.before_nm, "after": overlay.after_nm,
    }  # fmt: skip
    for panel, taken_off in ((torque, 0.0), (error, overlay.measured_nm)):
        for line in panel["lines"]:
            (points,) = drawn(line["path"])
            last = values[line["kind"]][-1] - np.broadcast_to(taken_off, overlay.time_s.shape)[-1]
            y = points[-1][1] / (panel["fine"] * panel["height"])
            span = panel["scale"].high - panel["scale"].low
            assert points[0][0] == 0 and points[-1][0] == panel["width"]
            assert panel["scale"].high - y * span == pytest.approx(last, abs=span / 3000)
