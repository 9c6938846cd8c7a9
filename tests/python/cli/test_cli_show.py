"""What `axisight diagnose` prints: values, the gap by axis and pooled, what remains, what to do next."""

from dataclasses import replace
from io import StringIO

import pytest
from rich.console import Console

from axisight.cli import common, show
from axisight.gap.facts.result import DetectionLimit
from axisight.logs.render import _folded
from diagnosis_data import explained, gap, hostile, of


@pytest.fixture
def shown(monkeypatch):
    def render(diagnosis, width: int = 200) -> str:
        console = Console(width=width, record=True, file=StringIO())
        monkeypatch.setattr(show, "OUT", console)
        monkeypatch.setattr(common, "OUT", console)
        show.show_diagnosis(diagnosis, verbose=True)
        return " ".join(console.export_text().split())

    return render


def test_a_diagnosis_says_it_all(shown):
    text = shown(replace(explained(), next_experiment="Move slowly."))
    for words in (
        "explained: Axis 2 has Coulomb friction",
        "coulomb_friction@2 0.970 coulomb_nm 0.612 Nm 0.583 to 0.641",
        "│ 2 │ explained │ 46.5 % │ 43.5 % │ 6.2 % │ 5 %",
        "│ all │ explained │ 31 % │ 29 % │ 6.2 % │ 5 %",
        "│ pooled │ │ 21.7 % │ 20.3 % │ 4.34 % │ 3.5 %",
        "sqrt(sum of squared errors / sum of squared torques)",
        "where: axis 2, residual steps with velocity sign",
        "remains above noise: 3.7 % of the torque; it varies with speed",
        "remains: axis 1, 70 % of the squared gap above the floor",
        "finding: parameter_at_edge: axis2.damping: ended +32 % off, at the bound",
        "next: Move slowly.",
        "stiffness_2 │ -2.1 % │ -3.5 to -0.7 %",
    ):
        assert words in text, words


def test_joints_with_names_of_their_own_are_told(shown):
    named = {**explained().provenance, "axis_names": ["base", "axis2", "elbow"]}
    text = shown(replace(explained(), provenance=named))
    assert "axes: 1 base, 3 elbow" in text
    assert "axis: rms error / standard deviation of the torque; all: rms of the axes" in text
    assert "axes: " not in shown(explained())


def test_positions_are_told_as_what_the_gains_command(shown):
    found = explained()
    text = shown(replace(found, gap=replace(found.gap, compared="positions")))
    for words in (
        "compared: Positions under the same targets. Errors are given as the torque",
        "sqrt(sum of squared errors / sum of squared commanded torques)",
        "remains above noise: 3.7 % of the commanded torque",
    ):
        assert words in text, words
    assert "of the torque" not in text.replace(found.headline, "")
    assert "compared: " not in shown(found)


def test_what_is_not_there_is_not_said(shown):
    text = shown(replace(of("none"), gap=replace(of("none").gap, pooled=None)))
    for words in ("pooled", "remains", "finding", "next: Move", "re-fitted within", "cause and"):
        assert words not in text, words


def test_nothing_is_cut_on_a_narrow_screen(shown):
    text = shown(explained(), width=80)
    assert "…" not in text
    assert "coulomb_friction@2 0.970 coulomb_nm 0.612 Nm 0.583 to 0.641" in text


def test_names_are_no_markup(shown):
    assert "[red]" in shown(replace(explained(), headline="a [red] arm"))
    shown(hostile())


def test_limits_are_whole_in_80_columns():
    """Seven places of numbers as wide as they come; no word and no number on two lines."""
    places = (1, 2, 3, 4, 5, 6, None)
    names = ("asymmetric_friction", "load_dependent_friction")
    limits = tuple(
        DetectionLimit(name, place, "x", 0.00053, "Nm (joint side)")
        for name in names
        for place in places
    )
    unseen = DetectionLimit("link_mass", 1, "relative_change", None, "1", hidden="tolerances")
    limits = (*limits, unseen, replace(unseen, axis=2, hidden="motion"))
    six = replace(of("none"), gap=gap(0.1, 0.1, 0.1, 0.1, 6), detection_limits=limits)
    console = Console(width=80, record=True, file=StringIO())
    for table in show._limits(six):
        console.print(table)
    text = console.export_text()
    words = text.split()
    assert words.count("0.00053") == 14
    assert {"Asymmetric", "Load-dependent", "friction"} <= set(words)
    # What hides any size, and what the words mean, once.
    assert words.count("hidden") == words.count("never") == 1
    assert words.count("Hidden:") == words.count("Never:") == 1
    assert "axis 6" in text
    assert max(map(len, text.splitlines())) <= 80


def test_names_of_columns_fold_where_they_have_an_end():
    folded = _folded("joint_states.velocity.shoulder_lift_joint")
    assert folded.split("\n") == ["joint_states.velocity.", "shoulder_lift_joint"]
    assert _folded("a" * 60) == "a" * 60
