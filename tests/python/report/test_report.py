"""The report: one file, no network, every text escaped, never half written."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from axisight.gap import Interval
from axisight.gap.facts import result
from axisight.report import render_report, save_report
from axisight.report.figures import MAX_OVERLAYS
from axisight.report.wording import gap_maps, standard_errors
from diagnosis_data import VERDICTS, explained, named_everywhere, of, one_prismatic, overlay
from pages import Page, assert_strict

HOSTILE = (
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "' onmouseover='alert(1)",
    "</title></style></script></svg><svg onload=alert(1)>",
    "--><iframe src=javascript:alert(1)></iframe>",
    "{{ undefined.name }}{% include 'report.js' %}",
)


def read(page: str) -> str:
    """A page with every run of white space, unbroken spaces too, as one space."""
    return " ".join(page.replace("&nbsp;", " ").split())


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_gives_a_page_that_needs_nothing_else(verdict):
    diagnosis = of(verdict)
    page = render_report(diagnosis)
    assert_strict(page)
    assert diagnosis.headline[:40] in read(page)
    assert len(page.encode()) < 600_000


def test_size_is_bounded_however_many_and_long_the_logs():
    six = render_report(explained(6))
    assert len(six.encode()) < 1_000_000
    many = tuple(overlay(f"log {i}", 1 + i % 6) for i in range(MAX_OVERLAYS + 7))
    page = render_report(replace(explained(6), overlays=many))
    assert len(page.encode()) < 2_000_000
    assert "7 further overlays are not shown" in page


@pytest.mark.parametrize("text", HOSTILE)
def test_no_name_becomes_markup(text):
    page = render_report(named_everywhere(text))
    assert_strict(page)
    assert Page(page).structure == Page(render_report(named_everywhere("name"))).structure


def test_every_figure_is_there_without_a_script():
    diagnosis = explained()
    page = Page(render_report(diagnosis))
    assert not [tag for tag, attributes in page.elements if "hidden" in attributes]
    classes = [attributes.get("class") for _, attributes in page.elements]
    assert classes.count("plot") == len(diagnosis.overlays)
    assert classes.count("panel") == 2 * classes.count("plot")
    # Bars, and the axis below them.
    assert classes.count("candidate") == 10 + 1
    curves = [a["d"] for tag, a in page.elements if tag == "path"]
    assert len(curves) == 5 * len(diagnosis.overlays)
    assert all(len(curve) > 2000 for curve in curves)
    opened = [a for tag, a in page.elements if tag == "details" and a.get("class") == "log"]
    assert ["open" in attributes for attributes in opened] == [False, True, *4 * [False]]


def test_one_prismatic_axis_is_in_newtons():
    assert "(N)" in render_report(one_prismatic())


def test_values_stand_beside_the_headline():
    diagnosis = explained()
    page = read(render_report(diagnosis))
    header = page[page.index("<header>") : page.index("</header>")]
    for words in ("Coulomb friction", "axis 2", "coulomb_nm", "0.612 Nm", "0.583 to 0.641"):
        assert words in header
    # The width of a sign is no size of it; it stands with the rest below.
    assert "smoothing_rad_s" not in header and "smoothing_rad_s" in page
    assert '<section class="values"' not in render_report(of("none"))


def test_many_values_are_grouped_and_counted():
    base = explained(6)
    causes = [
        replace(base.causes[0], effect=effect, axis=axis, parameters={name: Interval(1, 0.9, 1.1)})
        for axis in (2, 1, 3, 6, 5, 4, 7)
        for effect, name in (("coulomb_friction", "coulomb_nm"), ("quadratic_drag", "drag"))
    ]
    page = read(render_report(replace(base, causes=tuple(causes))))
    header = page[page.index('<section class="values"') : page.index("</header>")]
    assert header.count("Coulomb friction") == header.count("Quadratic drag") == 1
    places = re.findall(r"<td>axis (\d)</td>", header)
    assert places == [*"1234567", *"12345"]
    assert "2 more values below" in header


def test_pooled_remainder_and_findings_are_on_the_page():
    page = read(render_report(explained()))
    assert (
        '<th scope="row" class="word">pooled</th><td class="word">–</td><td class="num">22 %</td>'
        in page
    )
    assert "√(Σ e² / Σ u²)" in page
    assert "3.7 % of the torque on the validation logs remain above the floor" in page
    assert "The remainder varies with speed" in page
    assert "parameter_at_edge: axis2.damping: ended +32 % off, at the bound" in page
    clean = read(render_report(of("none")))
    assert "nothing stands out from the floor" in clean
    assert "Findings about robot file and logs" not in clean
    plain = replace(explained(), gap=replace(explained().gap, pooled=None), remainder=None)
    assert "√(Σ e² / Σ u²)" not in render_report(plain)


def test_an_axis_that_is_not_judged_has_no_significant_cells():
    found = explained()
    assert any(m.significant.any() for m in gap_maps(found))
    axes = tuple(replace(a, verdict="not_judged") for a in found.axes)
    assert not any(m.significant.any() for m in gap_maps(replace(found, axes=axes)))


def test_a_failed_write_leaves_nothing(tmp_path, monkeypatch):
    def broken(self: Path, target: Path) -> Path:
        raise OSError("disk full")

    monkeypatch.setattr(result.Path, "replace", broken)
    with pytest.raises(OSError, match="disk full"):
        save_report(explained(), tmp_path / "report.html")
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_less_than_zero_by_nothing():
    assert [standard_errors(x) for x in (-0.04, 0.04, -0.06, -9.9, 12.3)] == [
        "0.0", "0.0", "−0.1", "−9.9", "12",
    ]  # fmt: skip


def test_the_page_says_what_is_compared_and_how_fits_ended():
    base = of("explained")
    page = read(render_report(base))
    assert "measured and simulated motor torque, in per cent of the rms measured torque" in page
    assert "max_iterations" not in page
    positions = replace(base, gap=replace(base.gap, compared="positions"))
    page = read(render_report(positions))
    assert "positions, as the torque that the stated gains command" in page
