"""What can be drawn and how large. Knows no pygame, so that importing it costs nothing."""

import importlib.util
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from gymnasium.error import DependencyNotInstalled

from wifipgo.coerce import fitted
from wifipgo.errors import pick, require

RENDER_MODES: Mapping[str, str] = MappingProxyType(
    {"human": "a window", "rgb_array": "arrays, without a display"}
)
# Codecs of films want sides that are multiples of this.
BLOCK_PX = 16
DEFAULT_HEIGHT_PX = 608


@dataclass(frozen=True, slots=True, kw_only=True)
class RenderConfig:
    """Size and caption of the pictures.

    Attributes:
        height_px: Height; the arena is a square of this side, and the panel beside it adds two fifths.
        caption: Line under the title, e.g. the policy that drives.
    """

    height_px: int = DEFAULT_HEIGHT_PX
    caption: str = ""

    def __post_init__(self) -> None:
        """Reject sizes that films refuse or on which the panel cannot be read."""
        object.__setattr__(self, "height_px", fitted(self.height_px, int, "RenderConfig.height_px"))
        fits = 320 <= self.height_px <= 4096 and self.height_px % BLOCK_PX == 0
        require(fits, "RenderConfig.height_px", f"a multiple of {BLOCK_PX} in 320..4096", self.height_px)

    @property
    def panel_px(self) -> int:
        """Width of the panel."""
        return BLOCK_PX * round(0.4 * self.height_px / BLOCK_PX)

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of a picture."""
        return self.height_px + self.panel_px, self.height_px


def check_render_mode(mode: str) -> None:
    """Refuse a mode that does not exist, and any while there is nothing to draw with.

    Raises:
        UnknownNameError: The message lists the modes.
        DependencyNotInstalled: The message names the extra that brings pygame.
    """
    pick(RENDER_MODES, mode, "render_mode")
    if importlib.util.find_spec("pygame") is None:
        raise DependencyNotInstalled(f"render_mode={mode!r} needs pygame-ce: pip install 'wifipgo[video]'")
