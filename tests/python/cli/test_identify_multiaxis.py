"""`axisight identify multiaxis`: logs of all axes to a robot file."""

import json
from functools import partial
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from axisight import FitOptions, Log, read_log
from axisight.cli import app
from axisight.graybox.multiaxis import procedure
from axisight.robot import Accelerometer
from axisight.robot_file import load_identified
from multiaxis_data import ROBOT, TRUTH, broadband, slow

GEARS = ("axis1.stiffness", "axis2.stiffness", "axis3.stiffness")


def written(log: Log, folder: Path) -> Path:
    columns = {"time_s": log.time_s}
    for axis in range(log.n_axes):
        columns |= {
            f"position_{axis + 1}": log.position_rad[:, axis],
            f"torque_cmd_{axis + 1}": log.torque_nm[:, axis],
            f"velocity_ref_{axis + 1}": log.velocity_ref_rad_s[:, axis],
        }
    path = folder / f"{log.name}.parquet"
    pd.DataFrame(columns).to_parquet(path)
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("logs")
    return [written(log, folder) for log in [slow(seconds=6.0), *broadband()[3:]]]


def run(*arguments: object) -> tuple[int, str]:
    found = CliRunner().invoke(app, ["identify", "multiaxis", *map(str, arguments)])
    return found.exit_code, found.output


def test_logs_to_a_robot_file(files: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "arm.toml"
    patterns = ["--parameters", "axis?.stiffness", "--no-coulomb"]
    status, text = run("irb6600_like", *files[1:], "--slow", files[0], *patterns, "-o", out)
    assert status == 0, text
    assert "Step 1: friction from slow motions" in text and "Step 3: all parameters" in text
    found = load_identified(out)
    assert set(found.names) == set(GEARS)
    for name in GEARS:
        assert found.value(name) == pytest.approx(TRUTH[name], rel=0.005)
    sidecar = json.loads((tmp_path / "arm.identified.json").read_text("utf-8"))
    assert set(sidecar["provenance"]["data"]) == {path.name for path in files}
    assert sidecar["provenance"]["settings"]["parameters"] == list(GEARS)
    again, text = run("irb6600_like", *files[1:], *patterns, "-o", out)
    assert again == 2 and "--force" in text


def test_accelerometers_from_the_simulation_to_the_robot_file(
    files: list[Path], tmp_path: Path
) -> None:
    """The robot file states the sensor, `simulate` writes its columns, and step 3 compares them."""
    arm, log, out = (tmp_path / name for name in ("arm.toml", "run.parquet", "found.toml"))
    robot = ROBOT.with_accelerometers([Accelerometer("tip", "axis3_yaw", (1.2, 0.1, 0.2))])
    arm.write_text(robot.toml, encoding="utf-8")
    made = CliRunner().invoke(
        app, ["simulate", str(arm), str(files[2]), "--noise-seed", "1", "--out", str(log)]
    )
    assert made.exit_code == 0, made.output
    readings = read_log(log).acceleration_m_s2["tip"]
    assert readings.shape[1] == 3 and abs(readings[0, 2] - 9.81) < 0.01
    options = ["--parameters", "axis2.stiffness", "--no-coulomb", "--no-responses"]
    status, text = run(arm, log, *options, "-o", out)
    assert status == 0, text
    assert "from motors and accelerometers" in text
    assert load_identified(out).value("axis2.stiffness") == pytest.approx(3848000.0, rel=1e-3)
    assert load_identified(out).robot.accelerometers == robot.accelerometers


def test_a_search_that_does_not_end_has_status_one(files: list[Path], monkeypatch) -> None:
    """One step from springs that are far off is not enough."""
    monkeypatch.setattr(procedure, "FitOptions", partial(FitOptions, max_iterations=1))
    status, text = run(
        "irb6600_like", *files[1:], "--parameters", "axis2*.stiffness", "--no-responses"
    )
    assert status == 1
    assert "status: max_iterations" in text


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--parameters", "axis9.*"], "--parameters: expected names or patterns of axis1"),
        (["--load", "pose2_axis1=1,2"], "--load: expected LOG=KG,X,Y,Z"),
        (["--load", "other=1,0,0,0"], "--load: expected a log of pose2_axis1"),
        (["--band-hz", "1,40"], "--band-hz: expected --period-s SECONDS"),
    ],
)
def test_misuse_names_the_option(files: list[Path], options: list[str], text: str) -> None:
    status, printed = run("irb6600_like", *files[1:], *options)
    assert status == 2
    assert text in " ".join(printed.split())


def test_too_few_logs_say_what_to_record(files: list[Path]) -> None:
    status, text = run("irb6600_like", *files[1:3])
    assert status == 2
    assert "expected 3 logs of one pose and load" in " ".join(text.split())
