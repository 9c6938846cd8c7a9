"""A posterior as a DataTree and a NetCDF file, as ArviZ and xarray read it."""

import importlib

import numpy as np
import pytest
import xarray as xr

from axisight.errors import InputError, MissingExtraError, OutputError
from axisight.posterior import files as module
from axisight.posterior import from_datatree, load_posterior, save_posterior, to_datatree
from posterior_data import COULOMB, MASS, VISCOUS, one_hypothesis, two_hypotheses


def same(one, other):
    assert one.parameters == other.parameters
    assert one.simulated == other.simulated
    assert one.without_values == other.without_values
    assert [repr(x) for x in one.between_runs] == [repr(x) for x in other.between_runs]
    for mine, theirs in zip(one.hypotheses, other.hypotheses, strict=True):
        assert (mine.effects, mine.names, mine.weight) == (
            theirs.effects,
            theirs.names,
            theirs.weight,
        )
        for field in ("mean", "covariance", "formula_std"):
            assert np.array_equal(getattr(mine, field), getattr(theirs, field))
    assert one.samples(5).identical(other.samples(5))
    for mine, theirs in zip(one.held_out, other.held_out, strict=True):
        xr.testing.assert_allclose(mine, theirs)
        assert mine.attrs.keys() == theirs.attrs.keys()


@pytest.mark.parametrize("made", [one_hypothesis, two_hypotheses])
def test_nothing_is_lost(tmp_path, made):
    found = made()
    same(found, from_datatree(to_datatree(found, chains=2, draws=5)))
    path = save_posterior(found, tmp_path / "verdict.nc", chains=2, draws=5)
    same(found, load_posterior(path))


def test_the_groups_are_those_of_arviz():
    found = two_hypotheses()
    tree = to_datatree(found, chains=4, draws=25)
    assert {"posterior", "prior", "sample_stats", "observed_data", "posterior_predictive"} <= set(
        tree.children
    )
    samples = tree["posterior"].to_dataset()
    assert samples[COULOMB].dims == ("chain", "draw") and samples[COULOMB].shape == (4, 25)
    assert samples[COULOMB].attrs["units"] == "Nm"
    assert set(samples.data_vars) == set(found.names) == set(tree["prior"].to_dataset().data_vars)
    # Row by row, they are the runs of `samples`.
    assert np.array_equal(samples[COULOMB].values.ravel(), found.samples(100)[COULOMB].values)
    assert tree["posterior_predictive"]["torque_fresh"].dims[:2] == ("chain", "draw")
    assert tree["observed_data"]["torque_fresh"].dims == ("time_s_fresh", "axis")
    assert samples.attrs["inference_library"] == "axisight"


def test_prior_samples_are_those_of_the_tolerances():
    found = one_hypothesis()
    before = to_datatree(found, chains=4, draws=2500)["prior"][MASS].values
    # Tolerance 2 % of 500 kg; four standard errors.
    assert before.mean() == pytest.approx(500, abs=4 * 10 / 100)
    assert before.std() == pytest.approx(10, rel=4 / 20_000**0.5)


def test_the_same_posterior_gives_the_same_bytes(tmp_path):
    paths = [save_posterior(one_hypothesis(), tmp_path / f"{k}.nc", draws=10) for k in range(2)]
    assert paths[0].read_bytes() == paths[1].read_bytes()


# The classic ArviZ announces its successor, which takes the DataTree as it is.
@pytest.mark.filterwarnings("ignore::FutureWarning", "ignore::UserWarning")
def test_arviz_reads_it(tmp_path):
    arviz = pytest.importorskip("arviz", exc_type=ImportError)
    path = save_posterior(one_hypothesis(), tmp_path / "verdict.nc", draws=500)
    read = arviz.from_netcdf(path)
    summary = arviz.summary(read, var_names=[VISCOUS, COULOMB], round_to="none")
    known = one_hypothesis().gaussian()
    for name in (VISCOUS, COULOMB):
        one = known.sel(parameter=name)
        # Independent draws: four standard errors of 2,000, and chains that agree.
        assert summary.loc[name, "mean"] == pytest.approx(
            float(one.value), abs=4 * float(one.deviation) / 2000**0.5
        )
        assert summary.loc[name, "sd"] == pytest.approx(float(one.deviation), rel=4 / 4000**0.5)
        assert summary.loc[name, "r_hat"] < 1.01


def test_files_that_are_none(tmp_path):
    other = tmp_path / "other.nc"
    xr.Dataset({"x": ("n", [1.0])}).to_netcdf(other, engine="h5netcdf")
    with pytest.raises(InputError, match=r"other\.nc: tree: expected a posterior of axisight"):
        load_posterior(other)
    (tmp_path / "text.nc").write_text("no")
    with pytest.raises(InputError, match=r"text\.nc: expected a posterior of axisight"):
        load_posterior(tmp_path / "text.nc")
    with pytest.raises(InputError, match=r"gone\.nc"):
        load_posterior(tmp_path / "gone.nc")
    with pytest.raises(OutputError):
        save_posterior(one_hypothesis(), tmp_path)


def test_a_missing_library_is_named(tmp_path, monkeypatch):
    def missing(name):
        if name == "h5netcdf":
            raise ImportError(name)
        return importlib.import_module(name)

    monkeypatch.setattr(module, "import_module", missing)
    with pytest.raises(MissingExtraError, match=r"pip install 'axisight\[posterior\]'"):
        save_posterior(one_hypothesis(), tmp_path / "verdict.nc")
