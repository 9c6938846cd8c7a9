"""The frame of ``axisight reproduce``, and chapter 8 and appendix A in a quick run."""

import sys

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

from axisight.cli import app
from axisight.errors import InputError
from axisight.frf import errors, robot_loop
from axisight_thesis import Item, context, item, item_names, registered, run
from axisight_thesis.appendix_a import STOCHASTIC_FIGURES, stochastic_experiments
from axisight_thesis.chapter8_compare import Ratios, except_for
from axisight_thesis.chapter8_setting import (
    DESIGNS,
    Design,
    excited_lines,
    references,
    square_lines,
)
from axisight_thesis.chapter8_study import (
    experiments,
    from_simulation,
    same_excitation,
    simulate_period,
    true_response,
)
from axisight_thesis.chapter8_tables import THESIS_8_2, mean_errors

NAMES = [
    *(f"table-8.{n}" for n in range(1, 5)),
    *(f"figure-8.{n}" for n in (2, *range(4, 12))),
    *(f"figure-A.{n}" for n in range(1, 9)),
    "claims-8",
    "claims-A",
]


@pytest.fixture(scope="module")
def quick():
    """One realization of everything, shared by the tests."""
    return context(quick=True)


def test_items_are_all_there():
    names = list(registered())
    assert set(NAMES) <= set(names)
    chapter = [n for n in names if n.startswith("figure-8.")]
    assert chapter == [f"figure-8.{n}" for n in (2, *range(4, 12))]
    assert item_names("all") == names
    assert item_names("table-8") == [f"table-8.{n}" for n in range(1, 5)]


def test_unknown_and_repeated_names():
    with pytest.raises(InputError, match=r"expected all or one of .*table-8\.2.*got 'table-12'"):
        item_names("table-12")
    with pytest.raises(InputError, match=r"got 'figure-8\.1'"):
        item_names("figure-8.1")
    with pytest.raises(ValueError, match="registered twice"):
        item("table-8.2")(lambda _: Item("table-8.2", ""))


def test_table_8_2(quick):
    """One realization, 12 experiments. Over realizations the largest factor scatters around 1.6."""
    here = mean_errors(quick)
    away = np.exp(np.abs(np.log(here / THESIS_8_2)))
    assert away.max() <= 2
    assert np.median(away) <= 1.4


def test_excitation_is_that_of_section_8_2(quick):
    lines = excited_lines()
    assert len(lines) == 391
    r = references(quick.robot, Design("T2", square=False), 0, 0)
    assert r.shape == (3, 20_000, 3)
    signs = np.array([[1, 1, 1], [1, -1, 1], [1, 1, -1]])
    assert np.allclose(r, r[0, :, :1] * signs.T[:, None, :])
    # Between samples a sine of 40 Hz is higher by (pi 40 Hz T)^2 / 2 at most.
    assert np.abs(r).max() == pytest.approx(8, rel=2e-3)
    spectrum = np.abs(np.fft.rfft(r[0, :, 0]))
    assert np.allclose(spectrum[lines], spectrum[lines[0]])
    assert np.delete(spectrum, lines).max() < 1e-9 * spectrum[lines[0]]
    crest = 8 / np.sqrt(np.mean(r[0, :, 0] ** 2))
    assert crest == pytest.approx(1.55, abs=0.04)

    square = references(quick.robot, Design("T1", square=True), 0, 0)[0, :, 1]
    assert np.abs(square).max() == pytest.approx(9.6)
    spectrum = np.abs(np.fft.rfft(square))[lines]
    assert spectrum[~square_lines(lines)].max() < 1e-9 * spectrum.max()


def test_no_disturbance_no_error(quick):
    """Without ripple and noise the estimate is the zero-order-hold response."""
    refs = references(quick.robot, DESIGNS[1], 0, 0)
    found = from_simulation(quick, simulate_period(quick, refs, []), excited_lines())
    true = true_response(quick, found.frequency_hz)
    # What is left is the transient after ten seconds, exp(-17) of the motion.
    assert np.abs(errors.relative_error(found.estimate, true)).max() < 1e-4


@pytest.mark.parametrize("design", [DESIGNS[0], DESIGNS[3]])
def test_error_is_that_of_the_lemma(quick, design):
    """Lemma 6.1 with the disturbances as simulated.

    Torque ripple acts within the sample; its mean is taken of two ends, good to a few per cent.
    """
    found = experiments(quick, design)
    true = true_response(quick, found.frequency_hz)
    iw = 2j * np.pi * found.frequency_hz[:, None, None]
    v = errors.total_disturbance(true / iw, found.input_disturbance, found.output_disturbance)
    error = iw * errors.estimation_error(v, found.input)
    actual = found.estimate - true
    assert np.median(np.abs(error - actual) / np.abs(actual)) < 0.05


def test_stochastic_disturbances_are_those_asked_for(quick):
    """The torque really acts: the error is Lemma 6.1's to the transient, and of the right power."""
    design = STOCHASTIC_FIGURES["A.4"]
    found = stochastic_experiments(quick, design)
    true = true_response(quick, found.frequency_hz)
    iw = 2j * np.pi * found.frequency_hz[:, None, None]
    v = errors.total_disturbance(true / iw, found.input_disturbance, found.output_disturbance)
    error = iw * errors.estimation_error(v, found.input)
    assert np.abs(error - (found.estimate - true)).max() < 1e-4 * np.abs(error).max()
    like = experiments(quick, Design("T1", square=True))
    low = found.frequency_hz < 20  # below the corner the filter passes all
    for name in ("input_disturbance", "output_disturbance"):
        power = np.mean(np.abs(getattr(found, name)[low]) ** 2)
        wanted = np.mean(np.abs(getattr(like, name)) ** 2)
        # 191 lines x 9 exponential variables: 2.4 %; five times that
        assert power == pytest.approx(wanted, rel=0.12)


@pytest.mark.parametrize("disturbed_by", [experiments, stochastic_experiments])
def test_reference_reaches_the_input(quick, disturbed_by):
    """U follows from R and V by (6.8), with the loop of the robot."""
    design = Design("T1", square=True)
    found = disturbed_by(quick, design)
    loop = robot_loop(quick.robot, found.frequency_hz)
    refs = references(quick.robot, design, 0, 0)
    r = loop.prefilter @ np.moveaxis(np.fft.rfft(refs, axis=1)[:, excited_lines()], 0, -1)
    iw = 2j * np.pi * found.frequency_hz[:, None, None]
    v = errors.total_disturbance(
        loop.response, found.input_disturbance, found.output_disturbance / iw
    )
    u, _ = errors.closed_loop_spectra(r, v, loop.response, loop.controller)
    # Off the diagonal, where the disturbances make most of U.
    off = ~np.eye(3, dtype=bool)
    difference = np.abs(u - found.input) / np.abs(found.input)
    assert np.median(difference[:, off]) < (0.01 if disturbed_by is experiments else 1e-4)


def test_same_excitation_repeats(quick):
    """Two periods differ by sensor noise only: far less than by the ripple's error."""
    one, two = same_excitation(quick, Design("T1", square=True), 2)
    true = true_response(quick, one.frequency_hz)
    error = errors.mean_relative_error(one.estimate, true)
    between = errors.mean_relative_error(two.estimate, one.estimate)
    assert np.all(between < 0.05 * error)
    assert np.all(between > 0)


def test_exceptions_need_evidence():
    value = np.array([[0.8, 1.01], [1.5, 1.3]])
    small, large = np.full((2, 2), 0.02), np.full((2, 2), 0.15)
    holds, text = except_for(Ratios(value, small), {(1, 0), (1, 1)}, "T1")
    assert holds
    assert "T1 better in (2,1), (2,2), undecided in (1,2)" in text
    assert not except_for(Ratios(value, large), {(1, 0), (1, 1)}, "T1")[0]


@pytest.mark.parametrize("name", ["table-8.1", "table-8.3", "table-8.4", "figure-8.2"])
def test_items_are_complete(quick, name):
    made = registered()[name](quick)
    assert made.name == name
    assert all(isinstance(t, pd.DataFrame) and len(t) for t in made.tables.values())
    assert all(isinstance(f, Figure) for f in made.figures.values())


@pytest.mark.parametrize("name", ["figure-8.6", "figure-8.8", "figure-A.5", "figure-A.8"])
def test_figures_have_labels_and_numbers(quick, name):
    made = registered()[name](quick)
    numbers = made.tables[""]
    assert numbers["frequency_hz"].is_monotonic_increasing
    assert not np.isinf(numbers.to_numpy(float)).any()
    for axes in made.figures[""].axes[::3]:
        assert "[" in axes.get_ylabel()
    assert all("[Hz]" in a.get_xlabel() for a in made.figures[""].axes[-3:])


def test_a_single_realization_rules_no_averages(quick):
    """Quick runs average fewer realizations and say so."""
    made = registered()["figure-8.11"](quick)
    assert "of 4 realizations" in made.title


def test_same_seed_same_bits(quick):
    again = context(quick=True, threads=1)
    a, b = (experiments(c, DESIGNS[2]).estimate for c in (quick, again))
    assert a.tobytes() == b.tobytes()
    other = experiments(context(seed=1, quick=True), DESIGNS[2]).estimate
    assert not np.allclose(other, b)


def test_written_files(tmp_path):
    seen = []
    items = run("table-8.2", context(quick=True), tmp_path, lambda *state: seen.append(state))
    assert seen == [("table-8.2", 0, 1), ("done", 1, 1)]
    found = sorted(p.name for p in tmp_path.iterdir())
    assert found == [
        "claims.csv",
        "claims.json",
        "claims.md",
        "table-8.2-layout.csv",
        "table-8.2.csv",
    ]
    table = pd.read_csv(tmp_path / "table-8.2.csv")
    assert len(table) == 36
    assert items[0].claims[0].statement in (tmp_path / "claims.md").read_text()


def test_command(tmp_path):
    out = tmp_path / "out"
    result = CliRunner().invoke(app, ["reproduce", "table-8.1", "--quick", "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert (out / "table-8.1.csv").is_file()
    result = CliRunner().invoke(app, ["reproduce", "nothing", "--out", str(out)])
    assert result.exit_code == 2


def test_command_says_what_to_install_where_the_study_is_not(monkeypatch, tmp_path) -> None:
    monkeypatch.setitem(sys.modules, "axisight_thesis", None)
    result = CliRunner().invoke(app, ["reproduce", "table-8.1", "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "make setup" in result.stderr and "axisight[thesis]" in result.stderr


def test_study_is_found_where_it_was() -> None:
    from axisight import reproduce  # noqa: PLC0415

    assert reproduce.run is run
