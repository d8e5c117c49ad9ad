"""Torch modules as plain numbers in a file, and back: nothing in it is a program."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch
from torch import nn

from train._alike import require_alike
from wifipgo.errors import require
from wifipgo.files.atomic_files import appearing
from wifipgo.files.npz_files import read_npz


def save_modules(path: Path, modules: Mapping[str, nn.Module]) -> None:
    """Write parameters and buffers to a file that is there whole or not at all."""
    arrays = {name: tensor.numpy() for name, tensor in _tensors(modules).items()}
    with appearing(path) as unfinished, unfinished.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


@torch.no_grad()
def load_modules(path: Path, modules: Mapping[str, nn.Module]) -> None:
    """Put in place what `save_modules` wrote of modules that are made alike.

    Raises:
        BadInputError: Not such a file, or an array is missing, too many, of another shape or type, or not
            finite; names it. Nothing has changed then.
        OSError: The file cannot be read.
    """
    arrays, tensors = read_npz(path), _tensors(modules)
    require(arrays.keys() == tensors.keys(), f"{path}", f"with the arrays {sorted(tensors)}", sorted(arrays))
    require_alike(arrays, {name: tensor.numpy() for name, tensor in tensors.items()}, str(path))
    for name, tensor in tensors.items():
        tensor.copy_(torch.from_numpy(arrays[name]))


def _tensors(modules: Mapping[str, nn.Module]) -> dict[str, torch.Tensor]:
    """Parameters and buffers by the names of module and tensor; they share their memory with the modules."""
    return {
        f"{of}/{name}": tensor.detach()
        for of, module in modules.items()
        for name, tensor in module.state_dict().items()
    }
