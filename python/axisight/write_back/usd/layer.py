"""A USD layer over a stage: it holds only changed attributes, and the stage stays as it is."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

from axisight import storage
from axisight.robot_import.usd.stage import pxr

_OWN = ("subLayers", "subLayerOffsets")


class Overlay:
    """A new layer at ``target`` whose only sublayer is the file ``source`` of a stage."""

    def __init__(self, stage: Any, source: Path, target: Path) -> None:
        self._sdf = pxr("Sdf")
        self.target = target
        self._layer = self._sdf.Layer.CreateAnonymous(".usda")
        # A stage takes its units and its default prim from the strongest layer only.
        root = stage.GetRootLayer().pseudoRoot
        for key in root.ListInfoKeys():
            if key not in _OWN:
                self._layer.pseudoRoot.SetInfo(key, root.GetInfo(key))
        below = os.path.relpath(source.resolve(), target.resolve().parent)
        self._layer.subLayerPaths.append(f"./{Path(below).as_posix()}")

    def set(self, prim: Any, name: str, value: Any, kind: str, comment: str = "") -> None:
        """Set an attribute of a prim, with a comment as its documentation.

        ``kind``: type of the attribute, unless the stage has another.
        """
        there = prim.GetAttribute(name)
        types = self._sdf.ValueTypeNames.Find(kind) if not there else there.GetTypeName()
        over = self._over(prim)
        spec = over.attributes.get(name) or self._sdf.AttributeSpec(over, name, types)
        spec.default = types.type.pythonClass(value) if types.type.pythonClass else value
        if comment:
            spec.documentation = comment

    def apply(self, prim: Any, schema: str) -> None:
        """Apply an API schema to a prim, unless the prim has it."""
        if schema in prim.GetPrimTypeInfo().GetAppliedAPISchemas():
            return
        over = self._over(prim)
        known = over.GetInfo("apiSchemas") if over.HasInfo("apiSchemas") else None
        items = [] if known is None else list(known.prependedItems)
        if schema not in items:
            found = self._sdf.TokenListOp()
            found.prependedItems = [*items, schema]
            over.SetInfo("apiSchemas", found)

    def write(self) -> None:
        """Write the layer, as text or binary by the suffix of the target."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / self.target.name
            self._layer.Export(str(path))
            storage.write_bytes(self.target, path.read_bytes())

    def _over(self, prim: Any) -> Any:
        return self._sdf.CreatePrimInLayer(self._layer, prim.GetPath())


def cannot_change(prim: Any) -> str:
    """Return why a layer cannot change a prim; empty if it can."""
    return "it stands in an instance" if prim.IsInstanceProxy() or prim.IsInPrototype() else ""
