"""An effect is whole in one place: its definition; its start values stand in one table."""

import re
from dataclasses import fields
from itertools import zip_longest
from pathlib import Path

import pytest

from axisight import _core
from axisight.effects import Effect, EffectInfo, effect_table
from axisight.effects.friction_curves import CURVES
from axisight.gap.facts.settings import DEFAULT_TOLERANCES
from axisight.gap.hypotheses.start_values import STARTS
from axisight.gap.ranking.likelihood import FORMULA_ERROR
from axisight.gap.verdict.separating_advice import separating_experiment

TABLE = effect_table()
# What may know an effect by name: its definition, and the tables made for it.
KNOWING = (
    "crates/axisight-core/src/effects/",
    "python/axisight/gap/hypotheses/start_values.py",
    "python/axisight/effects/stated.py",
    # Closed forms of the laws of gears and of friction, which tests hold against simulations.
    "python/axisight/effects/gear_curves.py",
    "python/axisight/effects/friction_curves.py",
    # What a benchmark withholds has the names that verdicts give it.
    "python/axisight/blind/withheld.py",
    "python/axisight/blind/withheld_formulas.py",
)


def test_the_core_says_all_that_the_class_holds() -> None:
    row = _core.effect_table()[0]
    assert list(row) == [f.name for f in fields(EffectInfo)]


def test_every_effect_has_start_values_and_no_entry_is_stray() -> None:
    pairs = enumerate(zip_longest(STARTS, TABLE, fillvalue="nothing"), start=1)
    wrong = [f"entry {i}: STARTS has {a}, mod.rs has {b}" for i, (a, b) in pairs if a != b]
    assert not wrong, wrong[0]


def test_effects_of_one_kind_of_formula_share_its_error() -> None:
    """They are held against one another by one error: that of the kind."""
    errors: dict[str, set[float]] = {}
    for info in TABLE.values():
        errors.setdefault(info.formula.kind, set()).add(info.formula.error)
    assert {kind: len(found) for kind, found in errors.items()} == dict.fromkeys(errors, 1)


@pytest.mark.parametrize("info", TABLE.values(), ids=TABLE)
def test_what_an_effect_is_akin_to_is_in_the_table(info: EffectInfo) -> None:
    own = {p.name for p in info.parameters}
    if info.plainer is not None:
        law = TABLE[info.plainer.law]
        assert set(info.plainer.adds) <= own and info.plainer.likelier > 1
        assert law.scope == info.scope
        assert not info.plainer.by_rise or info.name in CURVES
    if info.resembles is not None:
        # Of one number, which is in proportion to one of its own.
        (p,) = TABLE[info.resembles.law].parameters
        values = info.resembles.values(p.typical)
        assert values.keys() == own
        Effect(info.name, 1, values)
    if info.begun_from is not None:
        law = TABLE[info.begun_from.law]
        names, takes = {p.name for p in law.parameters}, info.begun_from.takes
        assert info.begun_from.law in info.contains
        # A way to write a law may be that of this law alone.
        assert names - set(law.marked("notation")) <= set(takes) <= names
        assert set(takes.values()) <= own
    if info.later is not None:
        later = info.later
        assert {later.amplitude, later.shape} <= own
        assert later.shape in {p.name for p in TABLE[later.as_of].parameters}
        (neutral,) = (p.neutral for p in info.parameters if p.name == later.amplitude)
        assert neutral < later.begin < later.most
    if info.spring is not None:
        assert {n for names in info.spring.sums for n in names} <= own
        assert info.acts == TABLE[info.spring.without_middle].acts == "transmission"
    # A cause beside which it is asked for is one it becomes.
    assert set(info.beside) <= set(info.contains)


@pytest.mark.parametrize("info", TABLE.values(), ids=TABLE)
def test_formulas_differ_as_what_they_describe_does(info: EffectInfo) -> None:
    formula = info.formula
    kinds = {"timing": "lag", "friction": "friction"}
    assert formula.kind == kinds.get(info.family, "exact" if formula.exact else None)
    assert 0 < formula.error <= FORMULA_ERROR and 0 < formula.value_error < 0.05
    # What a linear model holds is the same in all books, but for how a controller holds its command.
    assert formula.of_each == (info.linear == "no" or info.family == "timing")
    # Of an effect without a kind the error is that of formulas in general.
    assert formula.kind is not None or formula.error == FORMULA_ERROR
    assert (info.law_of == "gear") == (info.family == "transmission")
    assert (info.law_of == "dry_friction") == ("coulomb_friction" in {info.name, *info.contains})
    # What scales as a torque constant does changes bodies, weights or poses.
    assert info.scales is None or (formula.exact and info.family in {"load", "arm"})


@pytest.mark.parametrize("info", TABLE.values(), ids=TABLE)
def test_an_effect_states_all_of_itself(info: EffectInfo) -> None:
    assert info.summary and info.equation and len(info.source) > 20
    assert info.parameters
    assert any(p.role == "amplitude" for p in info.parameters)
    # Effects that it names are effects, of the same scope, and other ones.
    for name in (*info.contains, *info.parts, *info.usual, *info.twins):
        # What is usual instead of one link may be of the whole arm.
        assert TABLE[name].scope == info.scope or (
            name in info.usual and TABLE[name].scope == "arm"
        )
        assert name != info.name
    assert all(info.name in TABLE[name].contained_in for name in info.contains)
    assert all(info.name not in TABLE[name].contains for name in info.contains)
    assert len(info.parts) in (0, 2)
    # A mode beyond what a motion excites is an inertia of its link.
    families = {info.family, "load"} if info.family == "arm" else {info.family}
    assert all(TABLE[name].family in families for name in info.usual)
    # A parameter that it stands for has a tolerance beyond which it is an effect.
    if info.stands_for is not None:
        assert info.stands_for[0] in DEFAULT_TOLERANCES
        assert len(info.parameters) == 1
    # Where a rigid gear stands in its place, torque cannot hold it.
    if info.acts in ("transmission", "sensor"):
        assert not info.inverse_dynamics
    # Somebody who cannot tell it from another is told what would.
    assert separating_experiment([f"{info.name}@1"])


def test_no_other_file_knows_an_effect_by_name(repository: Path) -> None:
    names = "|".join(TABLE)
    # Quoted names; quantities of the robot that share a name with an effect are none.
    shared = {"viscous_friction", "motor_inertia"}
    # Terms of a torque model and quantities that fits find, which are named as in the field.
    terms = {
        "rigid_body/friction.py": {"coulomb_friction", "torque_offset"},
        "rigid_body/estimate.py": {"coulomb_friction"},
        "rigid_body/checks.py": {"coulomb_friction"},
        "graybox/robot_values.py": {"torque_offset", "backlash"},
        # A key of controllers that are told positions.
        "robot_file/reader.rs": {"gravity_compensation"},
        "gap/controller/speed_loop.py": {"gravity_compensation"},
        "robot_import/description.py": {"gravity_compensation"},
        # A field of MuJoCo's models.
        "robot_import/mjcf/sensors.py": {"sensor_delay"},
        # A load that is mounted, as drive data or a log state it.
        "cli/model_options.py": {"payload"},
        "fitting/loads.py": {"payload"},
        "frequency_fit/fit.py": {"payload"},
        # Terms of the regression of step 1, and how a report calls them.
        "graybox/multiaxis/rigid_step.py": {"coulomb_friction", "torque_offset"},
        "graybox/multiaxis/joint_step.py": {"coulomb_friction"},
        "graybox/multiaxis/report.py": {"coulomb_friction"},
        # Terms whose values over days are compared.
        "repeats/columns.py": {"coulomb_friction", "torque_offset"},
        "repeats/findings.py": {"coulomb_friction"},
        "repeats/result.py": {"coulomb_friction"},
        # Functions that write the tables of (8.2).
        "effects/ripple.py": {"torque_ripple", "resolver_ripple"},
        "effects/__init__.py": {"torque_ripple", "resolver_ripple"},
    }
    strays = []
    for folder in ("crates", "python"):
        for path in sorted((repository / folder).rglob("*")):
            name = path.relative_to(repository).as_posix()
            if path.suffix not in (".rs", ".py") or name.startswith(KNOWING):
                continue
            text = path.read_text("utf-8")
            text = text.split("#[cfg(test)]")[0]
            allowed = shared.union(*(v for k, v in terms.items() if name.endswith(k)))
            found = set(re.findall(f'"({names})"', text)) - allowed
            strays += [f"{name}: {', '.join(sorted(found))}"] if found else []
    assert not strays
