"""The output files of ``axisight frf``: the response as NetCDF, and its picture."""

from __future__ import annotations

import io
import json
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from axisight.cli.common import say
from axisight.cli.identify_common import provenance
from axisight.errors import InputError
from axisight.frf.interop import save_netcdf
from axisight.responses import LogResponse, plot_levels
from axisight.storage import check_targets, write_bytes

_PICTURES = (".png", ".pdf", ".svg")


@dataclass(frozen=True)
class Targets:
    """The requested files, None for options not given."""

    out: Path | None
    plot: Path | None

    def check(self, inputs: Iterable[Path], *, force: bool) -> None:
        """Raise OutputError or InputError, naming the option, for files that could not be written."""
        if self.out is not None and self.out.suffix != ".nc":
            raise InputError(f"--out: expected a name ending in .nc, got {self.out}")
        if self.plot is not None and self.plot.suffix not in _PICTURES:
            raise InputError(
                f"--plot: expected a name ending in {', '.join(_PICTURES)}, got {self.plot}"
            )
        check_targets(
            {"--out": self.out, "--plot": self.plot},
            inputs=inputs,
            replaces={"--out": (".nc",), "--plot": _PICTURES},
            force=force,
        )


def write_response(
    found: LogResponse,
    out: Path,
    inputs: Sequence[Path],
    columns: Path | None,
    settings: Mapping[str, Any],
) -> None:
    """Write the response; its attribute ``provenance`` is JSON with options and SHA-256 of all inputs."""
    source = provenance("frf", inputs, settings, columns, command="axisight")
    said = {
        "method": source.method,
        "data": dict(source.data),
        "settings": dict(source.settings),
        "choices": list(found.choices),
        "findings": [str(finding) for finding in found.findings],
    }
    response = found.response.assign_attrs(provenance=json.dumps(said))
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "response.nc"
        save_netcdf(response, made)
        write_bytes(out, made.read_bytes())
    say(f"written: {out}")


def write_figure(found: LogResponse, path: Path) -> None:
    """Draw magnitudes with noise and distortion."""
    drawn = io.BytesIO()
    plot_levels(found.response).savefig(drawn, dpi=200, format=path.suffix.removeprefix("."))
    write_bytes(path, drawn.getvalue())
    say(f"written: {path}")
