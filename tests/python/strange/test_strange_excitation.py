"""Every argument of the excitation package, fed with what it was not made for."""

import numpy as np
import pytest

from axisight import excitation as ex
from axisight import load_robot
from strange_values import feed

T = 1e-3
LINES = np.array([1, 3, 5])
SINES = ex.multisine(0.1, T, lines=LINES, phases="schroeder")
WAVE = ex.triangle(0.1, T)
ROBOT = load_robot("irb6600_like")
SMALL = ex.references(ex.multisine(0.01, ROBOT.sample_time_s, lines=[1]), 3)
AXIS = load_robot("two_mass_axis")
FLAT = ex.multisine(1.0, AXIS.sample_time_s, lines=range(2, 20))
DESIGN = {
    "robot": "irb6600_like",
    "signal": {"period_s": 0.1, "band_hz": (20.0, 60.0), "peak_rad_s": 1.0, "phases": "random"},
}

CASES = {
    "line_set": (
        ex.line_set,
        {
            "period_s": 0.1,
            "band_hz": (10.0, 400.0),
            "sample_time_s": T,
            "grid": "odd_random",
            "group": 4,
            "seed": 1,
            "run": 2,
        },
    ),
    "multisine": (
        ex.multisine,
        {
            "period_s": 0.1,
            "sample_time_s": T,
            "band_hz": (10.0, 100.0),
            "grid": "full",
            "amplitude": 1.0,
            "phases": "random",
            "seed": 1,
            "run": 0,
            "group": 4,
        },
    ),
    "multisine of lines": (ex.multisine, {"period_s": 0.1, "sample_time_s": T, "lines": [1, 2]}),
    "Multisine": (
        ex.Multisine,
        {
            "sample_time_s": T,
            "n_samples": 100,
            "lines": LINES,
            "amplitude": np.ones(3),
            "phase_rad": np.zeros(3),
            "detection_lines": [2],
            "snow_lines": [9],
            "snow_amplitude": [0.1],
            "snow_phase_rad": [0.0],
        },
    ),
    "Multisine.scaled peak": (SINES.scaled, {"peak": 2.0}),
    "Multisine.scaled rms": (SINES.scaled, {"rms": 2.0}),
    "Multisine.through": (SINES.through, {"response": np.ones(3)}),
    "schroeder_phases": (ex.schroeder_phases, {"amplitude": [1.0, 2.0]}),
    "random_phases": (ex.random_phases, {"n_lines": 3, "seed": 1, "run": 0}),
    "optimize_crest_factor": (
        ex.optimize_crest_factor,
        {
            "signal": SINES,
            "starts": 1,
            "time_s": None,
            "seed": 0,
            "from_signal": False,
            "clipping": ex.Clipping(iterations=3),
            "refinement": "none",
            "snow_lines": [7],
            "snow_limit": 1.0,
            "threads": 1,
        },
    ),
    "optimize_crest_factor, response": (
        ex.optimize_crest_factor,
        {"signal": SINES, "starts": 1, "refinement": "none", "response": np.ones(3)},
    ),
    "chirp": (
        ex.chirp,
        {
            "period_s": 0.1,
            "band_hz": (10.0, 100.0),
            "sample_time_s": T,
            "amplitude": 1.0,
            "phase_rad": 0.0,
        },
    ),
    "triangle": (ex.triangle, {"period_s": 0.1, "sample_time_s": T, "amplitude": 1.0}),
    "square": (
        ex.square,
        {"period_s": 0.1, "sample_time_s": T, "amplitude": 1.0, "smoothing_samples": 4},
    ),
    "prbs": (ex.prbs, {"bits": 4, "sample_time_s": T, "amplitude": 1.0, "hold": 2}),
    "discrete_interval_binary": (
        ex.discrete_interval_binary,
        {
            "period_s": 0.1,
            "sample_time_s": T,
            "lines": [1, 3],
            "weight": 1.0,
            "amplitude": 1.0,
            "hold": 1,
            "starts": 2,
            "seed": 0,
        },
    ),
    "stepped_sine": (
        ex.stepped_sine,
        {
            "period_s": 0.1,
            "sample_time_s": T,
            "frequency_hz": [10.0, 20.0],
            "amplitude": 1.0,
            "waiting_periods": 1,
            "periods": 1,
        },
    ),
    "PeriodicSignal": (
        ex.PeriodicSignal,
        {
            "kind": "x",
            "sample_time_s": T,
            "period": WAVE.period,
            "peak": 1.0,
            "lines": [1],
            "settings": {},
        },
    ),
    "PeriodicSignal.scaled": (WAVE.scaled, {"peak": 2.0}),
    "direction_matrix": (ex.direction_matrix, {"name": "t1", "n_inputs": 3}),
    "dft_matrix": (ex.dft_matrix, {"n_inputs": 3}),
    "references": (
        ex.references,
        {
            "broadband": SINES,
            "n_inputs": 2,
            "directions": "dft",
            "square": WAVE,
            "dc_level": 0.0,
            "seed": 0,
            "run": 0,
            "unit": "rad/s",
        },
    ),
    "zippered": (ex.zippered, {"signal": SINES, "n_inputs": 2}),
    "simultaneous_references": (
        ex.simultaneous_references,
        {"signals": [SINES, SINES], "square": WAVE, "dc_level": 0.0, "unit": "rad/s"},
    ),
    "optimal_spectrum": (
        lambda **a: ex.optimal_spectrum(**a).signal,
        {
            "robot": AXIS,
            "flat": FLAT,
            "optimal_for": "axis1.stiffness",
            "parameters": ["axis1.stiffness", "axis1.damping"],
            "directions": "t1",
            "limited": "both",
            "n_periods": 1,
            "noise_std_rad": 1e-5,
            "operating_points_rad": [[0.0]],
            "flat_share": 0.1,
            "relative_uncertainty": 0.1,
            "models": 2,
            "seed": 0,
            "measured_information": np.zeros((2, 2)),
            "least_share": 1e-4,
            "tolerance": 1e-2,
            "max_iterations": 100,
        },
    ),
    "References": (
        ex.References,
        {
            "sample_time_s": T,
            "period": np.ones((1, 8, 2)),
            "lines": [1],
            "detection_lines": [2],
            "unit": "rad/s",
            "design": {},
        },
    ),
    "References.repeated": (SMALL.repeated, {"periods": 2}),
    "Limits": (
        lambda **limits: ex.check_limits(SMALL, ROBOT, ex.Limits(**limits), periods=1),
        {"velocity_rad_s": 1.0, "acceleration_rad_s2": 1.0, "torque_nm": 1.0},
    ),
    "check_limits": (
        ex.check_limits,
        {
            "reference": SMALL,
            "robot": ROBOT,
            "limits": ex.Limits(torque_nm=1.0),
            "periods": 1,
            "model": "linear",
            "effects": (),
            "start_rad": None,
        },
    ),
    "read_design": (ex.read_design, {"data": DESIGN, "where": "design"}),
    "excite": (ex.excite, {"design": ex.read_design(DESIGN)}),
    "load_design": (ex.load_design, {"path": "design.toml"}),
    "read_references": (ex.read_references, {"path": "x.csv"}),
    "write_references": (ex.write_references, {"reference": SMALL, "path": "x.mat"}),
}
# Repeating for 0.5 or 2^70 periods is refused; a plot of the design is looked at elsewhere.
OTHERS = {"Clipping", "CrestSearch", "Excess", "ExcitationDesign", "Excited", "LimitReport"}
OTHERS |= {"LpRefinement", "OptimalSpectrum", "SteppedSine"}


@pytest.mark.parametrize("name", CASES)
def test_only_errors_of_ours_come_out(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "design.toml").write_text('robot = "irb6600_like"')
    ex.write_references(SMALL, "x.csv")
    function, good = CASES[name]
    assert not (wrong := feed(function, good)), "\n".join(wrong)


@pytest.mark.parametrize("settings", [ex.Clipping, ex.LpRefinement])
def test_settings_of_the_search(settings):
    field = "clipping" if settings is ex.Clipping else "refinement"
    for name in settings.__dataclass_fields__:

        def search(value, name=name):
            chosen = {"clipping": ex.Clipping(iterations=2), field: settings(**{name: value})}
            return ex.optimize_crest_factor(SINES, starts=1, **chosen)

        good = getattr(settings(), name)
        assert not (wrong := feed(search, {"value": good})), "\n".join([name, *wrong])


def test_every_public_name_is_fed():
    fed = {name.split(",")[0].split(" ")[0].split(".")[0] for name in CASES}
    assert set(ex.__all__) == fed | OTHERS
