"""Write the signals of all logs as one Parquet table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import xarray as xr

from axisight.signal_files.about import about


def table(signals: Sequence[xr.Dataset]) -> bytes:
    """Return the bytes of a Parquet file with the signals of all logs, one log below the other."""
    made = pa.concat_tables([_of_log(data) for data in signals])
    made = made.replace_schema_metadata({"axisight": about(signals)})
    out = pa.BufferOutputStream()
    pq.write_table(made, out)
    return bytes(out.getvalue())


def _of_log(data: xr.Dataset) -> pa.Table:
    n = data.sizes["time_s"]
    columns = {
        key: pa.DictionaryArray.from_arrays(np.zeros(n, np.int32), [data.attrs[key]])
        for key in ("log", "role")
    }
    columns["time_s"] = pa.array(data["time_s"].values)
    for name in data.data_vars:
        for i, axis in enumerate(data["axis"].values):
            columns[f"{name}_{axis}"] = pa.array(data[name].values[:, i])
    return pa.table(columns)
