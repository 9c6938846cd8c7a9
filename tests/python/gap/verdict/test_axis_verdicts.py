"""Axes, arm, places, map cells and words never contradict: properties of random verdicts, and made-up cases."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from axisight import Settings
from axisight.gap.facts.axis_names import at_floor, verdict_word
from axisight.gap.facts.result import AxisVerdict, Candidate, Cause, Interval
from axisight.gap.facts.withdrawal import Withdrawal
from axisight.gap.measure.gap_figures import Stage, Stages, gap_figures
from axisight.gap.measure.where import BAND_EDGES_HZ
from axisight.gap.verdict.assembled import _places
from axisight.gap.verdict.axis_verdicts import (
    Acting,
    AxisEvidence,
    axis_verdicts,
    verdict_told,
    with_axes_agreed,
)
from axisight.gap.verdict.carry_over import far_above_floor
from axisight.gap.verdict.conclusion import AxisStanding, Conclusion
from axisight.gap.verdict.headline import Facts, headline
from axisight.report.wording import gap_maps
from diagnosis_data import explained, gap

SETTINGS = Settings()
SHARES = st.floats(0.001, 3.0) | st.just(float("nan"))


@st.composite
def axis_evidence(draw) -> AxisEvidence:
    floor = draw(st.floats(0.001, 1.0))
    refitted, after = draw(SHARES), draw(SHARES)
    # What passes for the floor is more than the scatter of the floor itself, as `above_floor` has it.
    above = draw(st.booleans()) and not at_floor(refitted, floor)
    sizes = draw(st.floats(-0.5, 50.0)), draw(st.floats(-1.0, 1.0))
    return AxisEvidence(*sizes, refitted, after, floor, above, draw(st.booleans()))


@st.composite
def verdicts(draw):
    """A verdict of the arm, what is known of its axes, and causes as such a verdict has them."""
    evidence = draw(st.lists(axis_evidence(), min_size=1, max_size=7))
    n = len(evidence)
    arm = draw(st.sampled_from(["none", "explained", "unknown", "undecidable"]))
    places = st.lists(st.integers(1, n), min_size=0, max_size=2, unique=True).map(tuple)
    causes = draw(
        st.lists(st.builds(Acting, places, st.booleans()), min_size=1, max_size=5)
        if arm in ("explained", "undecidable")
        else st.lists(st.builds(Acting, places), max_size=0 if arm == "none" else 3)
    )
    if arm == "undecidable" and not any(c.open for c in causes):
        causes[0] = replace(causes[0], open=True)
    if arm == "explained":
        causes = [replace(c, open=False) for c in causes]
    own = draw(st.booleans())
    return arm, evidence, causes, own


@given(verdicts())
def test_axes_agree_with_the_arm_and_with_the_gap(made):
    arm, evidence, causes, own = made
    axes = axis_verdicts(arm, evidence, causes, SETTINGS, own_residual=own)
    words = [a.verdict for a in axes]
    assert [a.axis for a in axes] == list(range(1, len(evidence) + 1))
    # The arm has the verdict of one of its axes at least, and never a milder one than any of them.
    assert arm in words or (arm == "explained" and "explained_in_part" in words)
    known = {"none", "explained", "explained_in_part"}
    if own:
        # Errors of axes add up: an axis where nothing acts is explained by nothing.
        known |= {"unknown"}
    allowed = {
        "none": {"none"},
        "explained": known,
        "undecidable": known | {"undecidable"},
        "unknown": known | {"unknown"},
    }
    assert set(words) <= allowed[arm]
    for axis, e in zip(axes, evidence, strict=True):
        own_causes = {k for k, c in enumerate(causes) if axis.axis in c.axes}
        whole = {k for k, c in enumerate(causes) if not c.axes}
        # Causes of an axis act there; those of the whole arm may.
        assert own_causes <= set(axis.causes) <= own_causes | whole
        if axis.verdict == "none":
            assert axis.causes == ()
            assert arm == "none" or not e.above
            assert arm == "none" or not e.has_gap(SETTINGS, own_residual=own)
        assert axis.verdict != "explained_in_part" or e.left
        assert axis.verdict != "explained" or not e.left
        if axis.verdict == "undecidable":
            assert any(causes[k].open for k in axis.causes)
    # An axis at its floor is *unknown* by evidence of its own alone, or for an arm of which no axis stands out.
    quiet = [
        a for a, e in zip(axes, evidence, strict=True)
        if a.verdict == "unknown" and e.quiet and not (own and e.excess > 1.0)
    ]  # fmt: skip
    assert len(quiet) <= 1 and (not quiet or words.count("unknown") == 1)


@given(verdicts(), st.randoms(use_true_random=False))
def test_places_ranking_words_and_cells_agree_with_the_axes(made, random):
    arm, evidence, causes, own = made
    axes = axis_verdicts(arm, evidence, causes, SETTINGS, own_residual=own)
    words = {a.axis: a.verdict for a in axes}
    rng = np.random.default_rng(random.randrange(2**32))
    conclusion = of_arm(arm, axes)
    bands, regimes = maps(rng, len(axes))
    places = _places(conclusion, (bands, regimes, 3.0), SETTINGS)
    assert (places == ()) if arm == "none" else True
    of_causes = {"explained", "explained_in_part", "undecidable"}
    told = {"unknown"} if arm == "unknown" else of_causes | ({"unknown"} if own else set())
    assert {words[p.axis] for p in places} <= told
    if arm == "unknown":
        # The table of candidates is that of the place named first.
        ranked = conclusion.ranked_on(places[0].axis)
        assert {c.axis for c in ranked.ranking} == {places[0].axis}
    elif arm != "none":
        assert all("before the causes" in p.evidence for p in places)
    facts = Facts(arm, table(evidence), axes, named(arm, causes), where=places)
    text = headline(facts)
    mentioned = axes_in(text)
    # Of an arm that lacks nothing, words are about its tolerances and its noise.
    quiet = {a for a, word in words.items() if word == "none" and arm != "none"}
    assert not mentioned & quiet, f"{text} names axes {mentioned & quiet}, which are none"
    left = facts.gap.after_per_axis if facts.causes else facts.gap.refitted_per_axis
    unknown = {
        a for a, word in words.items()
        if word == "unknown" and not at_floor(left[a - 1], facts.gap.floor_per_axis[a - 1])
    }  # fmt: skip
    assert unknown <= mentioned, f"{text} does not name axes {unknown - mentioned}"
    shown = replace(
        explained(len(axes)), axes=axes, verdict=arm, band_map=bands, regime_maps=regimes
    )
    for m in gap_maps(shown):
        quiet = [i for i, axis in enumerate(m.axes) if words[axis] == "none"]
        assert not m.significant[quiet].any()


def axes_in(text: str) -> set[int]:
    """The axes that a text names: "axis 2", "axes 1, 2 and 3", but not the 4 of "axis 2 and 4 more effects"."""
    lists = re.findall(
        r"\baxis (\d+)|\baxes (\d+(?:(?:, | and )\d+\b(?! more))*)", text, re.IGNORECASE
    )
    return {int(n) for found in lists for n in re.findall(r"\d+", "".join(found))}


def test_mentions_of_axes():
    text = "Axis 4 leads. Axes 1, 2 and 3 have one too: on axis 5 and 7 more effects, on axes 8 and 9 and 6 more."
    assert axes_in(text) == {1, 2, 3, 4, 5, 8, 9}


def maps(rng: np.random.Generator, n_axes: int) -> tuple[xr.Dataset, dict[str, xr.Dataset]]:
    edges = BAND_EDGES_HZ[:4]

    def cells(dim: str, n: int) -> xr.Dataset:
        square = rng.normal(0.1, 0.1, (n_axes, n))
        data = {
            "share": np.abs(square), "excess": 1 + square,
            "significance": rng.normal(3.0, 3.0, square.shape), "square": square,
        }  # fmt: skip
        return xr.Dataset(
            {k: (("axis", dim), v) for k, v in data.items()},
            coords={"axis": np.arange(1, n_axes + 1), dim: [f"cell {k}" for k in range(n)]},
        )

    bands = cells("band", 3)
    bands = bands.assign_coords(
        low_hz=("band", list(edges[:-1])), high_hz=("band", list(edges[1:]))
    )
    return bands, {"speed": cells("bin", 4)}


def of_arm(arm, axes: tuple[AxisVerdict, ...]) -> Conclusion:
    """A conclusion whose table of candidates is that of the last axis."""
    standings = [
        AxisStanding(a.axis, (Candidate("backlash", a.axis, 0.5, 0.5, 3.0, ""),), 0.25, 0.25)
        for a in axes
    ]
    ranking = standings[-1].ranking
    return Conclusion(
        arm, (), (), (), None, ranking, 0.0, 0.0, axes, (), standings=tuple(standings)
    )


def table(evidence):
    rows = np.array([[e.refitted, e.refitted, e.after, e.floor] for e in evidence])
    whole = gap(0.3, 0.3, 0.1, 0.05, len(evidence))
    parts = ("before_per_axis", "refitted_per_axis", "after_per_axis", "floor_per_axis")
    return replace(whole, **dict(zip(parts, rows.T, strict=True)))


def named(arm, causes) -> tuple[Cause, ...]:
    one = Interval(0.9, 0.8, 1.0)
    if arm == "none":
        return ()
    return tuple(
        Cause("axis_coupling" if len(c.axes) == 2 else "backlash" if c.axes else "payload",
              c.axes[0] if c.axes else None, 0.9, {}, {}, one,
              axes=c.axes if len(c.axes) == 2 else None)
        for c in causes
    )  # fmt: skip


AT_FLOOR = AxisEvidence(0.05, 0.0, 0.055, 0.055, 0.056)
ABOVE = AxisEvidence(20.0, 0.1, 0.78, 0.77, 0.014, above=True)
REMOVED = AxisEvidence(20.0, 0.95, 0.4, 0.06, 0.056, above=True)
# In a loop: what another axis does shows here.
FELT = AxisEvidence(3.0, 0.1, 0.055, 0.055, 0.056)
OWN, ARM = Acting((1,)), Acting(())


@pytest.mark.parametrize(
    ("arm", "evidence", "causes", "labels"),
    [
        ("unknown", [AT_FLOOR, ABOVE], [], ["none", "unknown"]),
        ("unknown", [FELT, ABOVE], [], ["none", "unknown"]),
        ("unknown", [AT_FLOOR, FELT], [], ["none", "unknown"]),
        ("unknown", [REMOVED, ABOVE], [OWN], ["explained", "unknown"]),
        ("unknown", [REMOVED, ABOVE], [], ["unknown", "unknown"]),
        ("explained", [REMOVED, AT_FLOOR], [OWN], ["explained", "none"]),
        # Its gap goes with the cause of the other axis.
        ("explained", [AT_FLOOR, REMOVED], [OWN], ["explained", "explained"]),
        ("explained", [AT_FLOOR, REMOVED], [ARM], ["none", "explained"]),
        ("explained", [AT_FLOOR, AT_FLOOR], [ARM], ["explained", "explained"]),
        ("undecidable", [REMOVED, REMOVED], [Acting((1,), True)], ["undecidable", "explained"]),
        ("undecidable", [AT_FLOOR, REMOVED], [Acting((), True)], ["none", "undecidable"]),
        ("none", [AT_FLOOR, FELT], [], ["none", "none"]),
    ],
)  # fmt: skip
def test_labels_of_axes(arm, evidence, causes, labels):
    found = axis_verdicts(arm, evidence, causes, SETTINGS, own_residual=False)
    assert [a.verdict for a in found] == labels


def test_by_inverse_dynamics_the_residual_of_an_axis_is_its_own():
    found = axis_verdicts("unknown", [FELT, ABOVE], [], SETTINGS, own_residual=True)
    assert [a.verdict for a in found] == ["unknown", "unknown"]


@pytest.mark.parametrize(
    ("row", "word"),
    [
        ((0.4, 0.4, 0.06, 0.055), "explained"),
        ((0.055, 0.055, 0.055, 0.056), "at the floor"),
        # The re-fit alone removes it: the cause has nothing left to explain there.
        ((0.216, 0.0532, 0.0532, 0.0577), "at the floor"),
    ],
)
def test_an_explained_axis_in_words(row, word):
    assert verdict_word("explained", row) == word
    assert verdict_word("explained_in_part", row) == "explained in part"


def test_the_gear_that_both_encoders_contradict_is_the_unknown_axis():
    """Whatever axis stands highest above its floor; the headline names the axis of the gear."""
    axes = (AxisVerdict(1, "none", 0.0, 0.0, ()), AxisVerdict(2, "none", 0.1, 0.0, ()))
    seen = Stages(*(stage_of([1.0, x]) for x in (1.1, 1.1, 1.1, 1.0)))
    contradicted = replace(of_arm("unknown", axes), withdrawn=Withdrawal("gear", axis=1, share=9.0))
    found = with_axes_agreed(contradicted, seen, gap_figures(seen), SETTINGS, own_residual=False)
    assert [a.verdict for a in found.axes] == ["unknown", "none"]


LEFT = replace(REMOVED, after=0.2, left=True)


@pytest.mark.parametrize(
    ("arm", "evidence", "causes", "labels", "told"),
    [
        ("explained", [LEFT, AT_FLOOR], [OWN], ["explained_in_part", "none"], "explained_in_part"),
        ("explained", [LEFT, REMOVED], [ARM], ["explained_in_part", "explained"], "explained_in_part"),
        ("explained", [REMOVED, replace(AT_FLOOR, left=True)], [OWN], ["explained", "none"], "explained"),
        # What is open stays open, whatever is left.
        ("undecidable", [LEFT], [Acting((1,), True)], ["undecidable"], "undecidable"),
        # Little of the arm is explained: causes on other axes may imitate what is missing.
        ("unknown", [REMOVED, ABOVE], [OWN], ["explained", "unknown"], "unknown"),
        ("unknown", [ABOVE], [], ["unknown"], "unknown"),
        ("none", [replace(AT_FLOOR, left=True)], [], ["none"], "none"),
    ],
)  # fmt: skip
def test_what_causes_leave_far_above_the_floor_is_told(arm, evidence, causes, labels, told):
    axes = axis_verdicts(arm, evidence, causes, SETTINGS, own_residual=False)
    assert [a.verdict for a in axes] == labels
    assert verdict_told(replace(of_arm(arm, axes), causes=tuple(causes))) == told


def stage_of(*rows: list[float]) -> Stage:
    return Stage(tuple(np.square(row)[None] for row in rows), 0.1)


def test_twice_the_floor_with_the_error_of_formulas():
    """On two logs: squares are averaged, so that one log with half of its gap left stands for both."""
    floor, noisy = stage_of([0.02, 0.001], [0.02, 0.001]), stage_of([0.03, 0.0], [0.03, 0.0])
    # Twice hypot(0.02, 0.01) is 0.0447, twice hypot(0.001, 0.01) is 0.0201.
    for after, axes in [
        (stage_of([0.044, 0.02], [0.044, 0.02]), [False, False]),
        (stage_of([0.046, 0.021], [0.046, 0.021]), [True, True]),
        (stage_of([0.0, 0.0], [0.0, 0.03]), [False, True]),
    ]:
        stages = Stages(after, after, after, floor)
        assert far_above_floor(stages, 0.01).tolist() == axes
    # What no data can explain does not count.
    stages = Stages(after, after, stage_of([0.046, 0.03], [0.046, 0.03]), floor, noisy)
    assert far_above_floor(stages, 0.01).tolist() == [False, True]
