"""Layers of a trained network from a file: there without a gap, shapes that chain, values that are finite."""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from wifipgo.errors import BadInputError, require

_NAME = re.compile(r"([a-z]+)/(0|[1-9][0-9]?)/(weight|bias)")
Layers = Sequence[tuple[np.ndarray, np.ndarray]]


class Sizes(NamedTuple):
    """A perceptron: its name, its inputs for so many numbers shown, and its outputs."""

    name: str
    inputs: Callable[[int], int]
    outputs: int


def layers_of(arrays: Mapping[str, np.ndarray]) -> dict[str, Layers]:
    """Weight and bias of each layer, in order, by the name of the perceptron.

    Raises:
        BadInputError: An array is none of a layer, or a layer is missing.
    """
    found: dict[str, dict[int, dict[str, np.ndarray]]] = {}
    for key, array in arrays.items():
        named = _NAME.fullmatch(key)
        if named is None:
            raise BadInputError(f"array {key!r} must be named NET/LAYER/weight or NET/LAYER/bias")
        found.setdefault(named[1], {}).setdefault(int(named[2]), {})[named[3]] = array
    for net, layers in found.items():
        whole = sorted(layers) == list(range(len(layers))) and all(
            len(layer) == 2 for layer in layers.values()
        )
        require(whole, f"layers of {net}", "numbered from 0, each with weight and bias", sorted(layers))
    return {
        net: [(layers[k]["weight"], layers[k]["bias"]) for k in range(len(layers))]
        for net, layers in found.items()
    }


def check_layers(
    nets: Mapping[str, Layers], mean: np.ndarray, variance: np.ndarray, *, sizes: Sequence[Sizes]
) -> None:
    """See that numbers can flow from what is shown to the answers.

    Args:
        nets: By name.
        mean: Of what is shown.
        variance: Of what is shown.
        sizes: Perceptrons that there have to be; without, any.

    Raises:
        BadInputError: Names the layer, the rule and what was found.
    """
    for name, array in (("mean", mean), ("variance", variance)):
        _check_numbers(name, array, mean.shape)
    require(mean.ndim == 1, "mean", "a row of numbers", mean.shape)
    require(bool((variance >= 0.0).all()), "variance", ">= 0", float(variance.min(initial=0.0)))
    names = sorted(size.name for size in sizes)
    require(not sizes or sorted(nets) == names, "perceptrons", f"{names}", sorted(nets))
    for size in sizes:
        _check_chain(size.name, nets[size.name], size.inputs(len(mean)), size.outputs)


def _check_chain(net: str, layers: Layers, n_inputs: int, n_outputs: int) -> None:
    """Raise unless each layer takes what the one before it gives."""
    for k, (weight, bias) in enumerate(layers):
        require(weight.ndim == 2, f"{net}/{k}/weight", "a matrix", weight.shape)
        _check_numbers(f"{net}/{k}/weight", weight, (len(weight), n_inputs))
        _check_numbers(f"{net}/{k}/bias", bias, (len(weight),))
        n_inputs = len(weight)
    require(n_inputs == n_outputs, f"outputs of {net}/{len(layers) - 1}", f"{n_outputs}", n_inputs)


def _check_numbers(name: str, array: np.ndarray, shape: tuple[int, ...]) -> None:
    require(array.dtype.kind == "f", name, "of floating point numbers", array.dtype)
    require(array.shape == shape, f"shape of {name}", f"{shape}", array.shape)
    finite = np.isfinite(array)
    require(bool(finite.all()), name, "finite", array[~finite][:1])
