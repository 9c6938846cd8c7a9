"""As much of torch as randomisation code uses, on NumPy arrays."""

import sys
from types import ModuleType

import numpy as np


class Tensor(np.ndarray):
    """An array with the methods of a tensor that the code calls."""

    def to(self, _device):
        return self

    def cpu(self):
        return self

    def long(self):
        return self.astype(np.int64)

    def clone(self):
        return self.copy()

    def clamp(self, low, high):
        return np.clip(self, low, high).view(Tensor)


def tensor(values, device=None):
    del device
    return np.asarray(values).view(Tensor)


def module() -> ModuleType:
    """Return a module ``torch`` with a fixed seed."""
    rng = np.random.default_rng(7)
    torch = ModuleType("torch")
    torch.tensor = tensor
    torch.arange = lambda n, device=None: tensor(np.arange(n))
    torch.ones = lambda n, device=None: tensor(np.ones(n))
    torch.randn = lambda *shape, device=None: tensor(rng.standard_normal(shape))
    torch.stack = lambda rows, dim: np.stack(rows, axis=dim).view(Tensor)
    torch.multinomial = lambda weights, n, replacement: tensor(
        rng.choice(len(weights), n, p=np.asarray(weights) / np.sum(weights))
    )
    return torch


def installed(monkeypatch, names: dict[str, dict[str, object]]) -> None:
    """Put a fake torch, and modules with the given attributes, in the place of those of a project."""
    modules = {"torch": module()}
    for name, attributes in names.items():
        parts = name.split(".")
        for k in range(1, len(parts) + 1):
            modules.setdefault(".".join(parts[:k]), ModuleType(".".join(parts[:k])))
        for key, value in attributes.items():
            setattr(modules[name], key, value)
    for name, one in modules.items():
        monkeypatch.setitem(sys.modules, name, one)
