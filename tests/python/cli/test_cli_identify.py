"""``axisight identify``: each command from files to a robot file, and what it refuses."""

import json
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from test_identify_logs import motor_log
from typer.testing import CliRunner

import axisight
from axisight import Robot, excitation, load_robot, robot_parameters, simulate
from axisight.cli import app
from axisight.frequency_fit import model_response
from axisight.frf import frequency_response
from axisight.frf.interop import save_netcdf
from axisight.rigid_body import DriveTerms, TorqueModel
from axisight.robot_file import hash_file, load_identified
from frequency_fit_data import LINES_HZ, POSES
from frequency_fit_data import ROBOT as ELASTIC
from rigid_body_data import robot_of, smooth_motion, three_axes


def run(*arguments: object, code: int = 0) -> str:
    result = CliRunner().invoke(app, ["identify", *map(str, arguments)])
    assert result.exit_code == code, result.output
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return " ".join(result.output.split())


def write_log(path: Path, position, torque, step_s, reference=None) -> Path:
    data = {"time_s": step_s * np.arange(len(position))}
    for i in range(position.shape[1]):
        if reference is not None:
            data[f"velocity_ref_{i + 1}"] = reference[:, i]
        data[f"torque_cmd_{i + 1}"] = torque[:, i]
        data[f"position_{i + 1}"] = position[:, i]
    pd.DataFrame(data).to_parquet(path, index=False)
    return path


def test_help_names_the_commands() -> None:
    text = run("--help")
    for name in ("rigid-body", "axis", "elastic"):
        assert name in text
        assert "robot" in run(name, "--help")


# Rigid bodies.


@pytest.fixture(scope="module")
def rigid(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("rigid")
    (folder / "robot.toml").write_text(three_axes())
    for seed in (1, 2, 3):
        log = motor_log(robot_of(three_axes()), seed, n=6000, noise=0.01)
        write_log(folder / f"run{seed}.parquet", log.position_rad, log.torque_nm, 1e-3)
    return folder


def test_rigid_body_uses_the_part_asked_for(rigid, tmp_path: Path) -> None:
    out = tmp_path / "found.toml"
    first = rigid / "run1.parquet"
    common = ("rigid-body", rigid / "robot.toml")
    run(*common, first, "--consistent", "--from", 1, "--to", 5.5, "-o", out)
    part = pd.read_parquet(first).iloc[1000:5500].reset_index(drop=True)
    part["time_s"] -= part["time_s"][0]
    part.to_parquet(tmp_path / "part.parquet", index=False)
    run(*common, tmp_path / "part.parquet", "--consistent", "-o", tmp_path / "same.toml")
    assert robot_parameters(load_robot(out)) == robot_parameters(load_robot(tmp_path / "same.toml"))
    settings = load_identified(out).provenance.settings
    assert (settings["start_s"], settings["stop_s"]) == (1.0, 5.5)
    text = run(*common, first, "--from", 1, "--to", 1.5, code=2)
    assert "--from, --to: expected at least 1 s between, got 0.5 s of the log" in text


def test_rigid_body_prints_and_writes(rigid, tmp_path: Path) -> None:
    out = tmp_path / "found.toml"
    first, second, third = (rigid / f"run{i}.parquet" for i in (1, 2, 3))
    options = ("--held-out", third, "--consistent", "--prior-share", 0.5, "--combinations")
    text = run("rigid-body", rigid / "robot.toml", first, second, *options, "-o", out)
    for words in (
        "run1: ", "samples every", "axis2.coulomb_friction", "axis1.inertia_zz +", "std. error",
        "run3 (held out)", "torque error, least squares", "torque error, bodies that can exist",
        "written:",
    ):  # fmt: skip
        assert words in text
    back = load_identified(out)
    assert back.provenance.method == "axisight identify rigid-body"
    assert back.provenance.data == {p.name: hash_file(p) for p in (first, second, third)}
    settings = back.provenance.settings
    assert settings["prior_share"] == 0.5 and settings["held_out"] == ["run3.parquet"]
    assert "reversal_s" not in settings
    frictions = [e for e in back.effects if e.name == "coulomb_friction"]
    np.testing.assert_allclose([e.parameters["coulomb_nm"] for e in frictions], 0.4, rtol=0.05)
    held_out = settings["torque_error"][2]
    assert held_out["held_out"] and max(held_out["relative_error"]) < 0.05
    # Files in the way are told before any work, and kept.
    before = out.read_text()
    assert "--force replaces it" in run("rigid-body", "none", first, "-o", out, code=2)
    assert out.read_text() == before
    run("rigid-body", rigid / "robot.toml", first, second, "--consistent", "-o", out, "--force")
    again = load_identified(out)
    assert again.provenance.settings["torque_error"][1]["log"] == "run2"
    # Another prior, other values in the directions that motions do not show well.
    assert again.value("axis3.com_x") != back.value("axis3.com_x")


def test_a_solver_that_stops_short_says_so(rigid, tmp_path: Path, monkeypatch) -> None:
    from axisight.rigid_body import from_logs  # noqa: PLC0415

    real = from_logs.identify_consistent
    monkeypatch.setattr(
        from_logs, "identify_consistent", lambda *a, **k: real(*a, **k, max_iterations=2)
    )
    out = tmp_path / "out.toml"
    # An arm that wants impossible bodies: masses of the file are far from the torques.
    frame = pd.read_parquet(rigid / "run1.parquet")
    frame["torque_cmd_2"] *= -1
    frame.to_parquet(tmp_path / "wrong.parquet", index=False)
    wrong = tmp_path / "wrong.parquet"
    arguments = ("rigid-body", rigid / "robot.toml", wrong, "--consistent", "-o", out)
    text = run(*arguments, "--unchecked", code=1)
    assert "bodies that can exist: inaccurate" in text and "written:" in text
    assert "bodies that can exist: inaccurate" in load_identified(out).provenance.notes


def test_torques_of_the_other_sign_are_not_written(rigid, tmp_path: Path) -> None:
    """No bodies that can exist have them: what the fit leaves is as large as the torque."""
    out = tmp_path / "out.toml"
    frame = pd.read_parquet(rigid / "run1.parquet")
    torques = [name for name in frame if name.startswith("torque_cmd")]
    frame[torques] *= -1
    wrong = tmp_path / "wrong.parquet"
    frame.to_parquet(wrong, index=False)
    arguments = ("rigid-body", rigid / "robot.toml", wrong, "--consistent", "-o", out)
    text = run(*arguments, code=1)
    assert f"not written: {out}: the parameters leave" in text
    assert "axisight check LOG --robot ROBOT" in text
    assert not out.exists()


def test_no_bodies_are_said_not_to_be_written(rigid, tmp_path: Path) -> None:
    """Values that no body has leave nothing to write."""
    out = tmp_path / "out.toml"
    text = run(
        "rigid-body", rigid / "robot.toml", rigid / "run1.parquet", "--consistent",
        "--known", "axis2.inertia_xx=-5", "-o", out, code=1,
    )  # fmt: skip
    assert "bodies that can exist: failed" in text
    assert f"not written: {out}: no bodies that can exist fit these logs" in text
    assert not list(tmp_path.iterdir())


def test_rotors_of_the_file_are_not_in_the_links_too(rigid, tmp_path: Path) -> None:
    """The file has the rotors of the logs: held or estimated, the torques are those of the arm."""
    arm = robot_of(three_axes())
    motion = smooth_motion(arm, 200, 0.02, 9)

    def torque(robot: Robot) -> np.ndarray:
        model = TorqueModel(robot, terms=DriveTerms(inertia="motor"), side="motor")
        return model.matrix(*motion) @ model.nominal

    want = torque(arm)
    for options in ((), ("--no-rotors",)):
        out = tmp_path / f"out{len(options)}.toml"
        first = rigid / "run1.parquet"
        run("rigid-body", rigid / "robot.toml", first, "--consistent", *options, "-o", out)
        found = load_identified(out)
        assert ("held at given values: axis1.motor" in found.provenance.notes) == bool(options)
        # Noise of the logs leaves a thousandth; rotors twice are a fourth.
        error = np.sqrt(((torque(found.robot) - want) ** 2).mean(axis=0) / (want**2).mean(axis=0))
        assert error.max() < 0.01


def column_map(position: str, torque: str) -> str:
    axes = [
        f'[[axis]]\nposition = {{ name = "position_{i}", unit = "{position}" }}\n'
        f'torque = {{ name = "torque_cmd_{i}", unit = "{torque}" }}\n'
        for i in (1, 2, 3)
    ]
    head = 'schema = "axisight.columns/1"\n[time]\nname = "time_s"\nunit = "s"\n'
    return head + "".join(axes)


def test_the_column_map_is_among_the_hashes(rigid, tmp_path: Path) -> None:
    out, columns = tmp_path / "out.toml", tmp_path / "columns.toml"
    columns.write_text(column_map("rad", "Nm"))
    first = rigid / "run1.parquet"
    run("rigid-body", rigid / "robot.toml", first, "--consistent", "--columns", columns, "-o", out)
    found = load_identified(out).provenance
    assert found.data == {p.name: hash_file(p) for p in (first, columns)}
    assert found.settings["columns"] == "columns.toml"


def test_rigid_body_options_reach_the_regression(rigid) -> None:
    first = rigid / "run1.parquet"
    text = run(
        "rigid-body", rigid / "robot.toml", first, "--friction", "viscous", "--no-rotors",
        "--method", "ls", "--known", "axis3.mass_x=1.5", "--cutoff-hz", 8,
    )  # fmt: skip
    assert "axis1.viscous_friction" in text
    for name in ("coulomb", "offset", "motor_inertia", "axis3.mass_x"):
        assert name not in text
    assert "set to zero" in run("rigid-body", rigid / "robot.toml", first, "--eliminate", 0.01)


def test_measured_torques_are_not_shifted(rigid, monkeypatch) -> None:
    seen = []
    whole = axisight.rigid_body.identify_logs

    def spy(*args, **options):
        seen.append(options["torque_held"])
        return whole(*args, **options)

    monkeypatch.setattr(axisight.rigid_body, "identify_logs", spy)
    for flags in ((), ("--torque-measured",)):
        run("rigid-body", rigid / "robot.toml", rigid / "run1.parquet", *flags)
    assert seen == [True, False]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--friction", "sticky"], ["--friction", "viscous, coulomb, offset", "sticky"]),
        (["--known", "axis1.mass"], ["--known", "NAME=VALUE"]),
        (["--known", "axis1.mass=heavy"], ["--known axis1.mass", "numbers", "heavy"]),
        (["--known", "a=1", "--known", "a=2"], ["--known", "a once"]),
        (["--known", "axis9.mass=1"], ["known", "axis9.mass"]),
        (["--method", "guess"], ["method", "ls, wls, tls", "guess"]),
        (["--cutoff-hz", "1e4"], ["run1", "cutoff_hz", "Nyquist"]),
        (["--held-out", "none.parquet"], ["none.parquet"]),
        (["--reversal-s", "-1"], ["--reversal-s"]),
        (["--eliminate", "0"], ["eliminate", "positive"]),
        (["--eliminate", "0.3", "--consistent"], ["eliminate", "none together with consistent"]),
        (["--known", "axis1.viscous_friction=-1", "--consistent"], ["known", "no negative"]),
        (["-o", "no_folder_can/\0be.toml"], ["--out"]),
    ],
)
def test_rigid_body_refuses_by_name(rigid, arguments, words, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    first = rigid / "run1.parquet"
    text = run("rigid-body", rigid / "robot.toml", first, *arguments, code=2)
    for word in words:
        assert word in text
    assert not list(tmp_path.iterdir())


def test_impossible_bodies_point_to_consistent(rigid, tmp_path: Path) -> None:
    frame = pd.read_parquet(rigid / "run1.parquet")
    frame["torque_cmd_2"] *= -1
    frame.to_parquet(tmp_path / "wrong.parquet", index=False)
    out = tmp_path / "out.toml"
    wrong = tmp_path / "wrong.parquet"
    text = run("rigid-body", rigid / "robot.toml", wrong, "-o", out, code=2)
    assert "--consistent finds bodies that can exist" in text
    assert not out.exists()


# One axis.


@pytest.fixture(scope="module")
def axis_logs(tmp_path_factory) -> list[Path]:
    """A triangle and two multisines on a square wave, two periods of 2.5 s each."""
    folder = tmp_path_factory.mktemp("axis")
    robot = load_robot("two_mass_axis")
    step = robot.sample_time_s
    references = [np.tile(excitation.triangle(2.5, step, amplitude=40.0).period, 2)]
    for seed, (peak, level) in enumerate([(5.0, 8.0), (10.0, 12.0)]):
        tones = excitation.multisine(2.5, step, band_hz=(1, 40), run=seed).scaled(peak=peak)
        references.append(
            np.tile(tones.period + excitation.square(2.5, step, amplitude=level).period, 2)
        )
    out = []
    for i, reference in enumerate(references):
        given = np.reshape(reference, (-1, 1))
        sim = simulate(robot, given, noise_seed=0, run=i)
        position, torque = sim["position_rad"].values, sim["torque_cmd_nm"].values
        out.append(write_log(folder / f"axis{i}.parquet", position, torque, step, given))
    return out


LINES = ("--period-s", 2.5, "--band-hz", "2,40", "--drop-periods", 1)


def test_axis_reports_and_writes(axis_logs, tmp_path: Path) -> None:
    out = tmp_path / "axis.toml"
    text = run("axis", *axis_logs, "--robot", "two_mass_axis", *LINES, "-o", out)
    for words in ("Step 1", "Step 2, axis1", "Step 3", "J_m", "residual", "not written: J_a"):
        assert words in text
    back = load_identified(out)
    want, got = robot_parameters(load_robot("two_mass_axis")), robot_parameters(back.robot)
    # The preset rounds the sign that the fit has sharp; that is all that differs.
    for quantity in ("stiffness", "damping", "motor_inertia", "viscous_friction"):
        name = f"axis1.{quantity}"
        assert got[name] != want[name] and got[name] == pytest.approx(want[name], rel=0.02)
    assert {e.label for e in back.effects} == {"nonlinear_stiffness@1", "coulomb_friction@1"}
    assert list(back.provenance.data) == [path.name for path in axis_logs]
    assert back.provenance.settings["band_hz"] == "2,40"
    assert back.provenance.settings["slow"] == axis_logs[0].name


def scaled(path: Path, target: Path, column: str, factor: float) -> Path:
    table = pd.read_parquet(path)
    table[column] *= factor
    table.to_parquet(target)
    return target


def test_wrong_units_are_not_written(axis_logs, tmp_path: Path) -> None:
    """Degrees beside a reference in rad/s are seen by the check; torque in mNm by the robot."""
    out = tmp_path / "axis.toml"
    common = ("--robot", "two_mass_axis", *LINES, "-o", out)
    degrees = [scaled(p, tmp_path / f"deg_{p.name}", "position_1", 57.3) for p in axis_logs]
    text = run("axis", *degrees, *common, code=2)
    assert "position in deg?" in text and "--unchecked" in text
    torques = [scaled(p, tmp_path / f"mnm_{p.name}", "torque_cmd_1", 1000.0) for p in axis_logs]
    text = run("axis", *torques, *common, code=2)
    assert "1e+03 times those of the robot file" in text
    assert not out.exists()
    assert "written" in run("axis", *torques, *common, "--unchecked")


def test_a_slide_is_no_turn(rigid, tmp_path: Path) -> None:
    columns = tmp_path / "columns.toml"
    columns.write_text(column_map("m", "N"))
    arguments = (rigid / "robot.toml", rigid / "run1.parquet", "--columns", columns)
    text = run("rigid-body", *arguments, code=2)
    assert "expected axes that turn, turn, turn, as the robot's" in text


def test_axis_options_reach_the_fit(axis_logs) -> None:
    text = run(
        "axis", *axis_logs, "--gear-ratio", 1 / 224.3, *LINES, "--offset", "--fixed", "F_v",
        "--smoothing-rad-s", 0.01,
    )  # fmt: skip
    third = text[text.index("Step 3") :]
    assert "u_0" in third and "F_v" not in third[: third.index("status")]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], ["--gear-ratio", "--robot"]),
        (["--gear-ratio", "-2"], ["--gear-ratio", "joint angle per motor angle"]),
        (["--gear-ratio", "224.3"], ["--gear-ratio", "1/224", "got 224.3"]),
        (["--gear-ratio", "0.004", "-o", "x.toml"], ["--out", "--robot"]),
        (["--robot", "two_mass_axis", "--axis", "2"], ["--axis", "expected 1 or", "got 2"]),
        (["--robot", "irb6600_like"], ["axis0.parquet", "3 axes"]),
        (["--robot", "two_mass_axis", "--band-hz", "1,40"], ["--band-hz", "--period-s"]),
        (["--robot", "two_mass_axis", "--period-s", "2.5", "--band-hz", "1"], ["LOW,HIGH"]),
        (["--robot", "two_mass_axis", "--period-s", "2.5", "--band-hz", "9,1"], ["LOW <= HIGH"]),
        (["--robot", "two_mass_axis", "--notch-band-hz", "a,b"], ["--notch-band-hz", "numbers"]),
        (["--robot", "two_mass_axis", "--masses", "9"], ["n_masses", "2 to 4"]),
    ],
)
def test_axis_refuses_by_name(axis_logs, arguments, words, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = run("axis", *axis_logs, *arguments, code=2)
    for word in words:
        assert word in text
    assert not list(tmp_path.iterdir())


# Elastic joints.


@pytest.fixture(scope="module")
def responses(tmp_path_factory) -> list[Path]:
    folder = tmp_path_factory.mktemp("responses")
    rng = np.random.default_rng(0)
    out = []
    for i, pose in enumerate(POSES):
        g = model_response(ELASTIC, LINES_HZ, pose, quantity="acceleration").values
        std = 0.05 * np.abs(g)
        error = rng.normal(size=(2, *g.shape)) / np.sqrt(2)
        response = frequency_response(
            LINES_HZ,
            g + std * (error[0] + 1j * error[1]),
            estimator="test",
            variance=std**2,
            output_unit="rad/s^2",
            attrs={"joint_angle_rad": list(pose)},
        )
        out.append(folder / f"pose{i}.nc")
        save_netcdf(response, out[-1])
    return out


def test_elastic_fits_and_writes(responses, tmp_path: Path) -> None:
    out = tmp_path / "elastic.toml"
    start = ("--start", "axis1.stiffness=1e6")
    text = run(
        "elastic", "irb6600_like", *responses, "--parameters", "axis?.stiffness",
        "--parameters", "axis2_yaw.damping", *start, "-o", out,
    )  # fmt: skip
    assert "axis1.stiffness" in text and "misfit" in text and "converged" in text
    back = load_identified(out)
    names = ("axis1.stiffness", "axis2.stiffness", "axis2_yaw.damping", "axis3.stiffness")
    assert back.names == names
    want = robot_parameters(ELASTIC)
    score = (back.values - [want[n] for n in names]) / back.standard_errors
    assert np.abs(score).max() < 4
    given = back.provenance.settings
    assert given["start"]["axis1.stiffness"] == 1e6
    assert given["parameters"] == list(names) and given["seed"] == 0 and "out" not in given
    assert given["responses"] == [path.name for path in responses]
    np.testing.assert_array_equal(given["operating_points_rad"], POSES)
    again = run("elastic", "irb6600_like", *responses, *start, "--parameters", names[0])
    assert "axis2" not in again


def test_one_command_takes_up_what_another_found(axis_logs, tmp_path: Path) -> None:
    first, second = tmp_path / "axis.toml", tmp_path / "elastic.toml"
    run("axis", *axis_logs, "--robot", "two_mass_axis", *LINES, "-o", first)
    robot = load_identified(first).robot
    bare = robot.with_effects([])
    g = model_response(bare, LINES_HZ, [0.0], quantity="acceleration").values
    variance = (0.01 * np.abs(g)) ** 2
    response = frequency_response(
        LINES_HZ, 1.01 * g, estimator="test", variance=variance, output_unit="rad/s^2"
    )
    save_netcdf(response, tmp_path / "g.nc")
    text = run("elastic", first, tmp_path / "g.nc", "--at", 0, "-o", second)
    kept = "nonlinear_stiffness@1, coulomb_friction@1"
    assert f"not in the linear model, kept as they are: {kept}" in text
    assert load_identified(second).effects == robot.effects
    # Edited since: the robot file has its effects all the same.
    first.write_text(first.read_text() + "# looked at\n")
    run("elastic", first, tmp_path / "g.nc", "--at", 0, "-o", second, "--force")
    assert load_robot(second).effects == robot.effects


def test_elastic_takes_poses_from_options(responses, tmp_path: Path) -> None:
    at = [x for pose in POSES for x in ("--at", ",".join(map(str, pose)))]
    out = tmp_path / "r.toml"
    swapped = at[2:] + at[:2]
    one = ("--parameters", "axis1.stiffness", "--criterion", "log_least_squares")
    plain = run("elastic", "irb6600_like", *responses, *one, *at)
    one += ("--robust",)
    right = run("elastic", "irb6600_like", *responses, *one, *at, "-o", out)
    assert json.loads((tmp_path / "r.identified.json").read_text())["provenance"]["settings"][
        "robust"
    ]
    assert right.split("written:")[0].strip() != plain
    assert right != run("elastic", "irb6600_like", *responses, *one, *swapped)


def test_elastic_that_does_not_converge_says_so(responses, monkeypatch) -> None:
    import axisight  # noqa: PLC0415

    real = axisight.frequency_fit.FrequencyFitOptions
    monkeypatch.setattr(
        axisight.frequency_fit,
        "FrequencyFitOptions",
        lambda **options: real(**options, max_iterations=1),
    )
    text = run("elastic", "irb6600_like", *responses, "--start", "axis1.stiffness=4e5", code=1)
    assert "max_iterations" in text and "warning: stopped at the iteration limit" in text


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--parameters", "axis9.*"], ["--parameters", "axis1.stiffness", "axis9.*"]),
        (["--start", "axis1.mass=3"], ["--start", "axis1.stiffness", "axis1.mass"]),
        (["--start", "axis1.stiffness=soft"], ["--start axis1.stiffness", "numbers", "soft"]),
        (["--at", "0,0,0"], ["--at", "2 responses", "got 1"]),
        (["--at", "0,0", "--at", "0,0"], ["pose0.nc", "3 angles", "got 2"]),
        (["--at", "0,x,0", "--at", "0,0,0"], ["--at", "numbers", "0,x,0"]),
        (["--criterion", "best"], ["criterion", "best"]),
        (["--sampling", "none"], ["sampling", "continuous"]),
        (["--starts", "0"], ["starts", "0"]),
    ],
)
def test_elastic_refuses_by_name(responses, arguments, words) -> None:
    text = run("elastic", "irb6600_like", *responses, *arguments, code=2)
    for word in words:
        assert word in text


def test_elastic_needs_responses_with_a_place(responses, tmp_path: Path) -> None:
    assert "expected a NetCDF file" in run("elastic", "irb6600_like", tmp_path / "no.nc", code=2)
    g = model_response(ELASTIC, LINES_HZ, POSES[0], quantity="acceleration").values
    bare = frequency_response(LINES_HZ, g, estimator="test", output_unit="rad/s^2")
    save_netcdf(bare, tmp_path / "bare.nc")
    text = run("elastic", "irb6600_like", tmp_path / "bare.nc", code=2)
    assert "--at" in text and "joint_angle_rad" in text
    text = run("elastic", "irb6600_like", tmp_path / "bare.nc", "--at", "0,0.3,-0.4", code=2)
    assert "expected a variance" in text


def test_the_page_runs_as_it_stands(
    repository: Path, rigid, axis_logs, responses, tmp_path: Path, monkeypatch
) -> None:
    monkeypatch.chdir(tmp_path)
    page = (repository / "docs" / "identify_cli.md").read_text(encoding="utf-8")
    exec("\n".join(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)), {})
    files = {"arm.toml": rigid / "robot.toml"}
    files |= {f"run{i}.parquet": rigid / f"run{i}.parquet" for i in (1, 2, 3)}
    files |= dict(zip(("slow.parquet", "low.parquet", "high.parquet"), axis_logs, strict=True))
    files["pose2.nc"] = responses[1]
    for name, source in files.items():
        shutil.copy(source, tmp_path / name)
    for name, preset in (("axis", "two_mass_axis"), ("arm_elastic", "irb6600_like")):
        (tmp_path / f"{name}.toml").write_text(load_robot(preset).toml)
    blocks = re.findall(r"```sh\n(.*?)```", page, flags=re.DOTALL)
    assert len(blocks) == 3
    for block in blocks:
        program, command, *arguments = shlex.split(block.replace("\\\n", " "))
        assert (program, command) == ("axisight", "identify")
        run(*arguments)
        assert load_identified(arguments[arguments.index("-o") + 1]).names


def test_rigid_body_of_a_real_axis(repository: Path, shared_data: Path, tmp_path: Path) -> None:
    """EMPS: least squares of Janot, Gautier and Brunot (2019), and the run with pulses."""
    emps, example = shared_data / "emps", repository / "examples" / "emps"
    out = tmp_path / "emps.toml"
    run(
        "rigid-body", example / "robot.toml", emps / "DATA_EMPS.mat", "--no-rotors",
        "--held-out", emps / "DATA_EMPS_PULSES.mat", "--columns", example / "columns.toml",
        "--cutoff-hz", 50, "-o", out,
    )  # fmt: skip
    back = load_identified(out)
    published = {
        "carriage.mass": 95.109,
        "carriage.viscous_friction": 203.50,
        "coulomb_friction@1.coulomb_nm": 20.394,
        # An effect gives the motor what the published term asks of it.
        "torque_offset@1.offset_nm": 3.165,
    }
    for name, value in published.items():
        # Another filter on the same log: within 3 %, and within a standard error.
        assert back.value(name) == pytest.approx(value, rel=0.03), name
    errors = [e["relative_error"][0] for e in back.provenance.settings["torque_error"]]
    assert errors[0] < 0.05 and errors[1] < 0.07
