"""The trained network in the folder of a training run: its best checkpoint, or its last.

A run keeps ``checkpoints/step-N/policy.npz``, and ``best.json`` and ``last.json`` beside these say which.
"""

import re
from pathlib import Path

from wifipgo.errors import BadInputError, pick, require
from wifipgo.files.text_files import read_json

POLICY = "policy.npz"
CHECKPOINTS = "checkpoints"
STEP = re.compile(r"step-[0-9]{9,15}")
_WHICH = {"best": "of the highest score", "last": "saved last"}


def pointed_to(pointer: Path) -> Path:
    """Folder of the checkpoint that a pointer names.

    Raises:
        BadInputError: There is no pointer, it is damaged, or leads elsewhere.
    """
    which = pointer.stem
    require(pointer.is_file(), str(pointer), f"there: no {which} checkpoint was saved", "nothing")
    found = read_json(pointer)
    name = found.get("checkpoint") if isinstance(found, dict) else None
    named = isinstance(name, str) and STEP.fullmatch(name) is not None
    rule = 'a pointer to a checkpoint beside it, {"checkpoint": "step-000000000"}'
    require(named, str(pointer), rule, found)
    return pointer.parent / str(name)


def network_file(path: Path, checkpoint: str = "best") -> Path:
    """The file of a network: the path itself, or that in the folder of a run.

    Args:
        path: A file, or a folder of `train.ppo`, of `train.rllib` or of a checkpoint.
        checkpoint: ``best`` or ``last``, for a run that has both.

    Raises:
        BadInputError: A folder without a network; says where it was looked for.
    """
    pick(_WHICH, checkpoint, "checkpoint")
    if not path.is_dir():
        return path
    pointer = path / CHECKPOINTS / f"{checkpoint}.json"
    own = path / POLICY
    if own.is_file():
        return own
    if pointer.is_file():
        return pointed_to(pointer) / POLICY
    rule = f"a trained policy, or the folder of a run with {CHECKPOINTS}/{checkpoint}.json or {POLICY}"
    raise BadInputError(f"{path} must be {rule}, got a folder without these")
