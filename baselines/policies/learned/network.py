"""A trained network as numbers: small perceptrons in numpy, and the file that holds them.

A file says what it was trained for: the layout of the observations, the scenario, the command.  It is read
without torch and without pickle.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from baselines.policies.learned import ray_interface, trail_interface
from baselines.policies.learned.network_checks import Sizes, check_layers, layers_of
from envs.rendezvous_v0 import layout
from wifipgo.errors import BadInputError, require
from wifipgo.files.atomic_files import appearing
from wifipgo.files.npz_files import read_npz
from wifipgo.files.text_files import parsed_json
from wifipgo.scenarios import Scenario
from wifipgo.world.lidar import N_LIDAR_RAYS

FORMAT = 1
# Numbers of the robot as a whole, by interface; those of each direction follow.
N_WHOLE: Mapping[str, int] = {"rays": ray_interface.N_WHOLE, "trail": trail_interface.N_WHOLE}


def _scorers(n_whole: int) -> Sequence[Sizes]:
    """The perceptron that scores directions, and that of stopping and calling."""

    def n_direction(shown: int) -> int:
        return (shown - n_whole) // N_LIDAR_RAYS

    return (
        Sizes("ray", lambda shown: n_whole + n_direction(shown), 1),
        Sizes("whole", lambda shown: n_whole + 2 * n_direction(shown), 3),
    )


# Per interface: each perceptron with its numbers in and out; the first of them follow from what is shown.
_SIZES: Mapping[str, Sequence[Sizes]] = {
    "flat": (Sizes("action", lambda shown: shown, 3),),
    **{name: _scorers(n_whole) for name, n_whole in N_WHOLE.items()},
}
# One perceptron for all that is shown may answer for an interface, too: what each of its choices scores.
_ONE_FOR_ALL: Mapping[str, Sequence[Sizes]] = {
    **_SIZES,
    **{name: (Sizes("action", lambda shown: shown, N_LIDAR_RAYS + 3),) for name in N_WHOLE},
}
_KINDS: Mapping[str, type | tuple[type, ...]] = {
    "interface": str,
    "layout": list,
    "scenario": dict,
    "origin": dict,
    "clip": (int, float),
}
_NOTES = ("format", "interface", "layout", "scenario", "clip", "origin")


class Layer(NamedTuple):
    """One affine map, then tanh in all layers but the last."""

    weight: Float[np.ndarray, "outputs inputs"]
    bias: Float[np.ndarray, " outputs"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Network:
    """What a robot needs to run a trained policy.

    Attributes:
        interface: Name in `baselines.policies.learned.interfaces.INTERFACES`.
        nets: Perceptrons by name: ``action`` for flat, ``ray`` and ``whole`` for rays.
        mean, variance: Of what is shown, by which it is normalised.
        clip: Largest normalised number.
        layout: Name and size of each block of the observation that it was trained on, in order.
        scenario: The scenario that it was trained on, as plain values.
        origin: Command, seed, versions: where it comes from.
    """

    interface: str
    nets: Mapping[str, Sequence[Layer]]
    mean: Float[np.ndarray, " shown"]
    variance: Float[np.ndarray, " shown"]
    clip: float
    layout: Sequence[tuple[str, int]]
    scenario: Mapping[str, Any]
    origin: Mapping[str, Any] = field(default_factory=dict)

    def scores(
        self, shown: Float[np.ndarray, "*teams rows shown"]
    ) -> Float[np.ndarray, "*teams rows outputs"]:
        """Answers of `flat`, or what each choice of `rays` scores: directions, stop, silence, call."""
        x = np.clip((shown - self.mean) / np.sqrt(self.variance + 1e-8), -self.clip, self.clip)
        if "action" in self.nets:
            return perceptron(self.nets["action"], x)
        whole, directions = split_rays(x, N_WHOLE[self.interface])
        for_each = np.broadcast_to(whole[..., None, :], (*directions.shape[:-1], whole.shape[-1]))
        each = np.concatenate([directions, for_each], axis=-1)
        pooled = np.concatenate([whole, directions.mean(axis=-2), directions.max(axis=-2)], axis=-1)
        rays = perceptron(self.nets["ray"], each)[..., 0]
        return np.concatenate([rays, perceptron(self.nets["whole"], pooled)], axis=-1)

    def save(self, path: Path) -> None:
        """Write to a file that is there whole or not at all."""
        arrays = {f"{net}/{k}/{part}": array for net, k, part, array in self._arrays()}
        notes = {name: getattr(self, name) for name in _NOTES if name != "format"} | {"format": FORMAT}
        arrays |= {"notes": np.array(json.dumps(notes)), "mean": self.mean, "variance": self.variance}
        with appearing(path) as unfinished, unfinished.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)

    def _arrays(self) -> list[tuple[str, int, str, np.ndarray]]:
        return [
            (net, k, part, getattr(layer, part))
            for net, layers in self.nets.items()
            for k, layer in enumerate(layers)
            for part in Layer._fields
        ]


def load_network(path: Path) -> Network:
    """Read what `Network.save` wrote.

    Raises:
        ValueError: It is not such a file; the message names it.
        OSError: It cannot be read.
    """
    try:
        arrays = read_npz(path)
        notes = parsed_json(str(arrays.pop("notes")), f"{path}: notes")
        known, mean, variance = _known(notes, str(path)), arrays.pop("mean"), arrays.pop("variance")
        layers = layers_of(arrays)
        known_sizes = _ONE_FOR_ALL if "action" in layers else _SIZES
        check_layers(layers, mean, variance, sizes=known_sizes.get(known["interface"], ()))
    except (ValueError, KeyError, TypeError, AttributeError) as problem:
        raise BadInputError(
            f"{path} is no trained policy (an .npz that training exports): {problem}"
        ) from problem
    nets = {name: [Layer(*layer) for layer in net] for name, net in layers.items()}
    return Network(nets=nets, mean=mean, variance=variance, **known)


def _known(notes: Any, where: str) -> dict[str, Any]:
    """What the notes of a file say, by the name of the field."""
    require(isinstance(notes, dict), "notes", "a table", notes)
    require(notes.get("format") == FORMAT, f"format of {where}", f"{FORMAT}", notes.get("format"))
    known = {name: notes[name] for name in _NOTES if name != "format"}
    for name, kind in _KINDS.items():
        require(isinstance(known[name], kind), name, "of the type that training writes", known[name])
    require(0.0 < known["clip"] < np.inf, "clip", "> 0 and finite", known["clip"])
    pairs = all(isinstance(row, list) and list(map(type, row)) == [str, int] for row in known["layout"])
    require(pairs, "layout", "names and sizes of blocks", known["layout"])
    known["layout"] = [(name, size) for name, size in known["layout"]]
    return known


def perceptron(
    layers: Sequence[Layer], x: Float[np.ndarray, "... inputs"]
) -> Float[np.ndarray, "... outputs"]:
    """Affine maps with tanh between them."""
    for layer in layers[:-1]:
        x = np.tanh(x @ layer.weight.T + layer.bias)
    return x @ layers[-1].weight.T + layers[-1].bias


def split_rays(
    x: Float[np.ndarray, "*rows shown"], n_whole: int
) -> tuple[Float[np.ndarray, "*rows whole"], Float[np.ndarray, "*rows rays direction"]]:
    """Numbers of the robot, and those of each direction."""
    directions = x[..., n_whole:].reshape(*x.shape[:-1], -1, N_LIDAR_RAYS)
    return x[..., :n_whole], np.swapaxes(directions, -1, -2)


def layout_of(scenario: Scenario) -> list[tuple[str, int]]:
    """Name and size of each block of the observation."""
    return [(block.name, block.size) for block in layout(scenario)]


def plain(scenario: Scenario) -> dict[str, Any]:
    """A scenario as JSON has it."""
    return dict(json.loads(json.dumps(asdict(scenario))))


def refuse_other_layout(network: Network, scenario: Scenario, where: str, *, reads: Sequence[str]) -> None:
    """Raise unless a scenario's observations hold what the network reads, as it was in training.

    Args:
        network: Says how it was.
        scenario: To be played.
        where: What the network is called.
        reads: Names of the blocks that count; where they stand, and what else is there, does not.

    Raises:
        ValueError: Names the first block that differs.
    """
    there, now = dict(network.layout), dict(layout_of(scenario))
    names = [name for name in reads if name not in there or there[name] != now.get(name)]
    if not names:
        return
    name = names[0]
    what = f"{len(names)} blocks of the observation differ, the first is {name!r}: "
    sizes = f"{there.get(name, 'absent')} in training, {now.get(name, 'absent')} in {scenario.name!r}"
    trained = network.scenario.get("name")
    raise BadInputError(f"{where} was trained on {trained!r}, whose layout is another; {what}{sizes}")
