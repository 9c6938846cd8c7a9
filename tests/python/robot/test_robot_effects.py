"""Robot files of version 2: effects and tolerances read, acting everywhere, and written back."""

import pickle
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from test_diagnose import bare_axis, logs_of

from axisight import (
    Effect,
    InputError,
    Robot,
    RobotError,
    Settings,
    diagnose,
    effects,
    fit,
    load_robot,
    montecarlo,
    simulate,
    simulate_batch,
)
from axisight.fitting import effect_parameter
from axisight.frequency_fit import model_response, planned_information
from axisight.gap.facts.settings import DEFAULT_TOLERANCES
from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant
from axisight.gap.signals.motion import motion
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.robot_file import Provenance, identified, write_identified
from axisight.robot_file.document import render
from axisight.robot_file.effect_tables import stated
from montecarlo_data import same_bits, small_study

ARM = load_robot("irb6600_like")
SOURCE = Provenance("test")
SPRING = Effect("joint_stiffness", 2, {"relative_change": 0.1})
FRICTION = Effect("coulomb_friction", 2, {"coulomb_nm": 0.4, "smoothing_rad_s": 0.2})
RIPPLE = Effect("torque_ripple", 1, {"order_1": 3.0, "sine_1_nm": 0.06})
RESOLVER = Effect("resolver_ripple", 3, {"order_1": 2.0, "sine_1_rad": 1e-3})
DELAY = Effect("input_delay", 1, {"delay_s": 1e-3})
PAYLOAD = Effect("payload", None, {"mass_kg": 40.0, "x_m": 0.2})


def with_tables(text: str, *tables: str) -> str:
    """The text of a robot as one of version 2, with these tables at its end."""
    return "\n".join([text.replace("axisight.robot/1", "axisight.robot/2"), *tables])


def stating(*given: Effect) -> Robot:
    """The arm whose file states these effects."""
    robot = Robot.from_toml(stated(ARM.toml, given))
    assert robot.effects == given
    return robot


# Reading.


def test_files_of_version_1_are_read_as_before() -> None:
    assert 'schema = "axisight.robot/1"' in ARM.toml
    assert ARM.effects == () and ARM.tolerances == {}
    for table in ('[[effect]]\nname = "backlash"\naxis = 1\n', "[tolerances]\nmass = 0.1\n"):
        with pytest.raises(RobotError, match=r"line 9\d: unknown key `(effect|tolerances)`"):
            Robot.from_toml(f"{ARM.toml}\n{table}")


def test_presets_state_their_effects() -> None:
    robot = load_robot("two_mass_axis")
    tables = tomllib.loads(robot.toml)["effect"]
    assert [e.label for e in robot.effects] == [f"{t['name']}@{t['axis']}" for t in tables]
    assert robot.effects[1].parameters == {
        "coulomb_nm": 0.644,
        "smoothing_rad_s": 0.01,
        "arm_share": 0.0,
        "lead_s": 0.0,
    }


def test_parameters_left_out_have_their_neutral_values() -> None:
    text = with_tables(ARM.toml, '[[effect]]\nname = "coulomb_friction"\naxis = 2.0\n')
    (effect,) = Robot.from_toml(text).effects
    assert effect == Effect("coulomb_friction", 2) and not effect.acts
    info = effects.effect_info("coulomb_friction").parameters
    assert effect.parameters == {p.name: p.neutral for p in info}


@pytest.mark.parametrize(
    ("tables", "line", "words"),
    [
        (["name = 'backlash'\naxis = 1", "name = 'backlash'\naxis = 1"], 5, "no other"),
        (["name = 'backlash'\naxis = 1\nwidth_rad = 1.0"], 4, "unknown key .*width_rad"),
        (["name = 'backlash'\naxis = 1\nhalf_width_rad = 0.2"], 4, "expected 0 to 0.05"),
        (["name = 'backlash'\naxis = 1\nhalf_width_rad = nan"], 4, "half_width_rad"),
        (["name = 'backlash'\naxis = 4"], 3, "expected an axis from 1 to 3"),
        (["name = 'backlash'"], 1, "missing key .*axis"),
        (["name = 'payload'\naxis = 1"], 3, "unknown key .*axis"),
        (["name = 'backslash'\naxis = 1"], 2, "expected one of .*backlash"),
    ],
)
def test_impossible_effects_are_refused_with_the_line(tables, line, words, tmp_path: Path) -> None:
    path = tmp_path / "r.toml"
    head = with_tables(ARM.toml, "")
    path.write_text(head + "".join(f"[[effect]]\n{table}\n" for table in tables))
    first = head.count("\n")
    with pytest.raises(RobotError, match=rf"r\.toml: line {first + line}: .*{words}"):
        load_robot(path)


@pytest.mark.parametrize("text", ["springs = 0.1", "mass = 0.0", "mass = 'x'", "mass = nan"])
def test_impossible_tolerances_are_refused(text: str) -> None:
    with pytest.raises(RobotError, match=rf"line \d+: .*{text.split(maxsplit=1)[0]}"):
        Robot.from_toml(with_tables(ARM.toml, "[tolerances]", text, ""))


# Acting.


def motions(robot: Robot, n: int = 200) -> np.ndarray:
    time = np.arange(n) * robot.sample_time_s
    return 20 * np.sin(2 * np.pi * np.outer(time, [4.0, 5.0, 6.0]))


def simulated(robot: Robot, given: list[Effect], **options) -> list[np.ndarray]:
    out = simulate(robot, motions(robot), effects=given, **options)
    return [out[name].values for name in ("position_rad", "torque_cmd_nm", "joint_position_rad")]


def batch(robot: Robot, given: list[Effect]) -> list[np.ndarray]:
    both = np.stack([motions(robot), -motions(robot)])
    return [simulate_batch(robot, both, effects=given, method="rk4")["torque_cmd_nm"].values]


def rest(robot: Robot, given: list[Effect]) -> list[np.ndarray]:
    out = robot.equilibrium([0.0, 0.3, -0.4], effects=given)
    return [out[name].values for name in out]


def linear(robot: Robot, given: list[Effect]) -> list[np.ndarray]:
    lines = [3.0, 11.0]
    return [
        *robot.linearize(effects=given),
        robot.modes(effects=given)["eigenvalue_rad_s"].values,
        robot.zoh_response(lines, effects=given).values,
        model_response(robot, lines, effects=given).values,
        planned_information(
            robot, ["axis1.stiffness"], np.zeros((1, 3)), lines, effects=given
        ).matrix,
        *simulated(robot, given, model="linear"),
    ]


def inverse(robot: Robot, given: list[Effect]) -> list[np.ndarray]:
    log = logs_of(bare_axis(), [], {"m": ("moves", 0)})[0]
    three = replace(
        log,
        velocity_ref_rad_s=None,
        torque_nm=np.repeat(log.torque_nm, 3, axis=1),
        position_rad=np.repeat(log.position_rad, 3, axis=1),
        axis_kinds=(),
    )
    return [predicted_torque(robot, Variant({}, tuple(given)), motion(three, 30.0))]


def studied(robot: Robot, given: list[Effect], folder: Path) -> list[np.ndarray]:
    path = folder / "robot.toml"
    path.write_text(robot.toml)
    entries = [
        montecarlo.EffectEntry(name=e.name, axis=e.axis, parameters=dict(e.parameters))
        for e in given
    ]
    result = montecarlo.run(small_study(robot=str(path), runs=2, effect=entries), threads=1)
    return [result["arithmetic_mean"].values, result["covariance"].values]


@pytest.mark.parametrize(
    ("run", "own"),
    [
        (simulated, [FRICTION, RIPPLE, RESOLVER, DELAY, PAYLOAD, SPRING]),
        (batch, [FRICTION, RIPPLE, RESOLVER, DELAY, PAYLOAD, SPRING]),
        (rest, [PAYLOAD]),
        (linear, [PAYLOAD, SPRING]),
        (inverse, [FRICTION, PAYLOAD]),
        ("linear ripple", [RIPPLE, RESOLVER, SPRING]),
        ("study", [RIPPLE, PAYLOAD]),
    ],
)
def test_effects_of_a_file_act_as_if_given(run, own: list[Effect], tmp_path: Path) -> None:
    """The same bits, and others than without."""
    call: Callable[[Robot, list[Effect]], list[np.ndarray]] = {
        "study": lambda robot, given: studied(robot, given, tmp_path),
        "linear ripple": lambda robot, given: simulated(robot, given, model="linear"),
    }.get(run, run)
    of_file, of_call, without = call(stating(*own), []), call(ARM, own), call(ARM, [])
    for one, two in zip(of_file, of_call, strict=True):
        assert one.tobytes() == two.tobytes()
    assert any(a.tobytes() != b.tobytes() for a, b in zip(of_file, without, strict=True))
    # Switched off, and replaced by others.
    for one, two in zip(call(stating(*own), own), of_call, strict=True):
        assert one.tobytes() == two.tobytes()
    if run != "study":
        for one, two in zip(call(stating(*own).with_effects([]), []), without, strict=True):
            assert one.tobytes() == two.tobytes()


def test_a_given_effect_replaces_the_own_one() -> None:
    robot = stating(FRICTION, RIPPLE)
    more = Effect("coulomb_friction", 2, {"coulomb_nm": 0.9})
    for one, two in zip(simulated(robot, [more]), simulated(ARM, [RIPPLE, more]), strict=True):
        assert one.tobytes() == two.tobytes()
    # On another axis it comes on top; neutral it switches off.
    other = Effect("coulomb_friction", 1, {"coulomb_nm": 0.9})
    off = Effect("coulomb_friction", 2)
    for given_, wanted in (([other], [FRICTION, RIPPLE, other]), ([off], [RIPPLE, off])):
        for one, two in zip(simulated(robot, given_), simulated(ARM, wanted), strict=True):
            assert one.tobytes() == two.tobytes()


def test_a_fit_moves_the_given_effect_beside_own_ones() -> None:
    """Recovery, and the same bits as with all effects given."""
    axis = bare_axis()
    spring, friction = load_robot("two_mass_axis").effects
    truth = friction.with_values({"coulomb_nm": 0.8})
    logs = logs_of(axis, [spring, truth], {"a": ("multisine", 1)})
    logs = [replace(log, **{n: getattr(log, n)[:2000] for n in ARRAYS}) for log in logs]
    free = effect_parameter([friction], 0, "coulomb_nm")
    own = fit(load_robot("two_mass_axis"), logs, [free], effects=[friction])
    assert own.names == ("coulomb_friction@1.coulomb_nm",)
    assert own.values[0] == pytest.approx(0.8, rel=1e-2)
    both = [spring, friction]
    given_ = fit(axis, logs, [replace(free, effect=1)], effects=both)
    assert own.values.tobytes() == given_.values.tobytes()


ARRAYS = ("time_s", "velocity_ref_rad_s", "torque_nm", "position_rad")


def test_copies_and_pickles_keep_effects_and_tolerances() -> None:
    robot = Robot.from_toml(
        with_tables(stated(ARM.toml, [FRICTION, PAYLOAD]), "[tolerances]", "mass = 0.2", "")
    )
    changed = robot.with_parameters({"axis1.stiffness": 1e6})
    for copy in (changed, pickle.loads(pickle.dumps(changed)), pickle.loads(pickle.dumps(robot))):
        assert copy.effects == (FRICTION, PAYLOAD) and copy.tolerances == {"mass": 0.2}
    other = pickle.loads(pickle.dumps(robot.with_effects([RIPPLE])))
    assert other.effects == (RIPPLE,) and other.toml == robot.toml
    with pytest.raises(InputError, match="half_width_rad"):
        robot.with_effects([Effect("backlash", 1, {"half_width_rad": 0.2})])
    with pytest.raises(InputError, match="axis from 1 to 3"):
        robot.with_effects([Effect("backlash", 4, {"half_width_rad": 1e-3})])


def test_studies_of_other_effects_have_another_design(tmp_path: Path) -> None:
    designs = set()
    for i, own in enumerate(([], [FRICTION], [replace(FRICTION, parameters={"coulomb_nm": 0.3})])):
        path = tmp_path / f"{i}.toml"
        path.write_text(stated(ARM.toml, own))
        designs.add(
            montecarlo.design.digest(montecarlo.design.freeze(small_study(robot=str(path))))
        )
    assert len(designs) == 3


# The diagnosis.


def test_tolerances_of_the_file_go_before_the_defaults() -> None:
    text = with_tables(ARM.toml, "[tolerances]", "stiffness = 0.2", "mass = 0.3", "")
    robot = Robot.from_toml(text)
    assert robot.tolerances == {"mass": 0.3, "stiffness": 0.2}
    wanted = {**DEFAULT_TOLERANCES, "mass": 0.3, "stiffness": 0.2}
    assert Settings().tolerances_of(robot) == wanted
    assert Settings().tolerances_of(ARM) == DEFAULT_TOLERANCES
    assert Settings(tolerances={"mass": 0.1}).tolerances_of(robot) == {"mass": 0.1}


def test_the_diagnosis_allows_the_scatter_that_the_file_states() -> None:
    """A spring off by 12 %: within what the file allows, and far outside the default."""
    preset = load_robot("two_mass_axis")
    machine = preset.with_parameters({"axis1.stiffness": 1.12 * 1.46e6})
    plan = {"a": ("multisine", 1), "b": ("multisine", 2)}
    estimation = logs_of(machine, [], plan)
    validation = logs_of(machine, [], {"c": ("multisine", 9)})
    wide = Robot.from_toml(with_tables(preset.toml, "[tolerances]", "stiffness = 0.1", ""))
    found = [
        diagnose(
            robot=robot,
            estimation=estimation,
            validation=validation,
            settings=Settings(bootstrap=50),
        )
        for robot in (preset, wide)
    ]
    assert [d.verdict for d in found] == ["explained", "none"]
    labels = ["nonlinear_stiffness@1", "coulomb_friction@1"]
    assert found[1].provenance["robot_effects"] == labels
    assert found[1].refit["axis1.stiffness"].value == pytest.approx(0.12, abs=0.01)
    assert AS_GIVEN.effects == ()


# Writing.


def effects_of_arm() -> st.SearchStrategy[list[Effect]]:
    """Any effects of the arm, at most one of a name and axis."""

    @st.composite
    def one(draw: st.DrawFn) -> Effect:
        info = draw(st.sampled_from(list(effects.effect_table().values())))
        axis = None if info.scope == "arm" else draw(st.integers(1, 3))
        chosen = draw(st.lists(st.sampled_from(info.parameters), unique=True))
        values = {p.name: draw(st.floats(p.lower, p.upper)) for p in chosen}
        if info.scope == "axes":
            return Effect(info.name, None, values, (axis, axis % 3 + 1))
        return Effect(info.name, axis, values)

    return st.lists(one(), unique_by=lambda e: e.label, max_size=4)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(effects_of_arm(), effects_of_arm(), effects_of_arm())
def test_effects_written_are_the_effects_read(before, found, removed) -> None:
    """Round trip, over a file that states others already; all other text stays."""
    commented = "# head\n" + ARM.toml + "\n# the end\n"
    source = Robot.from_toml(stated(commented, before))
    assert source.effects == tuple(before)
    values = identified({}, SOURCE, effects=found, removed=removed)
    text = render(source, values, "x.json")
    gone = {e.label for e in (*found, *removed)}
    wanted = {*found, *(e for e in before if e.label not in gone)}
    read = Robot.from_toml(text).effects
    assert set(read) == wanted and len(read) == len(wanted)
    rest_ = [line for line in text.splitlines() if not line.startswith("# identified")]
    kept = [line for line in commented.replace("robot/1", "robot/2").splitlines() if line]
    if not before and not found:
        kept = [line for line in commented.splitlines() if line]
    lines = iter(rest_)
    assert all(line in lines for line in kept)


def test_without_effects_version_1_stays_byte_for_byte(tmp_path: Path) -> None:
    values = {"axis1.stiffness": ARM.parameters()["axis1.stiffness"]}
    write_identified(ARM, tmp_path / "r.toml", identified(values, SOURCE))
    lines = (tmp_path / "r.toml").read_text().splitlines(keepends=True)
    assert "".join(x for x in lines if not x.startswith("# identified")) == ARM.toml


AXIS = """
# Measured in May.
[[effect]]   # friction
name = "coulomb_friction" # sign
  axis = 1
  coulomb_nm = 0.5 # rough
# The cabinet.

[[effect]]
name = "backlash"
axis = 1
half_width_rad = 1e-4

# To be checked.
[tolerances]
mass = 0.02 # weighed
"""


def test_comments_and_untouched_text_are_kept(tmp_path: Path) -> None:
    text = with_tables(ARM.toml, AXIS)
    source = Robot.from_toml(text)
    friction, backlash = source.effects
    better = friction.with_values({"coulomb_nm": 0.6, "smoothing_rad_s": 0.02})
    found = identified(
        {"coulomb_friction@1.coulomb_nm": 0.6, "payload.mass_kg": 5.0},
        SOURCE,
        standard_errors={"coulomb_friction@1.coulomb_nm": 0.01},
        effects=[better, Effect("payload", None, {"mass_kg": 5.0})],
        removed=[backlash],
    )
    write_identified(source, tmp_path / "r.toml", found)
    new = (tmp_path / "r.toml").read_text()
    head, tail = new[new.index("\n") + 1 :].split("\n# Measured in May.\n")
    assert head == text.split("\n# Measured in May.\n")[0]
    assert (
        tail
        == """\
[[effect]]   # friction
name = "coulomb_friction" # sign
  axis = 1
  # identified: coulomb_friction@1.coulomb_nm = 0.6 Nm, standard error 0.01 (1.7 %), before 0.5
  coulomb_nm = 0.6 # rough
smoothing_rad_s = 0.02
# The cabinet.

[[effect]]
name = "payload"
# identified: payload.mass_kg = 5 kg
mass_kg = 5.0

# To be checked.
[tolerances]
mass = 0.02 # weighed
"""
    )
    assert load_robot(tmp_path / "r.toml").tolerances == {"mass": 0.02}


def test_values_of_own_effects_are_written(tmp_path: Path) -> None:
    """A value of an effect that the robot has needs no effect beside it."""
    name = "coulomb_friction@1.coulomb_nm"
    spring, friction = load_robot("two_mass_axis").effects
    write_identified("two_mass_axis", tmp_path / "r.toml", identified({name: 0.7}, SOURCE))
    wanted = (spring, friction.with_values({"coulomb_nm": 0.7}))
    assert load_robot(tmp_path / "r.toml").effects == wanted
    with pytest.raises(RobotError, match=r"coulomb_nm: expected 0 to"):
        write_identified("two_mass_axis", tmp_path / "x.toml", identified({name: -0.7}, SOURCE))
    with pytest.raises(InputError, match="found: expected parameters among"):
        write_identified("irb6600_like", tmp_path / "x.toml", identified({name: 0.7}, SOURCE))
    with pytest.raises(InputError, match="parameter 'coulomb': expected coulomb_nm"):
        other = {"coulomb_friction@1.coulomb": 0.7}
        write_identified("two_mass_axis", tmp_path / "x.toml", identified(other, SOURCE))
    assert [p.name for p in tmp_path.glob("x*")] == []


def test_effects_that_are_no_tables_are_left_alone_or_refused(tmp_path: Path) -> None:
    head, tail = ARM.toml.split("[[joint]]", 1)
    inline = 'effect = [{ name = "backlash", axis = 1, half_width_rad = 1e-4 }]\n\n[[joint]]'
    robot = Robot.from_toml(with_tables(head + inline + tail))
    assert len(robot.effects) == 1
    values = {"axis1.stiffness": 1.5e6, "backlash@1.half_width_rad": 2e-4}
    write_identified(robot, tmp_path / "r.toml", identified(values, SOURCE))
    assert inline.replace("1e-4", "0.0002") in (tmp_path / "r.toml").read_text()
    found = identified({}, SOURCE, effects=[PAYLOAD])
    with pytest.raises(RobotError, match=r"source: expected effects in tables \[\[effect\]\]"):
        write_identified(robot, tmp_path / "x.toml", found)


# Effects between axes.


@pytest.fixture
def coupling(monkeypatch: pytest.MonkeyPatch) -> str:
    """A name whose effect acts between two axes: the table has none yet."""
    info = replace(effects.effect_info("backlash"), name="coupling", scope="axes")
    table = {**effects.effect_table(), "coupling": info}
    monkeypatch.setattr("axisight.effects.table.effect_table", lambda: table)
    return info.name


def test_effects_between_axes_have_both_in_their_label(coupling: str) -> None:
    effect = Effect(coupling, axes=(5, 6), parameters={"half_width_rad": 1e-3, "damped": 0.0})
    assert effect.label == "coupling@5,6" and effect.place == (5, 6)
    assert effects.core_effects([effect]) == [("coupling", (5, 6), [1e-3, 0.0])]
    assert effects.effect_of_core(("coupling", (5, 6), [1e-3, 0.0])) == effect
    assert effect.with_values({"half_width_rad": 2e-3}).axes == (5, 6)
    assert effect != replace(effect, axes=(6, 5))
    text = stated(ARM.toml, [effect])
    assert tomllib.loads(text)["effect"] == [
        {"name": "coupling", "axes": [5, 6], "half_width_rad": 1e-3, "damped": 0.0}
    ]


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ({"axes": (5, 5)}, "axes: expected two different axes from 1, got"),
        ({"axes": (0, 1)}, "axes: expected two different axes from 1, got"),
        ({"axes": (1, 2, 3)}, "axes: expected two different axes from 1, got"),
        ({"axis": 5}, "axis: expected axes, it acts between two, got 5"),
    ],
)
def test_places_that_no_coupling_has_are_refused(coupling: str, place, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Effect(coupling, **place)
    with pytest.raises(InputError, match="axes: expected none"):
        Effect("backlash", axes=(1, 2))


def test_axes_may_be_an_array(coupling: str) -> None:
    effect = Effect(coupling, axes=np.array([1, 2]))
    assert effect == Effect(coupling, axes=(1, 2)) and effect.axes == (1, 2)
    assert repr(effect) == "Effect('coupling', axes=(1, 2))"
    for wrong in (np.array([1.0, 2.0]), np.array([[1, 2]]), np.array(1), np.array([1, 1])):
        with pytest.raises(InputError, match="axes: expected two different axes from 1, got"):
            Effect(coupling, axes=wrong)


@pytest.mark.parametrize("value", ["0.4", None, True, [0.4], 1j, np.array([0.4])])
def test_values_that_are_no_numbers_are_refused(value: object) -> None:
    with pytest.raises(
        InputError, match="'coulomb_friction': parameter 'coulomb_nm': expected a n"
    ):
        Effect("coulomb_friction", 1, {"coulomb_nm": value})
    for number in (1, np.float32(0.5), np.int64(2)):
        assert repr(Effect("coulomb_friction", 1, {"coulomb_nm": number}))


def test_effects_are_equal_by_what_they_do() -> None:
    short = Effect("coulomb_friction", 2, {"coulomb_nm": 0.4})
    neutral = next(
        p.neutral for p in effects.effect_info(short.name).parameters if p.name == "smoothing_rad_s"
    )
    full = short.with_values({"smoothing_rad_s": neutral})
    assert short == full and hash(short) == hash(full)
    assert short not in {full.with_values({"smoothing_rad_s": 2 * neutral}), replace(full, axis=1)}
    assert short != "coulomb_friction@2"


def test_stored_studies_take_the_effects_of_the_file(tmp_path: Path) -> None:
    """A study that is resumed has its robot's effects from the text in the store."""
    path = tmp_path / "robot.toml"
    path.write_text(stated(ARM.toml, [RIPPLE]))
    study = small_study(robot=str(path), runs=4, block_runs=2, effect=[])
    whole = montecarlo.run(study, threads=1)
    montecarlo.run(study, runs=2, out=tmp_path / "s", threads=1)
    same_bits(montecarlo.run(study, out=tmp_path / "s", resume=True, threads=1), whole)
