"""Pictures of many worlds, side by side."""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import UInt8

from envs.render.config import RenderConfig
from envs.render.viewer import Viewer
from wifipgo.scenarios import Scenario
from wifipgo.state import Tick, World

Picture = UInt8[np.ndarray, "height width 3"]
_GAP_PX, _BETWEEN = 4, 255


def picture_of(tick: Tick, world: World, scenario: Scenario, config: RenderConfig) -> Picture:
    """One world."""
    return Viewer(config).frame(tick, world, scenario)


def mosaic(pictures: Sequence[Picture]) -> UInt8[np.ndarray, "high wide 3"]:
    """Pictures of one size in rows and columns, about as many of both."""
    n_columns = math.ceil(math.sqrt(len(pictures)))
    n_rows = math.ceil(len(pictures) / n_columns)
    height, width = (size + _GAP_PX for size in pictures[0].shape[:2])
    out = np.full((n_rows * height - _GAP_PX, n_columns * width - _GAP_PX, 3), _BETWEEN, dtype=np.uint8)
    for k, picture in enumerate(pictures):
        row, column = divmod(k, n_columns)
        top, left = row * height, column * width
        out[top : top + height - _GAP_PX, left : left + width - _GAP_PX] = picture
    return out
