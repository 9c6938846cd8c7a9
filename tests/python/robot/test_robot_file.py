"""Robots written back: nothing lost, values bit for bit, provenance, refusals."""

import json
import re
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from axisight import Effect, Fitted, InputError, Robot, RobotError, _core, load_robot
from axisight.effects import effect_table
from axisight.robot.presets import PRESETS
from axisight.robot_file import (
    Provenance,
    hash_file,
    identified,
    identified_by_fit,
    load_identified,
    write_identified,
)
from axisight.robot_file import text as text_module
from axisight.robot_file.document import render
from axisight.robot_file.text import edited
from axisight.simulation import simulate

WHEN = datetime(2024, 5, 6, 7, 8, 9, tzinfo=UTC)
SOURCE = Provenance("three steps", {"log_1.parquet": "ab12"}, {"block_s": 0.25}, WHEN, notes="n")

ODD = """\
# A robot in unusual TOML: inline tables, dotted and quoted keys, arrays over lines.
schema = 'axisight.robot/1'
"name" = "odd # not a comment"
gravity = [0, 0,
  -9.81, # down
]
sample_time = 5e-4
[[joint]]
name = "a.b"
kind = "driven"
origin = [0.0, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
stiffness = 1_460_000   # as measured
damping = 2.63e3
link = { mass = 5.0e2, com = [ 0.0, 1e-3, -0.0 ], "inertia" = [1130.0, 1130, 1130.0, 0, 0.0, 0.0] }
drive.gear_ratio = 0.00446
drive.motor_inertia = 1.21e-2
drive."viscous_friction" = 0.013
[controller]
kind = "none"
"""


def parameters(robot: Robot) -> dict[str, float]:
    return robot.parameters()


def without_comments(text: str) -> str:
    return "".join(
        line
        for line in text.splitlines(keepends=True)
        if not line.lstrip().startswith("# identified")
    )


@pytest.mark.parametrize("name", PRESETS)
def test_unchanged_values_keep_every_character(name: str, tmp_path: Path) -> None:
    robot = load_robot(name)
    everything = {n: v for n, v in parameters(robot).items() if not n.endswith("inertia_scale")}
    target = tmp_path / "robot.toml"
    write_identified(name, target, identified(everything, SOURCE))
    assert without_comments(target.read_text()) == robot.toml
    assert parameters(load_robot(target)) == parameters(robot)
    assert load_identified(target).robot.effects == robot.effects


@pytest.mark.parametrize("text", [ODD, ODD.replace("\n", "\r\n")])
def test_unusual_toml_is_edited_in_place(text: str, tmp_path: Path) -> None:
    path = tmp_path / "odd.toml"
    path.write_bytes(text.encode())
    values = {"a.b.com_y": -0.25, "a.b.motor_inertia": 0.0125, "a.b.stiffness": 1.5e6}
    values |= {"a.b.inertia_zz": 1100.25}
    write_identified(path, tmp_path / "new.toml", identified(values, SOURCE))
    new = (tmp_path / "new.toml").read_text()
    assert "stiffness = 1500000.0   # as measured" in new
    assert "com = [ 0.0, -0.25, -0.0 ]" in new and "[1130.0, 1130, 1100.25, 0" in new
    got = parameters(load_robot(tmp_path / "new.toml"))
    assert got == parameters(load_robot(path)) | {k: v for k, v in values.items() if "zz" not in k}
    before, after = tomllib.loads(text), tomllib.loads(new)
    before["joint"][0]["link"]["inertia"][2] = 1100.25
    before["joint"][0]["link"]["com"][1] = -0.25
    before["joint"][0]["drive"]["motor_inertia"] = 0.0125
    before["joint"][0]["stiffness"] = 1.5e6
    assert before == after


APART = """\
a.b = [1,2, # two
 3]
[x.y]
  v = 1e3
[z]
t = {"u.w" = {k = [ {m = 1}, { m = 2 } ] } }
[x.w]
v=2 # last
[[n]]
[[n.o]]
v = 1
[[n.o]]
v = 0x1F
"""


def numbers(node: object, place: tuple[str | int, ...] = ()) -> dict[tuple[str | int, ...], float]:
    """All numbers of a document by their places."""
    if isinstance(node, int | float):
        return {place: float(node)}
    pairs = node.items() if isinstance(node, dict) else enumerate(node)
    parts = [numbers(x, (*place, key)) for key, x in pairs if not isinstance(x, str)]
    return {key: value for part in parts for key, value in part.items()}


def parsed(lines: list[str], first: int) -> Iterator[dict[str, object]]:
    """What the document says up to each end of a statement from line ``first`` on."""
    for end in range(first + 1, len(lines) + 1):
        with suppress(tomllib.TOMLDecodeError):
            yield tomllib.loads("".join(lines[:end]))


@pytest.mark.parametrize("text", [ODD, APART, ODD.replace("\n", "\r\n"), APART.rstrip()])
def test_any_number_is_replaced_alone(text: str) -> None:
    """Every number in turn: the document says the new one, and no other character is another."""
    before = numbers(tomllib.loads(text))
    assert edited(text, before, {}) == text and len(before) > 8
    for place in before:
        new = edited(text, {place: -12.5}, {place: ["# one", "# two"]})
        assert numbers(tomllib.loads(new)) == before | {place: -12.5}
        lines, was = new.splitlines(keepends=True), text.splitlines(keepends=True)
        first = next(k for k, line in enumerate(lines) if line.strip() == "# one")
        lead = re.match("[ \t]*", was[first]).group()
        assert lines[first : first + 2] == [f"{lead}# one\n", f"{lead}# two\n"]
        # It is the next whole statement that holds the place.
        assert place not in numbers(tomllib.loads("".join(lines[:first])))
        assert place in numbers(next(parsed(lines, first + 2)))
        other = "".join(lines[:first] + lines[first + 2 :])
        start = other.index("-12.5")
        old = text[start : len(text) - len(other) + start + 5]
        assert text == other.replace("-12.5", old) and float(eval(old)) == before[place]


def test_the_sign_of_zero_counts() -> None:
    zero = ("joint", 0, "link", "com", 2)
    assert edited(ODD, {zero: -0.0}, {}) == ODD
    assert edited(ODD, {zero: 0.0}, {}) == ODD.replace("1e-3, -0.0", "1e-3, 0.0")


def test_comments_of_one_statement_stand_together() -> None:
    link = ("joint", 0, "link")
    places = {(*link, "inertia", 4): ["# xz"], (*link, "mass"): ["# m"], (*link, "com"): ["# c"]}
    assert edited(ODD, {}, places) == ODD.replace("link = {", "# xz\n# m\n# c\nlink = {")


def test_text_that_cannot_be_kept_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(RobotError, match="source: expected TOML"):
        edited("a = ", {}, {})
    whole = text_module.tomlkit.parse
    monkeypatch.setattr(text_module.tomlkit, "parse", lambda text: whole(text + "# more"))
    with pytest.raises(RobotError, match="source: its text cannot be kept"):
        edited(ODD, {}, {})


NUMBER = st.floats(1e-6, 1e9, allow_nan=False)
SIGNED = st.floats(-10, 10, allow_nan=False)


@st.composite
def robots(draw: st.DrawFn) -> str:
    joints = []
    for k in range(draw(st.integers(1, 4))):
        driven = k == 0 or draw(st.booleans())
        rigid = driven and draw(st.booleans())
        table = draw(st.booleans())
        lines = ["[[joint]]", f'name = "j{k}"', f'kind = "{"driven" if driven else "elastic"}"']
        lines += ["origin = [0.0, 0, 0.5]", "axis = [0, 0, 1]"]
        if not rigid:
            lines += [f"stiffness = {draw(NUMBER)!r}", f"damping={draw(NUMBER)!r}"]
        a, b, c = (draw(st.floats(1e-3, 1e3)) for _ in range(3))
        # Squares of lengths: any such moments obey the triangle inequality.
        inertia = f"[{a + b!r}, {b + c!r}, {a + c!r}, 0.0, 0.0, 0.0]"
        com = f"[{draw(SIGNED)!r}, {draw(SIGNED)!r}, {draw(SIGNED)!r}]"
        drive = {"gear_ratio": "-0.01", "motor_inertia": repr(draw(NUMBER))}
        drive["viscous_friction"] = repr(draw(NUMBER))
        link = {"mass": repr(draw(NUMBER)), "com": com, "inertia": inertia}
        parts = {"link": link} | ({"drive": drive} if driven else {})
        for name, part in parts.items():
            if not table:
                inside = ", ".join(f"{key} = {value}" for key, value in part.items())
                lines.append(f"{name} = {{ {inside} }}")
        for name, part in parts.items():
            if table:
                lines.append(f"  [joint.{name}] # {name}")
                lines += [f"  {key} = {value}" for key, value in part.items()]
        joints.append("\n".join(lines))
    head = 'schema = "axisight.robot/1"\nname = "h"\ngravity = [0, 0, -9.81]\nsample_time = 1e-3\n'
    return head + "\n".join(joints) + "\n"


@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(robots(), st.data())
def test_any_robot_round_trips(text: str, data: st.DataObject) -> None:

    robot = Robot(_core.Robot.from_toml(text))
    before = parameters(robot)
    free = [n for n in before if not n.endswith("inertia_scale")]
    chosen = data.draw(st.lists(st.sampled_from(free), unique=True, max_size=6))
    values = {n: data.draw(SIGNED if ".com_" in n else NUMBER) for n in chosen}
    new = render(robot, identified(values, SOURCE), "x.json")
    after = Robot(_core.Robot.from_toml(new))
    got = parameters(after)
    for name, value in (before | values).items():
        assert np.float64(got[name]).tobytes() == np.float64(value).tobytes(), name
    # Written again with the old values: the old robot, and the values not touched keep their text.
    back = render(after, identified({n: before[n] for n in chosen}, SOURCE), "x.json")
    assert parameters(Robot(_core.Robot.from_toml(back))) == before
    untouched = re.sub(r"[-+0-9.e]{2,}", "", without_comments(new))
    assert untouched == re.sub(r"[-+0-9.e]{2,}", "", text)
    # Comments are replaced, not piled up.
    assert back.count("# identified") == new.count("# identified") == len(chosen) + 1


def test_sidecar_gives_back_everything(tmp_path: Path) -> None:
    covariance = np.array([[4.0e6, 30.0], [30.0, 0.01]])
    effects = [Effect("coulomb_friction", 1, {"coulomb_nm": 0.65, "smoothing_rad_s": 0.01})]
    effects += [Effect("nonlinear_stiffness", 1, {"cubic_nm_rad3": 3.7e10})]
    found = identified(
        {"axis1.stiffness": 1.5e6, "axis1.damping": 0.1 + 0.2},
        SOURCE,
        covariance=covariance,
        effects=effects,
    )
    target = tmp_path / "folder" / "robot.toml"
    sidecar = write_identified("two_mass_axis", target, found)
    assert sidecar.name == "robot.identified.json"
    for path in (target, sidecar):
        back = load_identified(path)
        assert back.names == found.names and back.values.tobytes() == found.values.tobytes()
        np.testing.assert_array_equal(back.covariance, covariance)
        np.testing.assert_array_equal(back.standard_errors, [2000.0, 0.1])
        assert set(back.effects) == set(effects) and back.robot.effects == back.effects
        assert load_robot(target).effects == back.effects
        given_, kept = SOURCE, back.provenance
        assert (kept.method, kept.data, kept.settings) == (
            given_.method,
            given_.data,
            given_.settings,
        )
        assert kept.created == WHEN and kept.notes == "n" and kept.axisight_version
        assert back.value("axis1.damping") == 0.1 + 0.2
    head, *rest = target.read_text().splitlines()
    assert head.startswith("# identified by axisight") and "2024-05-06" in head
    noted = [line for line in rest if line.startswith("# identified: axis1.stiffness")]
    assert noted == [
        "# identified: axis1.stiffness = 1.5e+06 Nm/rad, standard error 2e+03 (0.13 %), before 1.46e+06"
    ]
    with pytest.raises(InputError, match=r"expected one of axis1\.stiffness"):
        back.value("axis1.mass")


def test_inertia_scale_multiplies_the_whole_inertia(tmp_path: Path) -> None:
    write_identified(
        "irb6600_like", tmp_path / "r.toml", identified({"axis3_yaw.inertia_scale": 1.1}, SOURCE)
    )
    old = tomllib.loads(load_robot("irb6600_like").toml)["joint"][6]["link"]["inertia"]
    new = tomllib.loads((tmp_path / "r.toml").read_text())["joint"][6]["link"]["inertia"]
    assert new == [1.1 * x for x in old]


def test_a_fit_is_written_as_it_is(tmp_path: Path) -> None:
    names = ("axis1.stiffness", "coulomb_friction@1.coulomb_nm")
    covariance = np.diag([1e6, 1e-4])
    fitted = Fitted(
        names, np.array([1.4e6, 0.7]), np.sqrt(np.diag(covariance)), covariance, np.eye(2),
        "loss_converged", 1.0, 2.0, 3, 4, 5.0, (), (), None,
    )  # fmt: skip
    effect = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.01})
    found = identified_by_fit(fitted, SOURCE, effects=[effect])
    write_identified("two_mass_axis", tmp_path / "r.toml", found)
    back = load_identified(tmp_path / "r.toml")
    spring, friction = load_robot("two_mass_axis").effects
    assert back.effects == (spring, friction.with_values({"coulomb_nm": 0.7}))
    np.testing.assert_array_equal(back.standard_errors, [1e3, 1e-2])
    with pytest.raises(InputError, match="effects: expected the effect"):
        identified_by_fit(fitted, SOURCE)


def test_files_in_the_way_are_kept(tmp_path: Path) -> None:
    target = tmp_path / "robot.toml"
    found = identified({"axis1.stiffness": 1.5e6}, SOURCE)
    write_identified("two_mass_axis", target, found)
    text = target.read_text()
    with pytest.raises(InputError, match="exists"):
        write_identified("two_mass_axis", target, identified({"axis1.stiffness": 2e6}, SOURCE))
    assert target.read_text() == text
    write_identified(
        "two_mass_axis", target, identified({"axis1.stiffness": 2e6}, SOURCE), overwrite=True
    )
    assert parameters(load_robot(target))["axis1.stiffness"] == 2e6
    assert sorted(p.name for p in tmp_path.iterdir()) == ["robot.identified.json", "robot.toml"]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"axis1.stiffness": 0.0}, "axis1.stiffness: expected a positive number"),
        ({"axis1.mass": -3.0}, "axis1.mass: expected a positive number"),
        ({"axis1.damping": -1.0}, "axis1.damping: expected no negative"),
        ({"axis1.viscous_friction": -1e-3}, "viscous_friction: expected no negative"),
        ({"axis1.motor_inertia": 0.0}, "motor_inertia: expected a positive"),
        ({"axis1.inertia_scale": -1.0}, "expected a positive factor"),
        ({"axis1.inertia_xx": -5.0}, "positive definite"),
        ({"axis1.inertia_xy": 2000.0}, "positive definite"),
        ({"axis1.inertia_zz": 2500.0}, "no principal moment above the sum"),
    ],
)
def test_values_no_body_has_are_refused(values, words: str, tmp_path: Path) -> None:
    with pytest.raises(RobotError, match=words):
        write_identified("two_mass_axis", tmp_path / "r.toml", identified(values, SOURCE))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("effect", "error", "words"),
    [
        (
            Effect("coulomb_friction", 1, {"coulomb_nm": -0.5}),
            RobotError,
            r"coulomb_friction@1\.coulomb_nm: expected 0 to 10000 Nm, got -0\.5",
        ),
        (Effect("torque_offset", 1, {"offset_nm": np.nan}), RobotError, "offset_nm: .* got nan"),
        (Effect("backlash", 1, {"half_width_rad": 0.2}), RobotError, "expected 0 to 0.05 rad"),
        (
            Effect("coulomb_friction", 2, {"coulomb_nm": 0.5}),
            InputError,
            "coulomb_friction@2: expected an axis from 1 to 1, got 2",
        ),
        (Effect("coulomb_friction"), InputError, "expected an axis from 1 to 1, got none"),
        (Effect("payload", 1), InputError, "payload@1: expected no axis"),
    ],
)
def test_effects_no_robot_has_are_refused(effect, error, words: str, tmp_path: Path) -> None:
    found = identified({"axis1.stiffness": 1.5e6}, SOURCE, effects=[effect])
    with pytest.raises(error, match=words):
        write_identified("two_mass_axis", tmp_path / "r.toml", found)
    assert not list(tmp_path.iterdir())
    # The core is of the same opinion.
    with pytest.raises(InputError):
        simulate(load_robot("two_mass_axis"), np.zeros(10), effects=[effect])


def test_every_effect_may_stand_at_its_neutral_values_and_bounds(tmp_path: Path) -> None:
    robot = load_robot("irb6600_like")
    for name, info in effect_table().items():
        axis = 3 if info.scope == "axis" else None
        axes = (2, 3) if info.scope == "axes" else None
        for which in ("neutral", "lower", "upper"):
            given = {p.name: getattr(p, which) for p in info.parameters}
            found = identified({}, SOURCE, effects=[Effect(name, axis, given, axes)])
            write_identified(robot, tmp_path / "r.toml", found, overwrite=True)
            assert load_identified(tmp_path / "r.toml").effects == found.effects


def test_values_and_their_effects_must_agree(tmp_path: Path) -> None:
    name = "coulomb_friction@1.coulomb_nm"
    effect = Effect("coulomb_friction", 1, {"coulomb_nm": 0.65})
    for value in (0.65, 0.65 * (1 + 1e-15)):
        identified({name: value}, SOURCE, effects=[effect])
    good = identified({name: 0.65}, SOURCE, effects=[effect])
    for other in (
        Effect("coulomb_friction", 1, {"coulomb_nm": 0.66}),
        Effect("coulomb_friction", 1),  # neutral: none
    ):
        with pytest.raises(InputError, match=r"coulomb_nm: expected 0\.\d+ as the effect"):
            identified({name: 0.65}, SOURCE, effects=[other])
        with pytest.raises(InputError, match=r"coulomb_nm: expected 0\.\d+ as the effect"):
            write_identified("two_mass_axis", tmp_path / "r.toml", replace(good, effects=(other,)))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "matrix", [[[1.0, 5.0], [5.0, 1.0]], [[0.0, 5.0], [5.0, 1.0]], [[1e-12, 2e-3], [2e-3, 1e6]]]
)
def test_covariances_of_nothing_are_refused(matrix, tmp_path: Path) -> None:
    values = {"axis1.stiffness": 1.5e6, "axis1.damping": 2.6e3}
    with pytest.raises(InputError, match="covariance: expected a positive semidefinite matrix"):
        identified(values, SOURCE, covariance=matrix)
    found = replace(identified(values, SOURCE), covariance=np.array(matrix))
    with pytest.raises(InputError, match="covariance: expected a positive semidefinite matrix"):
        write_identified("two_mass_axis", tmp_path / "r.toml", found)
    assert not list(tmp_path.iterdir())
    # One of fewer dimensions than parameters is none of these, whatever the units.
    row = np.random.default_rng(0).normal(size=(2, 40)) * np.geomspace(1e-6, 1e6, 40)
    free = identified({f"p{i}": 0.0 for i in range(40)}, SOURCE, covariance=row.T @ row)
    assert free.covariance is not None


def test_misuse_is_named(tmp_path: Path) -> None:
    write = write_identified
    for values, words in (
        ({"axis9.stiffness": 1.0}, "found: expected parameters among axis1.mass"),
        ({"axis1.inertia": 1.0}, "found"),
        ({"axis1.inertia_scale": 1.1, "axis1.inertia_xx": 1130.0}, "either a scale or moments"),
        ({"axis1.inertia_xx": 1130.0, "axis1.inertia_scale": 1.1}, "either a scale or moments"),
    ):
        with pytest.raises(InputError, match=words):
            write("two_mass_axis", tmp_path / "r.toml", identified(values, SOURCE))
    with pytest.raises(InputError, match="JSON"):
        odd = Provenance("m", settings={"robot": object()})
        write("two_mass_axis", tmp_path / "r.toml", identified({"axis1.mass": 400.0}, odd))
    assert not list(tmp_path.iterdir())
    for call, words in (
        (lambda: identified({"a": np.nan}, SOURCE), r"values\['a'\]: expected a finite"),
        (lambda: identified({"a": "x"}, SOURCE), "expected a number"),
        (lambda: identified({"a": 1.0}, SOURCE, standard_errors={"b": 1.0}), "names among"),
        (lambda: identified({"a": 1.0}, SOURCE, standard_errors={"a": -1.0}), "no negative"),
        (lambda: identified({"a": 1.0}, SOURCE, covariance=np.eye(2)), r"shape \(1, 1\)"),
        (
            lambda: identified({"a": 1.0, "b": 1.0}, SOURCE, covariance=[[1, 2], [0, 1]]),
            "symmetric",
        ),
        (
            lambda: identified({"a": 1.0}, SOURCE, covariance=[[4.0]], standard_errors={"a": 1.0}),
            "expected 2.0 as the covariance",
        ),
        (lambda: hash_file(tmp_path / "none"), "readable file"),
        (lambda: load_identified(tmp_path / "none.toml"), "expected the sidecar"),
    ):
        with pytest.raises(InputError, match=words):
            call()


def test_changed_robots_and_spoilt_sidecars_are_told(tmp_path: Path) -> None:
    target = tmp_path / "robot.toml"
    sidecar = write_identified(
        "two_mass_axis", target, identified({"axis1.stiffness": 1.5e6}, SOURCE)
    )
    assert hash_file(target) == json.loads(sidecar.read_text())["robot_sha256"]
    good = sidecar.read_text()
    for old, new, words in (
        ("axisight.identified/2", "axisight.identified/3", "schema"),
        ('"robot"', '"robots"', "robot"),
        ('"robot.toml"', '"../robot.toml"', "a file beside it"),
        ('"value": 1500000.0', '"value": "much"', "parameters"),
        ("2024-05-06T", "once", "ISO date"),
        ("{", "", "Invalid JSON"),
    ):
        assert old in good
        sidecar.write_text(good.replace(old, new, 1))
        with pytest.raises(InputError, match=words):
            load_identified(target)
    sidecar.write_text(good)
    target.write_text(target.read_text().replace("sample_time = 5.0e-4", "sample_time = 1.0e-3"))
    with pytest.raises(InputError, match="changed after it was written"):
        load_identified(target)
    assert load_identified(target, check=False).robot.sample_time_s == 1e-3
