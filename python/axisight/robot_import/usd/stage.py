"""Open USD stages with usd-core, without layers outside the folder of the model."""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from typing import Any

from axisight.arguments import shown
from axisight.errors import MissingExtraError, RobotError
from axisight.robot_import.usd.attributes import Units

_MOST_LAYERS = 200


def pxr(name: str) -> Any:
    """Return a module of usd-core; raise MissingExtraError if it is not installed."""
    try:
        return import_module(f"pxr.{name}")
    except ImportError as error:
        raise MissingExtraError("USD is read by usd-core: pip install 'axisight[usd]'") from error


def open_stage(path: Path) -> Any:
    """Return the stage of a file, all payloads loaded.

    Raises RobotError for a file that is no USD, and for layers outside its folder.
    """
    usd, tf = pxr("Usd"), pxr("Tf")
    try:
        check_layers(path)
        return usd.Stage.Open(str(path))
    except tf.ErrorException as error:
        told = " ".join(str(error).split())
        raise RobotError(f"{path}: expected a USD stage that can be composed: {told}") from None


def check_layers(path: Path) -> None:
    """Raise RobotError for a layer (reference, payload, sublayer) outside the folder of ``path``.

    Layers are opened one by one, so nothing outside the folder is opened.
    """
    sdf = pxr("Sdf")
    folder = path.resolve().parent
    todo, seen = [path.resolve()], set()
    while todo:
        here = todo.pop()
        if here in seen:
            continue
        seen.add(here)
        if len(seen) > _MOST_LAYERS:
            raise RobotError(f"{path}: expected at most {_MOST_LAYERS} layers")
        layer = sdf.Layer.FindOrOpen(str(here)) if here.is_file() else None
        if layer is None:
            raise RobotError(f"{path}: expected a readable USD layer {shown(here.name)}")
        # Another stage in this process may hold the layer as the file was before.
        if not layer.dirty:
            layer.Reload()
        if here.suffix.lower() == ".usdz":
            # A package holds its layers itself.
            continue
        for name in layer.GetCompositionAssetDependencies():
            todo.append(_inside(path, here, name, folder))


def _inside(path: Path, layer: Path, name: str, folder: Path) -> Path:
    """Return the file of a layer that another layer names; raise RobotError if it is outside the folder."""
    target = Path(os.path.normpath(layer.parent / name)).resolve()
    if "://" in name or Path(name).is_absolute() or not target.is_relative_to(folder):
        raise RobotError(
            f"{path}, layer {shown(layer.name)}: expected layers inside the folder of the model, got "
            f"{shown(name)}: nothing outside is read; copy it beside the model, or flatten the stage (usdcat "
            f"--flatten)"
        )
    return target


def units_of(stage: Any) -> Units:
    """Return the units of a stage; USD's defaults are centimetres, kilograms and y up."""
    geometry, physics = pxr("UsdGeom"), pxr("UsdPhysics")
    return Units(
        float(geometry.GetStageMetersPerUnit(stage)),
        float(physics.GetStageKilogramsPerUnit(stage)),
        str(geometry.GetStageUpAxis(stage)),
    )
