"""A posterior as an xarray DataTree in the layout of ArviZ, and back."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.arguments import seed_of, whole
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.posterior.between_runs import BetweenRuns
from axisight.posterior.parameter import DrivenAxis, PosteriorParameter, Prior, Simulated
from axisight.posterior.result import Posterior, PosteriorHypothesis

Array = NDArray[np.float64]

SCHEMA = "axisight.posterior/1"
"""Name of the layout of the group ``gaussian``, from which a posterior is read again."""

# Keeps the samples of the prior apart from those of the posterior with the same seed.
_PRIOR_STREAM = 0x707269
BAND = ("predicted_torque_nm", "low_torque_nm", "high_torque_nm")
"""Centre and ends of the band that holds 95 % of measured torque."""

_DIMS = ("chain", "draw")


def to_datatree(
    posterior: Posterior, *, chains: int = 4, draws: int = 1000, seed: int | None = None
) -> xr.DataTree:
    """Return a posterior as a DataTree, which ArviZ 1 takes as it is.

    | group | content |
    |---|---|
    | ``posterior`` | samples (chain, draw) of every parameter; independent, so that chains differ by chance only |
    | ``sample_stats`` | ``hypothesis`` of each sample, from 0 |
    | ``prior`` | samples before the logs: tolerances of own parameters, sizes of causes over machines |
    | ``observed_data`` | measured torque of each validation log [Nm, N] |
    | ``posterior_predictive`` | simulated torque (chain, draw, time, axis) with noise |
    | ``gaussian`` | mean and covariance of each hypothesis, variation between runs |

    ``chains``, ``draws``: shape of the samples. ``seed``: by default that of the diagnosis. Raises InputError for a
    number that is not whole and positive.
    """
    count, length = whole("chains", chains), whole("draws", draws)
    used = posterior.seed if seed is None else seed_of("seed", seed)
    drawn = posterior.samples(count * length, seed=used)
    coords = {"chain": np.arange(count), "draw": np.arange(length)}

    def shaped(values: Array, unit: str) -> tuple[tuple[str, str], Array, dict[str, str]]:
        return _DIMS, values.reshape(count, length), {"units": unit}

    samples = {p.name: shaped(drawn[p.name].values, p.unit) for p in posterior.parameters}
    before = {
        p.name: shaped(x, p.unit)
        for p, x in zip(posterior.parameters, _prior(posterior, used, count * length), strict=True)
    }
    which = {"hypothesis": (_DIMS, drawn.hypothesis.values.reshape(count, length))}
    groups = {
        "posterior": xr.Dataset(samples, coords, _origin(posterior)),
        "sample_stats": xr.Dataset(which, coords, {"causes": _causes(posterior)}),
        "prior": xr.Dataset(before, coords, _origin(posterior)),
        "gaussian": _gaussian(posterior),
        **_held_out(posterior),
    }
    tree = xr.DataTree.from_dict(groups)
    tree.attrs.update(_origin(posterior))
    return tree


def from_datatree(tree: xr.DataTree) -> Posterior:
    """Return the posterior that `to_datatree` wrote; raises InputError for a tree without one."""
    try:
        group = tree["gaussian"].to_dataset()
        if group.attrs.get("schema") != SCHEMA:
            raise InputError(f"tree: expected {SCHEMA}, got {group.attrs.get('schema')!r}")
        return _read(tree, group, json.loads(group.attrs["description"]))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"tree: expected a posterior of axisight: {error}") from error


def _prior(posterior: Posterior, seed: int, number: int) -> list[Array]:
    """Return samples (n,) of each parameter before the logs."""
    out = []
    for k, p in enumerate(posterior.parameters):
        rng = np.random.default_rng([seed, _PRIOR_STREAM, k])
        out.append(p.prior.at(rng.random(number), p.lower, p.upper))
    return out


def _origin(posterior: Posterior) -> dict[str, Any]:
    # No time of creation: the same diagnosis gives the same bytes.
    return {
        "creation_library": "axisight",
        "creation_library_version": posterior.version,
        "inference_library": "axisight",
        "inference_library_version": posterior.version,
        "sampling": "independent draws of a mixture of Gaussians",
    }


def _causes(posterior: Posterior) -> str:
    return "; ".join(" + ".join(h.causes) or "no cause" for h in posterior.hypotheses)


def _gaussian(posterior: Posterior) -> xr.Dataset:
    """Return means and covariances over all parameters, NaN for those that a hypothesis lacks."""
    names, count = list(posterior.names), len(posterior.hypotheses)
    mean = np.full((count, len(names)), np.nan)
    formula = np.full((count, len(names)), np.nan)
    covariance = np.full((count, len(names), len(names)), np.nan)
    for k, one in enumerate(posterior.hypotheses):
        place = [names.index(n) for n in one.names]
        mean[k, place], formula[k, place] = one.mean, one.formula_std
        covariance[k][np.ix_(place, place)] = one.covariance
    by = ("hypothesis", "parameter")
    return xr.Dataset(
        {
            "value": (by, mean),
            "formula_std": (by, formula),
            "covariance": ((*by, "other"), covariance),
            "weight": ("hypothesis", [h.weight for h in posterior.hypotheses]),
        },
        coords={
            "hypothesis": np.arange(count),
            "parameter": names,
            "other": names,
            "unit": ("parameter", [p.unit for p in posterior.parameters]),
        },
        attrs={"schema": SCHEMA, "description": json.dumps(_described(posterior))},
    )


def _described(posterior: Posterior) -> dict[str, Any]:
    """Return everything of a posterior that is no array, as plain values."""
    return {
        "name": posterior.name,
        "verdict": posterior.verdict,
        "seed": posterior.seed,
        "version": posterior.version,
        "simulated": asdict(posterior.simulated),
        "parameters": [asdict(p) for p in posterior.parameters],
        "effects": [[_plain(e) for e in h.effects] for h in posterior.hypotheses],
        "between_runs": [
            {**asdict(x), "by_log": [None if np.isnan(v) else v for v in x.by_log]}
            for x in posterior.between_runs
        ],
        "bootstrap_std": dict(posterior.bootstrap_std),
        "without_values": dict(posterior.without_values),
        "logs": [one.attrs["log"] for one in posterior.held_out],
    }


def _plain(effect: Effect) -> dict[str, Any]:
    values = dict(effect.parameters or {})
    return {"name": effect.name, "axis": effect.axis, "axes": effect.axes, "values": values}


def _held_out(posterior: Posterior) -> dict[str, xr.Dataset]:
    """Return the groups of the validation logs; every log has a time of its own."""
    if not posterior.held_out:
        return {}
    seen: dict[str, xr.DataArray] = {}
    drawn: dict[str, xr.DataArray] = {}
    band: dict[str, xr.DataArray] = {}
    for one in posterior.held_out:
        name, time = f"torque_{one.attrs['log']}", f"time_s_{one.attrs['log']}"
        renamed = one.rename({"time_s": time})
        seen[name] = renamed["measured_torque_nm"]
        drawn[name] = renamed["simulated_torque_nm"].expand_dims("chain")
        band |= {f"{part}_{one.attrs['log']}": renamed[part] for part in BAND}
        for group in (seen, drawn):
            group[name].attrs.update(one.attrs)
    origin = _origin(posterior)
    return {
        "observed_data": xr.Dataset(seen, attrs=origin),
        "posterior_predictive": xr.Dataset(drawn, attrs=origin),
        "held_out_band": xr.Dataset(band),
    }


def _read(tree: xr.DataTree, group: xr.Dataset, told: Mapping[str, Any]) -> Posterior:
    parameters = tuple(_parameter(p) for p in told["parameters"])
    names = [p.name for p in parameters]
    hypotheses = []
    for k, effects in enumerate(told["effects"]):
        mean = group["value"].values[k]
        used = np.flatnonzero(np.isfinite(mean))
        hypotheses.append(
            PosteriorHypothesis(
                tuple(Effect(e["name"], e["axis"], e["values"], _pair(e["axes"])) for e in effects),
                float(group["weight"].values[k]),
                tuple(names[i] for i in used),
                mean[used],
                group["covariance"].values[k][np.ix_(used, used)],
                group["formula_std"].values[k][used],
            )
        )
    simulated = told["simulated"]
    return Posterior(
        told["name"],
        told["verdict"],
        Simulated(
            simulated["robot"],
            simulated["controller"],
            tuple(DrivenAxis(**axis) for axis in simulated["axes"]),
            simulated["nominal"],
        ),
        parameters,
        tuple(hypotheses),
        tuple(_variation(x) for x in told["between_runs"]),
        told["bootstrap_std"],
        tuple(_log(tree, log) for log in told["logs"]),
        told["without_values"],
        told["seed"],
        told["version"],
    )


def _parameter(row: Mapping[str, Any]) -> PosteriorParameter:
    changes = row["changes"]
    return PosteriorParameter(
        **{
            **row,
            "prior": Prior(**row["prior"]),
            "axes": _pair(row["axes"]),
            "changes": None if changes is None else tuple(changes),
        }
    )


def _variation(row: Mapping[str, Any]) -> BetweenRuns:
    by_log = tuple(np.nan if v is None else v for v in row["by_log"])
    return BetweenRuns(**{**row, "by_log": by_log})


def _pair(axes: Any) -> tuple[int, int] | None:
    return None if axes is None else (axes[0], axes[1])


def _log(tree: xr.DataTree, log: str) -> xr.Dataset:
    name, time = f"torque_{log}", f"time_s_{log}"
    band = tree["held_out_band"].to_dataset()
    drawn = tree["posterior_predictive"].to_dataset()[name]
    found = xr.Dataset(
        {
            "measured_torque_nm": tree["observed_data"].to_dataset()[name],
            "simulated_torque_nm": drawn.isel(chain=0, drop=True),
            **{part: band[f"{part}_{log}"] for part in BAND},
        }
    )
    return found.rename({time: "time_s"}).assign_attrs(drawn.attrs)
