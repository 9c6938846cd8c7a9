"""Key tables in pages, and the keys of the classes that read the files."""

import re
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo


def keys(model: type[BaseModel], *, leaves: tuple[type[BaseModel], ...] = ()) -> dict[str, str]:
    """Return the dotted keys of a file with their defaults as in a table; "" for a section of defaults.

    Classes in ``leaves`` have tables of their own.
    """
    found = {}
    for name, field in model.model_fields.items():
        key = field.alias or name
        found[key] = _default(field)
        for inner in _models(field.annotation):
            if not issubclass(inner, leaves):
                inside = keys(inner, leaves=leaves)
                found |= {f"{key}.{name}": default for name, default in inside.items()}
    return found


def told(section: str) -> dict[str, str]:
    """Return the keys in the first column of a section's tables, with the last column: their defaults."""
    rows = re.findall(r"^\| (`.*) \|$", section, flags=re.MULTILINE)
    cells = [re.split(r" ?(?<!\\)\| ?", row) for row in rows]
    names = [(re.findall(r"`\[*([\w.]+)\]*`", row[0]), row[-1]) for row in cells]
    pairs = [(key, default) for keys, default in names for key in keys]
    assert len(dict(pairs)) == len(pairs)
    return dict(pairs)


def same(said: dict[str, str], known: dict[str, str]) -> None:
    """Assert that the table has exactly these keys, with their defaults."""
    assert set(said) == set(known)
    assert {k: said[k] for k, v in known.items() if re.split("[;:]", said[k])[0] != v} == {}


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "needed"
    value = field.default
    if isinstance(value, BaseModel):
        return ""
    if value is None or value in ((), [], {}):
        return "none"
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, list):
        return f"`{value}`"
    return f"`{value:g}`".replace("e-0", "e-") if isinstance(value, float) else f"`{value}`"


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models(part)]
