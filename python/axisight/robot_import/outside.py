"""Refuse MJCF files that refer to files outside their folder."""

from __future__ import annotations

import os
from pathlib import Path

from axisight.arguments import shown
from axisight.errors import RobotError
from axisight.robot_import.xml_tree import Element, read_xml

# Attributes of <compiler> that name folders of other files.
_FOLDERS = ("meshdir", "texturedir", "assetdir")
# Attributes that name files; the last six are the sides of a cube texture.
_FILES = ("file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback")
_DEEPEST = 20


def with_includes(root: Element, path: Path) -> list[Element]:
    """Return the root element of a model file and those of all included files, depth first.

    Raises RobotError, with the line, for a file outside the folder of ``path``, for a file that includes
    itself, and as `read_xml`.
    """
    folder = path.resolve().parent
    return _checked(root, path, folder, [])


def _checked(root: Element, path: Path, folder: Path, above: list[Path]) -> list[Element]:
    here = [*above, path.resolve()]
    if len(here) > _DEEPEST:
        raise RobotError(f"{root.where}: expected at most {_DEEPEST} files in one another")
    found = [root]
    folders = [e for e in root.walk() if e.tag == "compiler"]
    prefixes = [""] + [e.attributes[k] for e in folders for k in _FOLDERS if k in e.attributes]
    for element in folders:
        for key in _FOLDERS:
            if key in element.attributes:
                _inside(element, key, element.attributes[key], folder)
    for element in root.walk():
        for key in _FILES:
            name = element.attributes.get(key, "")
            if name:
                for prefix in prefixes:
                    _inside(element, key, os.path.join(prefix, name), folder)  # noqa: PTH118
        if element.tag == "include":
            included = folder / element.require("file", "a file to include")
            if included.resolve() in here:
                raise RobotError(
                    f"{element.where}: expected another file, got one that includes itself"
                )
            if not included.is_file():
                raise RobotError(
                    f"{element.where}: file: expected a file, got {shown(included.name)}"
                )
            found += _checked(read_xml(included), included, folder, here)
    return found


def _inside(element: Element, key: str, name: str, folder: Path) -> None:
    """Raise RobotError unless a name, with links followed, leads to a place inside a folder."""
    target = (folder / name).resolve()
    if Path(name).is_absolute() or not target.is_relative_to(folder):
        raise RobotError(
            f"{element.where}: {key}: expected a path inside the folder of the model, got {shown(name)}: "
            f"nothing outside is read; copy it beside the model"
        )
