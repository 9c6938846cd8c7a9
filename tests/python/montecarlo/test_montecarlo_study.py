"""Study files: everything a call can say, and nothing unknown or impossible."""

import numpy as np
import pytest
from typer.testing import CliRunner

from axisight import StudyError, load_robot
from axisight import montecarlo as mc
from axisight.cli import app
from axisight.montecarlo.study import Study
from montecarlo_data import ROBOT, robot_file, same_bits, small_study

RICH = {
    "name": "everything",
    "robot_parameters": {"axis1.damping": 2500.0},
    "plant": mc.Plant(model="nonlinear", method="rk4", substeps=2, start_rad=[0.1, -0.2, 0.3]),
    "measurement": mc.Measurement(waiting_periods=2, periods=3, noise=False, output="velocity"),
    "statistics": mc.Statistics(quantiles=[0.1, 0.9], keep_responses=True),
    "spread": [mc.Spread(parameter="payload.mass_kg", distribution="uniform", absolute=5.0)],
    "effect": [mc.EffectEntry(name="payload", parameters={"mass_kg": 10.0})],
}


def test_toml_round_trip(tmp_path):
    for study in (small_study(), small_study(**RICH)):
        path = tmp_path / "study.toml"
        path.write_text(study.to_toml())
        assert mc.read_study(path) == study


def test_a_file_says_what_a_call_says(tmp_path):
    study = small_study(**{**RICH, "runs": 2})
    path = tmp_path / "study.toml"
    path.write_text(study.to_toml())
    same_bits(mc.run(path), mc.run(study))


def test_robot_file_stands_next_to_the_study(tmp_path):
    (tmp_path / "robot.toml").write_text(load_robot(ROBOT).toml)
    text = small_study(runs=1).to_toml().replace(f'"{ROBOT}"', '"robot.toml"')
    (tmp_path / "study.toml").write_text(text)
    same_bits(mc.run(tmp_path / "study.toml"), mc.run(small_study(runs=1)))


def changed(path: str, value) -> dict:
    """The small study as data, with one entry replaced."""
    data = small_study().model_dump(by_alias=True, mode="json")
    *parents, last = path.split(".")
    at = data
    for part in parents:
        at = at[int(part)] if part.isdigit() else at[part]
    at[int(last) if last.isdigit() else last] = value
    return data


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("excitation.multisine.peek_rad_s", 8, r"peek_rad_s: unknown key"),
        ("effect.0.axle", 1, r"effect\.0\.axle: unknown key"),
        ("effect.0.axes", [1, 2], "torque_ripple.*axes: expected none"),
        ("schema", "axisight.montecarlo/2", "schema"),
        ("seed", -1, "seed"),
        ("runs", 0, "runs"),
        ("runs", -3, "runs"),
        ("block_runs", 0, "block_runs"),
        ("excitation.multisine.period_s", float("nan"), r"multisine\.period_s"),
        ("excitation.multisine.period_s", 0.0, r"multisine\.period_s"),
        ("excitation.multisine.period_s", -0.5, r"multisine\.period_s"),
        ("excitation.multisine.period_s", 0.50003, r"multisine\.period_s: expected.*whole number"),
        ("excitation.multisine.period_s", 1e300, r"multisine\.period_s"),
        ("excitation.multisine.band_hz", [40, 4], r"multisine\.band_hz"),
        ("excitation.multisine.band_hz", [4, 1000], r"band_hz.*Nyquist"),
        ("excitation.multisine.band_hz", [4.5, 5.5], r"band_hz.*multiple of"),
        ("excitation.multisine.peak_rad_s", float("inf"), r"peak_rad_s"),
        ("excitation.square.period_s", 0.3, r"square\.period_s"),
        ("excitation.square.smoothing_samples", 300, r"square\.smoothing"),
        ("excitation.directions", [[1, 1, 1]] * 3, "directions: expected a non-singular"),
        ("excitation.directions", [[1]], "directions"),
        ("measurement.periods", 0, r"measurement\.periods"),
        ("measurement.waiting_periods", 0, "waiting_periods: expected at least 2"),
        ("measurement.waiting_periods", 10**9, "waiting_periods: expected at most"),
        ("plant.start_rad", [0.0], "expected 3"),
        ("plant.substeps", 0, r"plant\.substeps"),
        ("statistics.quantiles", [1.5], r"statistics\.quantiles"),
        ("statistics.relative_accuracy", 0.0, "relative_accuracy"),
        ("effect.0.axis", 7, "axis"),
        ("effect.0.name", "magic", "magic"),
        ("effect.0.parameters", {"order_1": 1e6}, "order_1"),
        ("effect.0", {"name": "coulomb_friction", "axis": 1, "parameters": {"coulomb_nm": 1.0}},
         "nonlinear plant"),
        ("robot_parameters", {"axis9.mass": 1.0}, r"axis9\.mass"),
        ("robot", "nowhere.toml", "nowhere"),
        ("spread", [{"parameter": "axis1.stiffness", "relative": -0.1}], "relative"),
    ],
)  # fmt: skip
def test_bad_studies_name_the_field(path, value, message):
    with pytest.raises(Exception, match=message) as caught:
        mc.run(Study(**changed(path, value)))
    assert isinstance(caught.value, StudyError | ValueError)


def test_bad_calls():
    with pytest.raises(StudyError, match="seed"):
        mc.run(small_study(), seed=-1)
    with pytest.raises(StudyError, match="runs"):
        mc.run(small_study(), runs=0)
    with pytest.raises(ValueError, match="threads: expected at least 1, got 0"):
        mc.run(small_study(), threads=0)
    with pytest.raises(ValueError, match="backend: expected local or dask"):
        mc.run(small_study(), backend="slurm")
    with pytest.raises(ValueError, match="scheduler: expected backend='dask'"):
        mc.run(small_study(), scheduler="tcp://127.0.0.1:1")


@pytest.fixture
def study_file(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(small_study().to_toml())
    return path


def command(*words: object):
    result = CliRunner().invoke(app, ["montecarlo", *map(str, words)])
    return result, " ".join(result.output.split())


def test_command(study_file, tmp_path):
    out = tmp_path / "out"
    result, text = command(study_file, "--runs", 12, "--out", out)
    assert result.exit_code == 0, text
    assert "12 runs counted, 0 with failures" in text
    result, text = command(study_file, "--runs", 20, "--out", out)
    assert result.exit_code == 2
    assert "resume" in text
    result, text = command(study_file, "--runs", 20, "--out", out, "--resume")
    assert result.exit_code == 0, text
    assert "20/20" in text
    assert "runs/s" in text


def test_command_refuses(study_file, tmp_path):
    result, text = command(tmp_path / "none.toml", "--out", tmp_path / "o")
    assert result.exit_code == 2
    assert "none.toml" in text
    study_file.write_text("speed = 3\n" + study_file.read_text())
    result, text = command(study_file, "--out", tmp_path / "o")
    assert result.exit_code == 2
    assert "unknown key" in text
    assert not (tmp_path / "o").exists()


def test_command_with_failures(tmp_path):
    """Half the draws are negative: those runs are listed, and the command succeeds."""
    path = tmp_path / "study.toml"
    spread = [mc.Spread(parameter="axis1.stiffness", relative=1e6)]
    path.write_text(small_study(runs=8, spread=spread).to_toml())
    result, text = command(path, "--out", tmp_path / "o")
    failed = int(text.split("counted, ")[1].split()[0])
    assert 0 < failed < 8
    assert "invalid_parameters" in text
    assert result.exit_code == 0


def test_command_without_any_success(tmp_path):
    path = tmp_path / "study.toml"
    robot = robot_file(tmp_path, "kp = [7.039,", "kp = [-7.039,")
    path.write_text(small_study(runs=3, robot=robot).to_toml())
    result, text = command(path, "--out", tmp_path / "o")
    assert "0 runs counted, 3 with failures" in text
    assert result.exit_code == 1


def test_clipped_multisines_have_more_power_at_the_same_peak():
    """Noise alone acts, so standard errors fall as the crest factor does: for 73 lines from 3 to 1.6."""
    results = []
    for iterations in (0, 100):
        signal = mc.Multisine(
            period_s=2.0, band_hz=(4, 40), peak_rad_s=8, clipping_iterations=iterations
        )
        study = small_study(
            excitation=mc.Excitation(multisine=signal),
            effect=[],
            runs=24,
            # The transient, which grows with the amplitude, has to fall far below the noise.
            measurement=mc.Measurement(waiting_periods=6),
        )
        first, second = (mc.run(study, threads=threads) for threads in (1, 2))
        same_bits(first, second)
        results.append(first)
    ratio = np.median(results[0].standard_error / results[1].standard_error)
    # 24 runs know a standard error to 15 %, and the median over 73 lines better.
    assert 1.6 < ratio < 2.4


def test_clipping_iterations_are_checked():
    with pytest.raises(StudyError, match="clipping_iterations"):
        mc.Multisine(period_s=0.5, band_hz=(4, 40), peak_rad_s=8, clipping_iterations=-1)
