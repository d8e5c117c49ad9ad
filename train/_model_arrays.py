"""What a training needs to go on, as plain arrays: weights, optimiser, normalisation, generators."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from train._alike import require_alike
from train._averages import AVERAGE
from wifipgo.errors import BadInputError, require

_WEIGHTS, _OPTIMISER = "policy/", "optimiser/"
_MOMENTS = {"step", "exp_avg", "exp_avg_sq"}
_PARTS = ("mean", "var", "count")


def arrays_of(model: PPO, norm: VecNormalize) -> dict[str, np.ndarray]:
    """Everything by name."""
    weights = {f"{_WEIGHTS}{name}": t.numpy().copy() for name, t in model.policy.state_dict().items()}
    moments = {
        f"{_OPTIMISER}{k}/{name}": torch.as_tensor(value).numpy().copy()
        for k, state in model.policy.optimizer.state_dict()["state"].items()
        for name, value in state.items()
    }
    return weights | moments | _statistics(norm) | _generators()


def restore(arrays: Mapping[str, np.ndarray], model: PPO, norm: VecNormalize, *, where: str) -> None:
    """Put everything in place in a model and environments that were made with the same settings.

    Raises:
        BadInputError: An array is missing, of another shape or not finite; names it.
    """
    _put(arrays, model, norm, where)
    _restore_optimiser(arrays, model, where)
    _restore_generators(arrays, where)


def begin_with(arrays: Mapping[str, np.ndarray], model: PPO, norm: VecNormalize, *, where: str) -> None:
    """Put weights, averaged ones where there are, and normalisation in place in a model of the same network.

    Raises:
        BadInputError: An array is missing, of another shape or not finite; names it.
    """
    judged = {
        name: arrays.get(f"{AVERAGE}{name.removeprefix(_WEIGHTS)}", array) for name, array in arrays.items()
    }
    _put(judged, model, norm, where)


def _put(arrays: Mapping[str, np.ndarray], model: PPO, norm: VecNormalize, where: str) -> None:
    """Put weights and normalisation in place."""
    present = {name: a for name, a in arrays_of(model, norm).items() if not name.startswith(_OPTIMISER)}
    require_alike(arrays, present, where)
    model.policy.load_state_dict(
        {
            name.removeprefix(_WEIGHTS): torch.from_numpy(a)
            for name, a in arrays.items()
            if name.startswith(_WEIGHTS)
        }
    )
    for name, target in _targets(norm):
        for part in _PARTS:
            value = arrays[f"norm/{name}/{part}"]
            setattr(target, part, float(value) if part == "count" else value.copy())


def _restore_generators(arrays: Mapping[str, np.ndarray], where: str) -> None:
    """Let chance go on where it was."""
    key, place = arrays["chance/numpy"], int(arrays["chance/numpy_place"])
    require(0 <= place <= len(key), f"{where}: chance/numpy_place", f"in 0..{len(key)}", place)
    np.random.set_state(("MT19937", key, place, 0, 0.0))  # noqa: NPY002 (stable-baselines3 shuffles with it)
    try:
        torch.set_rng_state(torch.from_numpy(arrays["chance/torch"]))
    except RuntimeError as problem:
        raise BadInputError(f"{where}: chance/torch is no state of torch's generator") from problem


def _restore_optimiser(arrays: Mapping[str, np.ndarray], model: PPO, where: str) -> None:
    """Moments of Adam; its settings are those of the fresh one."""
    optimiser, parameters = model.policy.optimizer, list(model.policy.parameters())
    state: dict[int, dict[str, torch.Tensor]] = {}
    for name in (name for name in arrays if name.startswith(_OPTIMISER)):
        number, _, field = name.removeprefix(_OPTIMISER).partition("/")
        k = int(number) if number.isdecimal() else len(parameters)
        require(k < len(parameters), f"{where}: {name}", f"of one of {len(parameters)} parameters", number)
        shapes = (tuple(parameters[k].shape), ())
        require(arrays[name].shape in shapes, f"{where}: shape of {name}", f"{shapes[0]}", arrays[name].shape)
        state.setdefault(k, {})[field] = torch.from_numpy(arrays[name])
    for k, fields in state.items():
        require(
            set(fields) == _MOMENTS, f"{where}: {_OPTIMISER}{k}", f"of {sorted(_MOMENTS)}", sorted(fields)
        )
    optimiser.load_state_dict({"state": state, "param_groups": optimiser.state_dict()["param_groups"]})


def _targets(norm: VecNormalize) -> Iterator[tuple[str, Any]]:
    """Running statistics by name; observations have none where they are not normalised."""
    for name in ("obs_rms", "ret_rms"):
        if (found := getattr(norm, name, None)) is not None:
            yield name, found


def _statistics(norm: VecNormalize) -> dict[str, np.ndarray]:
    """Mean, variance and count of what is normalised."""
    return {
        f"norm/{name}/{part}": np.array(getattr(target, part), dtype=np.float64)
        for name, target in _targets(norm)
        for part in _PARTS
    }


def _generators() -> dict[str, np.ndarray]:
    """States of the two generators that stable-baselines3 draws from."""
    state: Any = np.random.get_state()  # noqa: NPY002
    return {
        "chance/torch": torch.get_rng_state().numpy().copy(),
        "chance/numpy": state[1].copy(),
        "chance/numpy_place": np.array(state[2]),
    }
