"""``axisight frf``: from logs to a file that ``identify elastic`` reads, what it prints, what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import axisight
from axisight.cli import app
from axisight.excitation import read_references
from axisight.frf.interop import load_netcdf
from axisight.responses import OPERATING_POINT
from axisight.robot_file import hash_file
from response_logs import periodic_logs, robot_logs, truth

POSE = [0.0, 0.3, -0.4]


def run(*arguments: object, code: int = 0) -> str:
    result = CliRunner().invoke(app, [str(part) for part in arguments])
    assert result.exit_code == code, result.output
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return " ".join(result.output.split())


def written(folder: Path, logs) -> list[Path]:
    """Write logs with the native columns and return their files."""
    paths = []
    for one in logs:
        table = {"time_s": one.time_s}
        for i in range(one.n_axes):
            if one.velocity_ref_rad_s is not None:
                table[f"velocity_ref_{i + 1}"] = one.velocity_ref_rad_s[:, i]
            table[f"torque_cmd_{i + 1}"] = one.torque_nm[:, i]
            table[f"position_{i + 1}"] = one.position_rad[:, i]
        paths.append(folder / f"{one.name}.parquet")
        pd.DataFrame(table).to_parquet(paths[-1], index=False)
    return paths


@pytest.fixture
def exact(tmp_path: Path) -> list[Path]:
    return written(tmp_path, periodic_logs(realizations=2, noise=1e-3, n=512, periods=5))


def test_a_response_with_all_that_belongs_to_it(exact: list[Path], tmp_path: Path) -> None:
    out, picture = tmp_path / "r.nc", tmp_path / "r.png"
    said = run("frf", *exact, "-o", out, "--at", "0.1,-0.2", "--plot", picture)
    assert "period: 0.512 s (512 samples), found from the reference" in said
    assert "realizations: 2, of 2 experiments each" in said
    assert "logarithmic mean over the realizations" in said
    assert "operating point: 0.1000, -0.2000 rad" in said
    found = load_netcdf(out)
    np.testing.assert_allclose(found.attrs[OPERATING_POINT], [0.1, -0.2])
    exactly = truth(found, 512)
    # Noise of 1e-3 on amplitudes of one, 512 samples and 20 periods in all: 1e-3 * sqrt(2 / 1e4).
    assert np.median(np.abs(found["response"].values / exactly - 1)) < 1e-4
    assert np.isfinite(found["variance"]).all()
    source = json.loads(found.attrs["provenance"])
    assert source["data"] == {path.name: hash_file(path) for path in exact}
    assert source["method"] == "axisight frf"
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name", ["joint-input-output", "h1", "robust", "local_polynomial"])
def test_estimators_by_name(exact: list[Path], tmp_path: Path, name: str) -> None:
    out = tmp_path / "r.nc"
    said = run("frf", *exact, "--estimator", name, "-o", out, "--quantity", "velocity")
    assert f"estimator: {name.replace('-', '_')}; velocity by torque [rad/s/Nm]" in said
    assert load_netcdf(out)["response"].attrs["units"] == "rad/s/Nm"
    assert "operating point: unknown" in said


def test_the_part_and_the_band_asked_for(exact: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "r.nc"
    said = run("frf", *exact, "--from", 0.5, "--to", 2.5, "--band-hz", "20,40", "-o", out)
    assert "periods: 3 of 3 used" in said
    frequency = load_netcdf(out)["frequency_hz"].values
    assert frequency[0] >= 20
    assert frequency[-1] <= 40


def test_elastic_reads_it(tmp_path: Path) -> None:
    """Stiffnesses of the linear robot come back, from starts that are wrong by up to 40 %."""
    robot, names = axisight.load_robot("irb6600_like"), ("axis2.stiffness", "axis3.stiffness")
    logs = written(tmp_path, robot_logs(robot, 10, pose=POSE, noise_seed=1))
    response, fitted = tmp_path / "pose.nc", tmp_path / "fitted.toml"
    run("frf", *logs, "--robot", "irb6600_like", "--drop-periods", 7, "-o", response)
    options = [part for name in names for part in ("--parameters", name)]
    said = run(
        "identify", "elastic", "irb6600_like", response, *options,
        "--start", "axis*.stiffness=2.5e6", "-o", fitted,
    )  # fmt: skip
    assert "operating points moved by up to" in said
    wanted, found = (
        axisight.robot_parameters(robot),
        axisight.robot_parameters(axisight.load_robot(fitted)),
    )
    for name in names:
        # Noise is 1e-4 of the response at 59 lines; the transient left is of that size.
        assert found[name] == pytest.approx(wanted[name], rel=1e-3)


def test_what_is_refused(exact: list[Path], tmp_path: Path) -> None:
    few = run("frf", exact[0], code=2)
    assert "expected at least 2 experiments for 2 axes" in few
    twice = run("frf", exact[0], exact[0], code=2)
    assert "log_repeated" in twice
    assert "--out: expected a name ending in .nc" in run("frf", *exact, "-o", "r.csv", code=2)
    assert "--plot: expected a name ending in .png" in run("frf", *exact, "--plot", "r.txt", code=2)
    assert "--quantity: expected position" in run("frf", *exact, "--quantity", "jerk", code=2)
    assert "--axes: expected numbers from 1" in run("frf", *exact, "--axes", "elbow", code=2)
    assert "--design:" in run("frf", *exact, "--design", exact[0], code=2)
    assert "--band-hz: expected excited lines" in run("frf", *exact, "--band-hz", "400,450", code=2)
    taken = tmp_path / "notes.nc"
    taken.mkdir()
    assert "--out" in run("frf", *exact, "-o", taken, code=2)


EXCITE = [
    *("excite", "--robot", "irb6600_like", "--period-s", "0.5", "--band-hz", "4,60"),
    *("--peak-rad-s", "8", "--directions", "t2"),
]


def test_realizations_share_lines_and_differ_in_phases(tmp_path: Path) -> None:
    out = tmp_path / "r.parquet"
    for phases in ("random", "optimized"):
        more = ["--phases", phases, "--starts", 1, "--grid", "odd_random"]
        said = run(*EXCITE, *more, "--realizations", 3, "--out", out)
        assert "9 experiments" in said
        made = read_references(out)
        spectrum = np.abs(np.fft.rfft(made.period, axis=1))
        for m in range(3):
            active = spectrum[3 * m].max(axis=1) > 1e-6 * spectrum.max()
            np.testing.assert_array_equal(np.flatnonzero(active), made.lines)
        x = made.period[[0, 3, 6], :, 0]
        # Independent phases: a cyclic correlation far from one at every shift.
        for a, b in ((0, 1), (0, 2), (1, 2)):
            across = np.fft.irfft(np.fft.rfft(x[a]) * np.conj(np.fft.rfft(x[b])))
            assert across.max() < 0.9 * np.sqrt((x[a] @ x[a]) * (x[b] @ x[b]))
        run(*EXCITE, *more, "--out", tmp_path / "one.parquet")
        np.testing.assert_array_equal(
            read_references(tmp_path / "one.parquet").period, made.period[:3]
        )
    refused = run(*EXCITE, "--kind", "chirp", "--realizations", 2, "--out", out, code=2)
    assert "realizations: expected 1, or a multisine" in refused


def test_limits_are_checked_where_the_arm_starts(tmp_path: Path) -> None:
    out = tmp_path / "r.parquet"
    level = ["--phases", "random", "--torque-limit", 45, "--out", out]
    stretched = run(*EXCITE, *level, "--start", "0,0.8,0.2", code=1)
    assert "torque" in stretched
    assert "written" in run(*EXCITE, *level, "--start", "0,0,1.0")


def test_each_experiment_in_a_log_of_its_own(tmp_path: Path) -> None:
    references, out = tmp_path / "r.parquet", tmp_path / "run.parquet"
    run(*EXCITE, "--phases", "random", "--out", references)
    common = ["simulate", "irb6600_like", references, "--periods", 2, "--noise-seed", 5]
    run(*common, "--each", "--run", 10, "--out", out)
    assert not out.exists()
    for e in (1, 2, 3):
        alone = tmp_path / "alone.parquet"
        run(*common, "--experiment", e, "--run", 9 + e, "--out", alone)
        assert alone.read_bytes() == (tmp_path / f"run-{e}.parquet").read_bytes()
    text = run(*common, "--each", "--experiment", 1, "--out", out, code=2)
    assert "--each: expected without --experiment" in text


@pytest.mark.parametrize(
    ("run_of", "lines", "estimator"), [("A", np.arange(11, 251), "mfrf"), ("B", None, "fast")]
)
def test_a_real_two_mass_bench(
    shared_data: Path, tmp_path: Path, run_of: str, lines, estimator: str
) -> None:
    """Motor current to motor angle in closed loop, without a reference: all is found from the log.

    Run A excites all lines from 11 to 250 Hz, run B an odd-odd grid. The anti-resonance is near 53 Hz, the
    resonance near 77 Hz. A current of 1 A counts as 1 Nm.
    """
    source = shared_data / "fditools_multisine" / f"MultisineType{run_of}.mat"
    if not source.is_file():
        pytest.skip(f"no {source}")
    columns = tmp_path / "bench.toml"
    columns.write_text(
        'schema = "axisight.columns/1"\nsample_rate_hz = 2500\n[[axis]]\n'
        'position = {name = "theta_mx", unit = "rad"}\n'
        'torque = {name = "iq_adx", unit = "A", scale = 1.0}\n'
    )
    out = tmp_path / "bench.nc"
    said = run("frf", source, "--columns", columns, "-o", out)
    assert "period: 1 s (2500 samples), found from the torque" in said
    assert f"estimator: {estimator} " in said
    assert ("distortion dominates" in said) == (run_of == "B")
    found = load_netcdf(out)
    frequency, size = found["frequency_hz"].values, np.abs(found["response"].values[:, 0, 0])
    np.testing.assert_allclose(frequency, np.arange(13, 250, 4) if lines is None else lines)
    middle = (frequency > 40) & (frequency < 100)
    # Lines of run B are 4 Hz apart.
    assert frequency[middle][np.argmin(size[middle])] == pytest.approx(53, abs=3)
    assert frequency[middle][np.argmax(size[middle])] == pytest.approx(77, abs=3)
