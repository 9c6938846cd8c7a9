"""Write a posterior to a NetCDF file and read it again."""

from __future__ import annotations

import tempfile
from importlib import import_module
from pathlib import Path
from typing import Any

import xarray as xr

from axisight.arguments import instance, path_of
from axisight.errors import InputError, MissingExtraError
from axisight.posterior.data_tree import from_datatree, to_datatree
from axisight.posterior.result import Posterior
from axisight.storage import write_bytes

_ENGINE = "h5netcdf"


def check_library() -> None:
    """Raise MissingExtraError if the library for NetCDF files with groups is not installed."""
    try:
        import_module(_ENGINE)
    except ImportError as error:
        raise MissingExtraError(
            "NetCDF files with groups need h5netcdf: pip install 'axisight[posterior]'"
        ) from error


def save_posterior(
    posterior: Posterior,
    path: Path | str,
    *,
    chains: int = 4,
    draws: int = 1000,
    seed: int | None = None,
) -> Path:
    """Write a posterior as a NetCDF 4 file in the layout of ArviZ, and return its path.

    The file appears whole or not at all. ArviZ reads it by ``arviz.from_netcdf``, xarray by ``xarray.open_datatree``,
    and `load_posterior` without loss. ``chains``, ``draws`` and ``seed`` as in `to_datatree`. Raises OutputError for a
    path that cannot be written, and MissingExtraError without h5netcdf.
    """
    check_library()
    target = path_of("path", path)
    tree = to_datatree(
        instance("posterior", posterior, Posterior), chains=chains, draws=draws, seed=seed
    )
    squeezed: Any = {
        group: {name: {"zlib": True} for name, v in node.data_vars.items() if v.dtype.kind == "f"}
        for group, node in tree.to_dict().items()
    }
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "posterior.nc"
        tree.to_netcdf(made, engine="h5netcdf", encoding=squeezed)
        write_bytes(target, made.read_bytes())
    return target


def load_posterior(path: Path | str) -> Posterior:
    """Return the posterior that `save_posterior` wrote.

    Raises InputError for a file that is none, and MissingExtraError without h5netcdf.
    """
    check_library()
    source = path_of("path", path)
    try:
        with xr.open_datatree(source, engine=_ENGINE) as tree:
            return from_datatree(tree.load())
    except (OSError, KeyError, ValueError, TypeError, AttributeError) as error:
        if isinstance(error, InputError):
            raise InputError(f"{source}: {error}") from error
        raise InputError(f"{source}: expected a posterior of axisight: {error}") from error
