"""The screen of a diagnosis: 25 lines for any verdict, as the files in `screens` have it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from axisight.cli.summary import MOST_LINES, next_steps, summary
from axisight.gap.facts.result import AxisVerdict, Cause, DetectionLimit, Finding, Gap, Interval
from diagnosis_data import explained, hostile, of

SCREENS = Path(__file__).parent / "screens"
WIDTH = 100
JOINTS = ["base", "shoulder_lift_joint", "elbow_joint", "wrist_1", "wrist_2", "wrist_3"]


def with_joints(found, names):
    kinds = ["revolute"] * len(names)
    told = {**found.provenance, "axis_names": names, "axis_kinds": kinds}
    return replace(found, provenance=told)


def friction(effect: str, axis: int, nm: float) -> Cause:
    values = {
        "coulomb_friction": {"coulomb_nm": (nm, "Nm"), "smoothing_rad_s": (0.0123456789, "rad/s")},
        "viscous_friction": {"viscous_nm_s_rad": (nm / 100, "Nm s/rad")},
    }[effect]
    return Cause(
        effect,
        axis,
        0.9876543,
        {k: Interval(x, 0.9 * x, 1.1 * x) for k, (x, _) in values.items()},
        {k: unit for k, (_, unit) in values.items()},
        Interval(0.9, 0.8, 0.95),
    )


def twelve_causes():
    """Two kinds of friction on each of six axes, with findings and a file that is written."""
    per_axis = np.array([0.31, 0.2876543219, 0.25, 0.4, 0.18, 0.222])
    causes = tuple(
        friction(effect, i, 0.1234567 * i)
        for effect in ("coulomb_friction", "viscous_friction")
        for i in range(1, 7)
    )
    flags = tuple(
        Finding(
            "parameter_at_edge", "flag", "ended +32 % off, at the bound", field=f"axis{i}.damping"
        )
        for i in range(1, 5)
    )
    found = replace(
        explained(),
        headline="The simulator lacks Coulomb and viscous friction on all six axes: adding them shrinks "
        "the gap on held-out data from 29 % to 2.1 % of the torque (noise alone: 2 %).",
        causes=causes,
        gap=Gap(
            0.29, 0.28, 0.021, 0.02, per_axis, 0.97 * per_axis, 0.07 * per_axis, 0.068 * per_axis
        ),
        axes=tuple(AxisVerdict(i, "explained", 2.0, 0.95, (i - 1, i + 5)) for i in range(1, 7)),
        findings=flags,
    )
    return with_joints(found, JOINTS)


def none():
    found = of("none")
    axes = tuple(AxisVerdict(i, "none", 0.1, 0.0, ()) for i in (1, 2, 3))
    limits = (DetectionLimit("payload", None, "mass_kg", 0.2, "kg"),)
    unchanged = {f"axis{i}.mass": Interval(1e-6, -1e-6, 3e-6) for i in (1, 2, 3)}
    return replace(found, axes=axes, detection_limits=limits, refit=unchanged)


SITUATIONS = {
    "one_cause": with_joints(explained(), JOINTS[:3]),
    "none": none(),
    "unknown": of("unknown"),
    "undecidable": of("undecidable"),
    "twelve_causes": twelve_causes(),
}


@pytest.mark.parametrize("name", SITUATIONS)
def test_a_screen_is_as_stored(name):
    """Write the file anew by deleting it and running this test once."""
    lines = summary(SITUATIONS[name], WIDTH)
    path = SCREENS / f"{name}.txt"
    text = "\n".join(lines) + "\n"
    if not path.exists():
        path.write_text(text, "utf-8")
        pytest.fail(f"{path.name} was not there and is written: look at it")
    assert text == path.read_text("utf-8")
    assert len(lines) <= MOST_LINES
    assert max(map(len, lines)) <= WIDTH


@pytest.mark.parametrize("name", SITUATIONS)
@pytest.mark.parametrize("width", [80, 100, 200])
def test_what_a_screen_may_hold(name, width):
    lines = summary(SITUATIONS[name], width)
    assert max(map(len, lines)) <= width
    assert len(lines) <= MOST_LINES
    text = "\n".join(lines)
    for word in (
        "null",
        "None",
        "nan",
        "+0 %",
        "1 rounds",
        "1 findings",
        "0.9876543",
        "0.0123456789",
    ):
        assert word not in text, word
    assert lines[0].startswith(SITUATIONS[name].verdict)
    assert any(line.startswith("next: ") for line in lines)


def test_files_that_are_written_take_lines_and_are_not_offered():
    given = ("--json", "--report", "--write-model", "--signals")
    for found in SITUATIONS.values():
        assert len(summary(found, WIDTH, given)) <= MOST_LINES - len(given)
    assert next_steps(explained(), given) == [
        "Diagnose again with the model that was written: the verdict should be none."
    ]
    assert "--report" in " ".join(next_steps(explained(), ["--json"]))
    assert "Diagnose again" not in " ".join(next_steps(explained(), ["--report"]))


def test_every_verdict_but_none_has_a_next_step():
    for found in SITUATIONS.values():
        steps = next_steps(replace(found, next_experiment=None), ["--report", "--next-experiment"])
        assert steps, found.verdict


def test_another_command_stands_before_its_options():
    (step,) = next_steps(explained(), ["--report"], "axisight diagnose demo/case")
    assert step.startswith("axisight diagnose demo/case --write-model FILE writes")


def test_an_experiment_is_offered_where_one_can_be_designed():
    found = of("undecidable")
    assert "--next-experiment" in " ".join(next_steps(found))
    inverse = replace(found, mode="inverse_dynamics")
    assert "the motions that tell the causes apart" in " ".join(next_steps(inverse))
    assert "a record that shows more" in " ".join(next_steps(of("unknown")))
    assert "--next-experiment" not in " ".join(next_steps(explained()))


def test_of_many_axes_those_with_the_largest_gaps_are_told():
    n = 20
    figures = np.full(n, 0.05)
    before = figures.copy()
    before[[3, 17]] = 0.4
    before[9] = np.nan
    gap = Gap(0.2, 0.2, 0.05, 0.05, before, before, figures, figures)
    found = replace(explained(), gap=gap, axes=())
    lines = summary(found, WIDTH)
    assert len(lines) <= MOST_LINES
    told = [line.split()[1] for line in lines if line.startswith("axis ")]
    assert {"4", "18", "10"} <= set(told)
    assert f"and {n - len(told)} more axes, with less of a gap: --verbose" in lines


def test_of_many_axes_those_that_are_not_judged_are_told_last():
    n = 20
    figures = np.full(n, 0.05)
    figures[9] = np.nan
    axes = tuple(
        AxisVerdict(i, "not_judged" if i == 10 else "none", 0.0, 0.0, ()) for i in range(1, n + 1)
    )
    found = replace(explained(), gap=Gap(0.2, 0.2, 0.05, 0.05, *[figures] * 4), axes=axes)
    assert not any(line.startswith("axis 10 ") for line in summary(found, WIDTH))


def test_findings_that_matter_come_first_and_the_rest_is_counted():
    minor = explained().findings[0]
    major = Finding("simulator_differs", "flag", "expected a model " + "word " * 40, field="axis 1")
    lines = summary(replace(explained(), findings=(minor, minor, minor, major)), WIDTH)
    told = [line for line in lines if line.startswith("finding: ")]
    assert told[0].startswith("finding: simulator_differs: axis 1: expected a model")
    assert told[0].endswith(" ...")
    # Those of one kind are one line.
    (same,) = [line for line in lines if line.startswith("3 findings, first: ")]
    assert same.startswith(f"3 findings, first: {minor.name}: ")


def test_kinds_of_findings_beyond_the_first_are_counted():
    found = [
        Finding(name, "flag", "expected another model", field=f"axis {k}")
        for name in ("refit_worse", "torque_scaled", "rows_repeated", "rows_missing")
        for k in (1, 2)
    ]
    lines = summary(replace(explained(), findings=tuple(found)), WIDTH)
    assert "2 findings, first: refit_worse: axis 1: expected another model" in lines
    assert "and 2 more: --verbose shows all findings in full" in lines


def test_hostile_texts_stay_on_their_lines():
    lines = summary(hostile(), WIDTH)
    assert all("\n" not in line for line in lines)
