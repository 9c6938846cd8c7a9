"""Effects and causes in sentences."""

from dataclasses import replace

import pytest

from axisight.effects import effect_table, noun, phrase, title
from axisight.gap.facts.axis_names import placed
from axisight.gap.facts.result import Cause, Interval
from axisight.gap.facts.withdrawal import Withdrawal
from axisight.gap.verdict.headline import Facts, headline, named
from axisight.report.page import render_report
from axisight.report.wording import plain_name, torque_unit, torque_word
from diagnosis_data import explained, gap, of

ONE = Interval(1.0, 1.0, 1.0)


def cause(effect: str, axis: int | None = None) -> Cause:
    return Cause(effect, axis, 0.9, {}, {}, ONE)


@pytest.mark.parametrize(
    ("effect", "words"),
    [
        ("coulomb_friction", "Coulomb friction"),
        ("stribeck_friction", "Stribeck friction"),
        ("load_dependent_friction", "load-dependent friction"),
        ("payload", "a payload"),
        ("backlash", "backlash"),
        ("input_delay", "an input delay"),
        ("torque_offset", "a torque offset"),
        ("joint_stiffness", "the machine's joint stiffness"),
        ("torque_constant", "the machine's torque constant"),
        ("nonlinear_stiffness", "nonlinear stiffness"),
    ],
)
def test_an_effect_has_its_article_and_capitals(effect, words):
    assert phrase(effect) == words


@pytest.mark.parametrize("verdict", ["none", "unknown", "explained", "undecidable"])
@pytest.mark.parametrize("causes", [(), (cause("payload"),)])
def test_positions_have_a_gap_of_their_own(verdict, causes):
    if verdict in ("explained", "undecidable") and not causes:
        return
    rivals = (("payload", "link_mass@2"),) if verdict == "undecidable" else ()
    facts = Facts(verdict, gap(0.3, 0.3, 0.06, 0.05, 3), (), causes, rivals)
    by_torque = headline(facts)
    text = headline(replace(facts, gap=replace(facts.gap, compared="positions")))
    assert "of the torque" in by_torque
    expected = by_torque.replace("of the torque", "of the commanded torque")
    for before, after in (
        ("gap on", "gap of positions on"),
        ("the gap of 30", "the gap of positions of 30"),
    ):
        expected = expected.replace(before, after)
    assert text == expected


@pytest.mark.parametrize(
    ("label", "words"),
    [
        ("backlash@2", "backlash on axis 2"),
        ("payload", "a payload"),
        ("axis_coupling@5,6", "axis coupling on axes 5 and 6"),
        ("torque_constant@2", "another torque constant on axis 2"),
        ("link_com@1", "another link centre of mass on axis 1"),
        ("gravity_compensation@3", "gravity compensation on axis 3"),
    ],
)
def test_labels_in_words(label, words):
    assert placed(label) == words


def test_torques_from_positions_say_so():
    logged = explained()
    told = replace(logged, gap=replace(logged.gap, compared="positions"))
    slides = replace(told, provenance={"axis_kinds": ["prismatic"]})
    units = [torque_unit(x, 1) for x in (logged, told, slides)]
    assert units == ["Nm", "Nm, from positions", "N, from positions"]
    words = [torque_word(unit) for unit in (*units, "N")]
    assert words == ["motor torque", "commanded torque", "commanded force", "motor force"]


@pytest.mark.parametrize("name", effect_table())
def test_every_effect_can_stand_in_a_sentence(name):
    assert "_" not in phrase(name)
    assert phrase(name).endswith(noun(name))
    assert title(name)[0].isupper()
    assert plain_name(name) == title(name)


@pytest.mark.parametrize(
    ("causes", "words"),
    [
        ([cause("coulomb_friction", 2)], "Coulomb friction on axis 2"),
        ([cause("payload")], "a payload"),
        (
            [cause("backlash", 1), cause("input_delay", 3)],
            "backlash on axis 1 and an input delay on axis 3",
        ),
        ([cause("coulomb_friction", a) for a in (5, 1, 2)], "Coulomb friction on axes 1, 2 and 5"),
        (
            [cause(e, a) for a in range(1, 7) for e in ("coulomb_friction", "viscous_friction")],
            "Coulomb and viscous friction on all six axes",
        ),
        (
            [cause("torque_ripple", 1), cause("resolver_ripple", 2)],
            "torque ripple on axis 1 and resolver ripple on axis 2",
        ),
    ],
)
def test_causes_are_grouped(causes, words):
    assert named(causes, 6) == words


def test_a_page_without_a_verdict_says_nothing_of_a_gap():
    noisy = gap(0.5, 0.5, 0.5, 0.9, 3)
    text = headline(Facts("unknown", noisy, withdrawn=Withdrawal("noise", 0.5, 0.5, 0.9)))
    page = render_report(replace(of("unknown"), gap=noisy, headline=text))
    assert '<span class="badge unknown">No verdict</span>' in page
    assert "The estimated noise is larger than the gap" in page
    assert "A gap remains" not in page
    assert "A gap remains" in render_report(of("unknown"))
