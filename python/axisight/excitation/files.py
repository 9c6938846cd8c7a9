"""Files of references, with samples and design."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import scipy

from axisight.arguments import instance, path_of, short, shown
from axisight.documents import parse_json, read_text
from axisight.errors import InputError, LogError
from axisight.excitation.references import References
from axisight.logs.budget import Budget
from axisight.logs.columns import CsvOptions
from axisight.logs.sources import load_arrays
from axisight.logs.sources_csv import load_csv
from axisight.storage import write_bytes

_SCHEMA = "axisight.excitation/1"
_KEY = b"axisight.excitation"
_KINDS = (".csv", ".mat", ".parquet")


def write_references(reference: References, path: Path | str) -> list[Path]:
    """Write one period of every experiment with its design, and return the files written.

    The ending of ``path`` sets the format:

    - ``.csv`` and ``.parquet`` have columns ``experiment`` (from 1), ``time_s`` and
      ``velocity_ref_1``, ... (``input_1``, ... for a unit other than rad/s)
    - ``.mat`` has ``period`` (n_experiments, n_samples, n_inputs) and ``sample_time_s``

    The design is JSON, in ``NAME.design.json`` next to a CSV file, in the variable ``design`` of a MAT
    file, or in the metadata of a Parquet file. Numbers keep full precision. Raises InputError for
    another ending, and OutputError for a file that cannot be written.
    """
    instance("reference", reference, References)
    target = _known(path)
    text = json.dumps(_design(reference), indent=1)
    files = {target: _bytes(reference, text, target.suffix)}
    if target.suffix == ".csv":
        files[_beside(target)] = text.encode()
    for name, data in files.items():
        write_bytes(name, data)
    return list(files)


def reference_files(path: Path | str) -> list[Path]:
    """Return the files that `write_references` writes; raises InputError for another ending."""
    target = _known(path)
    return [target, _beside(target)] if target.suffix == ".csv" else [target]


def _bytes(reference: References, text: str, kind: str) -> bytes:
    buffer = io.BytesIO()
    if kind == ".mat":
        content = {
            "period": reference.period,
            "sample_time_s": reference.sample_time_s,
            "lines": reference.lines,
            "detection_lines": reference.detection_lines,
            "design": text,
        }
        scipy.io.savemat(cast(Any, buffer), content, do_compression=True)
    elif kind == ".parquet":
        arrow = pa.Table.from_pandas(_table(reference), preserve_index=False)
        arrow = arrow.replace_schema_metadata({**(arrow.schema.metadata or {}), _KEY: text})
        pq.write_table(arrow, buffer)
    else:
        # pandas writes the shortest text that reads back as the same number.
        buffer.write(_table(reference).to_csv(index=False).encode())
    return buffer.getvalue()


def holds_references(path: Path | str) -> bool:
    """Return whether :func:`write_references` wrote a file, recognized by its design."""
    source = path_of("path", path)
    if source.suffix == ".csv":
        return _beside(source).exists()
    try:
        if source.suffix == ".parquet":
            return _KEY in (pq.read_schema(source).metadata or {})
        return source.suffix == ".mat" and "design" in load_arrays(source)
    except (OSError, pa.ArrowException, LogError):
        return False


def read_references(path: Path | str) -> References:
    """Return the references that :func:`write_references` wrote to ``path``.

    Raises InputError naming file and field.
    """
    source = _known(path)
    try:
        text, period = _content(source)
        design = parse_json(text)
        if design["schema"] != _SCHEMA:
            raise InputError(f"{source}: schema: expected {_SCHEMA}, got {shown(design['schema'])}")
        period = period.reshape(design["shape"])
        return References(
            sample_time_s=design["sample_time_s"],
            period=period,
            lines=np.array(design["lines"], np.int64),
            detection_lines=np.array(design["detection_lines"], np.int64),
            unit=design["unit"],
            design=design["design"],
        )
    except LogError as error:
        raise InputError(f"{source}: expected references with their design: {error}") from None
    except InputError:
        raise
    except Exception as e:  # readers raise exceptions of many types for damaged files
        raise InputError(
            f"{source}: expected references with their design: {short(repr(e), 200)}"
        ) from None


def _design(reference: References) -> dict[str, Any]:
    return {
        "schema": _SCHEMA,
        "sample_time_s": reference.sample_time_s,
        "shape": list(reference.period.shape),
        "unit": reference.unit,
        "lines": reference.lines.tolist(),
        "detection_lines": reference.detection_lines.tolist(),
        "design": reference.design,
    }


def _content(source: Path) -> tuple[str, np.ndarray[Any, np.dtype[np.float64]]]:
    """Return the design and the samples in the order (experiment, sample, input)."""
    if source.suffix == ".mat":
        content = load_arrays(source)
        return str(content["design"].item()), np.asarray(content["period"], np.float64)
    if source.suffix == ".parquet":
        text = (pq.read_schema(source).metadata or {})[_KEY].decode()
        arrays = load_arrays(source)
        columns = [arrays[name] for name in list(arrays)[2:]]
        return text, np.column_stack(columns).astype(np.float64)
    text = read_text(_beside(source))
    budget = Budget()
    budget.grow([source])
    table = load_csv(source, budget, CsvOptions(), exact=True)
    return text, np.column_stack([table[name] for name in list(table)[2:]]).astype(np.float64)


def _table(reference: References) -> pd.DataFrame:
    e, n, inputs = reference.period.shape
    stem = "velocity_ref" if reference.unit == "rad/s" else "input"
    columns = {
        "experiment": np.repeat(np.arange(1, e + 1), n),
        "time_s": np.tile(np.arange(n) * reference.sample_time_s, e),
    }
    flat = reference.period.reshape(-1, inputs)
    return pd.DataFrame({**columns, **{f"{stem}_{i + 1}": flat[:, i] for i in range(inputs)}})


def _known(path: Path | str) -> Path:
    target = path_of("path", path)
    if target.suffix not in _KINDS:
        raise InputError(f"{target}: expected a name ending in {', '.join(_KINDS)}")
    return target


def _beside(path: Path) -> Path:
    return path.with_name(path.stem + ".design.json")
