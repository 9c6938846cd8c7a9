"""Write a randomization document as YAML or JSON, and read it again."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from axisight.arguments import instance, path_of
from axisight.documents import parse_json, read_text
from axisight.errors import InputError, MissingExtraError
from axisight.posterior.randomization.document import RandomizationDocument
from axisight.storage import write_whole

SUFFIXES = (".yaml", ".yml", ".json")
"""Endings of the files."""


def save_randomization(document: RandomizationDocument, path: Path | str) -> Path:
    """Write a document as YAML (``.yaml``, ``.yml``) or JSON (``.json``), and return its path.

    The file appears whole or not at all. Raises InputError for another ending, and OutputError for a file that cannot
    be written.
    """
    known = instance("document", document, RandomizationDocument)
    target = path_of("path", path)
    if target.suffix not in SUFFIXES:
        raise InputError(f"{target}: expected a name ending in {', '.join(SUFFIXES)}")
    content = known.model_dump(by_alias=True)
    plain = json.dumps(content, indent=2, ensure_ascii=False) + "\n"
    write_whole(target, plain if target.suffix == ".json" else to_yaml(content))
    return target


def load_randomization(path: Path | str) -> RandomizationDocument:
    """Return the document that `save_randomization` wrote.

    Raises InputError, naming file and key, for a file that is none; MissingExtraError for YAML without PyYAML.
    """
    source = path_of("path", path)
    try:
        text = read_text(source)
        content = parse_json(text) if source.suffix == ".json" else _yaml(text, source)
        return RandomizationDocument.model_validate(content)
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(map(str, fault["loc"])) or "document"
        raise InputError(f"{source}: {where}: {fault['msg']}") from None
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{source}: expected a randomization document: {error}") from None


def _yaml(text: str, source: Path) -> Any:
    try:
        yaml = import_module("yaml")
    except ImportError as error:
        raise MissingExtraError(
            f"{source}: YAML files need PyYAML: pip install 'axisight[posterior]', or write .json"
        ) from error
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise InputError(f"{source}: expected YAML: {error}") from None


def to_yaml(content: Mapping[str, Any], indent: str = "") -> str:
    """Return a mapping of plain values as YAML: a key a line, lists of numbers and words in brackets."""
    lines = []
    for key, value in content.items():
        name = f"{indent}{key if key.isidentifier() else _scalar(key)}:"
        if isinstance(value, Mapping) and value:
            lines.append(f"{name}\n{to_yaml(value, indent + '  ')}")
        elif _is_block(value):
            lines.append(f"{name}\n{''.join(_item(one, indent + '  ') for one in value)}")
        else:
            lines.append(f"{name} {_flow(value)}\n")
    return "".join(lines)


def _is_block(value: object) -> bool:
    return isinstance(value, Sequence) and bool(value) and isinstance(value[0], (Mapping, list))


def _item(value: Any, indent: str) -> str:
    if not isinstance(value, Mapping):
        return f"{indent}- {_flow(value)}\n"
    return f"{indent}- {to_yaml(value, indent + '  ').lstrip()}"


def _flow(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{}"
    if isinstance(value, list):
        return f"[{', '.join(_flow(one) for one in value)}]"
    return _scalar(value)


def _scalar(value: object) -> str:
    """Return a scalar. YAML 1.1 takes 1e-08 for text, and yes and no for truth values."""
    if isinstance(value, float):
        digits, mark, power = repr(value).partition("e")
        point = digits if "." in digits or not mark else f"{digits}.0"
        return f"{point}e{power if power[0] in '+-' else '+' + power}" if mark else point
    return json.dumps(value, ensure_ascii=False)
