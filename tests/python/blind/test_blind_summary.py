"""What a benchmark says in files and on a page: every count from cases made by hand."""

import json
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from axisight.blind import judged_cases, markdown
from axisight.blind.calibration import calibration_bins, carried_over
from axisight.blind.page import render_score
from axisight.blind.plots import plot_calibration, plot_confusion
from axisight.blind.score import Judged, Share
from axisight.blind.summary import summary
from axisight.errors import InputError
from pages import assert_strict


def judged(
    truth: tuple[str, ...], named: tuple[str, ...], verdict: str, severity: float, p=0.9, **more
) -> Judged:
    values = {
        "name": f"case_{len(truth)}_{severity:g}",
        "truth": truth,
        "in_library": True,
        "severity": severity,
        "verdict": verdict,
        "named": named,
        "probabilities": (p,) * len(named),
        "allowed": frozenset(named),
        "where": frozenset(),
        "ratios": (),
        "covered": (),
        "setting": {
            "engine": "mujoco",
            "arm": "lever_like",
            "motions": "moves",
            "references": "logged",
        },
    }
    return Judged(**{**values, **more})


OTHER = {"engine": "pinocchio", "arm": "lever_like", "motions": "moves", "references": "logged"}
CASES = [
    judged(
        ("backlash@1",),
        ("backlash@1",),
        "explained",
        12.0,
        0.95,
        ratios=(1.1, 0.98),
        reduction=0.93,
    ),
    judged(("backlash@2",), ("nonlinear_stiffness@2",), "explained", 5.0, 0.6),
    judged(("backlash@3",), (), "none", 0.1, setting=OTHER, missed={"backlash@3": 0.25}),
    judged(
        ("coulomb_friction@1",), ("coulomb_friction@1",), "explained", 3.0, 0.95, reduction=0.98
    ),
    judged((), (), "none", 0.0),
    judged(("outside_tone@1",), (), "unknown", 9.0, in_library=False),
    judged(("backlash@1", "payload"), ("payload", "backlash@1"), "explained", 8.0, 0.95),
]


def test_all_is_counted():
    found = summary(CASES)
    assert found["cases"] == 7
    assert found["effects"]["backlash"]["all"]["hits"] == 1
    assert found["effects"]["backlash"]["all"]["of"] == 3
    assert found["effects"]["backlash"]["severe"]["of"] == 2
    families = found["families"]
    assert {k: v["all"]["of"] for k, v in families.items()} == {"friction": 1, "transmission": 3}
    # Of one effect or none; pairs are no confusion of one with another.
    assert found["confusion"] == {
        "backlash": {"backlash": 1, "none": 1, "nonlinear_stiffness": 1},
        "coulomb_friction": {"coulomb_friction": 1},
        "nothing": {"none": 1},
        "outside_tone": {"unknown": 1},
    }
    curve = {(d["from"], d["to"]): (d["hits"], d["of"]) for d in found["detection"]}
    assert curve[0.0, 0.3] == (0, 1)
    assert curve[3.0, 10.0] == (1, 2)
    assert curve[10.0, 30.0] == (1, 1)
    assert curve[30.0, None] == (0, 0)
    assert sum(of for _, of in curve.values()) == 4
    assert found["unknown"]["hits"] == 1
    reduced = found["figures"]["gap_reduction within 5 points of the true one"]
    assert (reduced["hits"], reduced["of"]) == (1, 2)
    assert found["parameters_median_error"] == pytest.approx(0.06)
    assert [m["truth"] for m in found["misses"]] == [["backlash@2"], ["backlash@3"]]


def test_figures_are_told_by_engine_arm_and_motions():
    found = summary(CASES)["settings"]
    assert {k: v["cases"] for k, v in found["engine"].items()} == {"mujoco": 6, "pinocchio": 1}
    assert found["arm"]["lever_like"]["figures"] == summary(CASES)["figures"]
    pairs = found["engine"]["mujoco"]["figures"]["pairs: both"]
    assert (pairs["hits"], pairs["of"]) == (1, 1)


def test_all_of_it_stands_in_tables():
    text = markdown(summary(CASES))
    assert "| pairs: both | 1/1 = 100 %" in text
    assert "| pinocchio | 1 | -" in text and "| mujoco | 6 | 2/3 |" in text
    assert "| transmission | 1/2 | 1/3 |" in text
    assert "| case_1_5 | 5.0 | backlash@2 | explained | nonlinear_stiffness@2 | - |" in text
    assert "| case_1_0.1 | 0.1 | backlash@3 | none | - | 0.25 |" in text
    rows = [line for line in text.splitlines() if line]
    assert all(line.startswith("| ") or set(line) <= set("|-") for line in rows)


def test_calibration_is_by_tenths():
    low, high = calibration_bins(CASES)
    assert (low["from"], low["count"], low["right"]) == (0.6, 1, 0.0)
    assert (high["count"], high["probability"], high["right"]) == (4, pytest.approx(0.95), 1.0)
    error = (1 * 0.6 + 4 * 0.05) / 5
    assert summary(CASES)["calibration"]["error"] == pytest.approx(error)


def test_it_is_json_and_nothing_is_no_number():
    assert json.loads(json.dumps(summary(CASES), allow_nan=False)) == summary(CASES)
    bare = summary([judged((), (), "none", 0.0)])
    json.dumps(bare, allow_nan=False)
    assert bare["calibration"] == {"error": None, "bins": [], "carried_over": None}
    assert bare["parameters_median_error"] is None


class Cells(HTMLParser):
    """Cells of a page by class."""

    def __init__(self) -> None:
        super().__init__()
        self.classes: list[str] = []
        self.opened: list[str] = []

    def handle_starttag(self, tag, attrs):
        if tag == "td":
            self.classes.append(dict(attrs).get("class") or "")
        if tag not in ("meta", "br"):
            self.opened.append(tag)

    def handle_endtag(self, tag):
        assert self.opened.pop() == tag


def test_the_page_marks_what_is_right_and_wrong():
    page = render_score("<b>mine</b>", summary(CASES))
    assert "<b>mine</b>" not in page and "&lt;b&gt;mine" in page
    cells = Cells()
    cells.feed(page)
    assert cells.opened == []
    # Right: play, friction, nothing and the tone that is unknown; wrong: the two others.
    assert cells.classes.count("right") == 4
    assert cells.classes.count("wrong") == 2
    assert_strict(page)
    assert page == render_score("<b>mine</b>", summary(CASES))
    assert "Nothing." in render_score("x", summary(CASES[:1]))


def test_a_temperature_of_one_engine_is_judged_on_another():
    """Of causes said with 0.9 three quarters are right on both engines: they were named too surely."""
    right = judged(("backlash@1",), ("backlash@1",), "explained", 9.0)
    wrong = judged(("backlash@1",), ("payload",), "explained", 9.0)
    cases = [
        replace(j, setting=s) for s in (right.setting, OTHER) for j in [right] * 30 + [wrong] * 10
    ]
    found = carried_over(cases)
    assert found is not None and found["causes"] == 40
    # Closed form: the temperature that takes the log-odds of 0.9 to those of 3 in 4.
    assert found["temperature"] == pytest.approx(np.log(9) / np.log(3), rel=1e-3)
    other = found["judged_on"]["pinocchio"]
    assert other["error"] == pytest.approx(0.15) and other["error_scaled"] < 1e-3
    assert other["log_loss_scaled"] == pytest.approx(-0.75 * np.log(0.75) - 0.25 * np.log(0.25))
    assert other["log_loss"] == pytest.approx(-0.75 * np.log(0.9) - 0.25 * np.log(0.1))
    text = markdown(summary(cases))
    assert "| temperature that fits mujoco (40 causes) | 2.00 |" in text
    assert "0.150, with it 0.000" in text
    assert "temperature" in render_score("cases", summary(cases))


def test_priors_by_family_of_one_engine_are_judged_on_another():
    """Play is named too surely and a load not surely enough: one temperature mends neither."""
    play = judged(("backlash@1",), ("backlash@1",), "explained", 9.0)
    wrong = judged(("payload",), ("backlash@1",), "explained", 9.0)
    load = judged(("payload",), ("payload",), "explained", 9.0)
    each = [play] * 60 + [wrong] * 60 + [load] * 120
    cases = [replace(j, setting=s) for s in (play.setting, OTHER) for j in each]
    found = carried_over(cases)
    assert found is not None
    priors, other = found["priors"], found["judged_on"]["pinocchio"]
    assert priors["transmission"] < -1 < 1 < priors["load"]
    # Half of the play is right: its log-odds are near zero after both.
    hot = np.log(9) / found["temperature"]
    assert hot + priors["transmission"] == pytest.approx(0.0, abs=0.1)
    assert other["log_loss_priors"] < 0.7 * other["log_loss_scaled"]
    assert "with priors by family too" in markdown(summary(cases))


def test_without_another_engine_or_with_few_causes_none_is_fitted():
    assert carried_over(CASES) is None
    assert carried_over([CASES[0]] * 30) is None
    assert "temperature" not in markdown(summary(CASES))


def test_a_verdict_without_its_truth_or_seal_is_named(tmp_path):
    """A benchmark whose making was stopped has a case too many."""
    for name in ("cases/one", "truths", "verdicts"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "verdicts" / "one.json").write_text("{}")
    folders = [tmp_path / name for name in ("cases", "truths", "verdicts")]
    with pytest.raises(InputError, match=r"one\.json: expected the truth of a verdict"):
        judged_cases(*folders)
    (tmp_path / "truths" / "one.json").write_text("{}")
    with pytest.raises(InputError, match="expected the seal of a case"):
        judged_cases(*folders)


def test_what_is_right_stands_on_the_diagonal_of_the_confusion():
    axes = plot_confusion(summary(CASES)).axes[0]
    rows = [label.get_text() for label in axes.get_yticklabels()]
    columns = [label.get_text() for label in axes.get_xticklabels()]
    assert columns[: len(rows)] == rows
    cells = {t.get_position(): t.get_text() for t in axes.texts}
    assert cells[columns.index("backlash") + 0.5, rows.index("backlash") + 0.5] == "1"
    assert cells[columns.index("nonlinear stiffness") + 0.5, rows.index("backlash") + 0.5] == "1"
    assert cells[columns.index("none") + 0.5, rows.index("nothing") + 0.5] == "1"


def test_probabilities_are_drawn_over_how_often_they_were_right():
    score = summary(CASES)
    axes = plot_calibration(score).axes[0]
    dots = [tuple(c.get_offsets()[0]) for c in axes.collections]
    assert dots == [(b["probability"], b["right"]) for b in score["calibration"]["bins"]]
    # With Wilson's interval, as all shares have it.
    last = score["calibration"]["bins"][-1]
    share = Share(round(last["right"] * last["count"]), last["count"])
    assert tuple(axes.lines[-1].get_ydata()) == share.interval()
