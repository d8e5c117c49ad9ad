"""Films and stills on disk: there whole or not at all."""

import errno
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from types import MappingProxyType

import numpy as np
from jaxtyping import UInt8

from wifipgo.command.palette import screen_colours
from wifipgo.files.atomic_files import appearing

Frame = UInt8[np.ndarray, "height width 3"]
Add = Callable[[np.ndarray], None]
_HOLD_S = 2.0  # how long a film stays on its last picture


@contextmanager
def film(path: Path, *, fps: int) -> Iterator[Add]:
    """Write the pictures that are added to a film, or the last one to a still, by the name's suffix."""
    with appearing(path, by_suffix=True) as partial, KINDS[path.suffix.lower()](partial, fps) as add:
        yield add


@contextmanager
def _mp4(path: Path, fps: int) -> Iterator[Add]:
    """H.264, as every player takes it."""
    import imageio.v2 as imageio  # noqa: PLC0415 (belongs to an extra)

    writer = imageio.get_writer(
        path, format="FFMPEG", fps=fps, codec="libx264", quality=8, pixelformat="yuv420p"
    )
    n = 0

    def count(frame: np.ndarray) -> None:
        nonlocal n
        writer.append_data(frame)
        n += 1

    with writer, _held(count, fps) as add:
        yield add
    _check_playable(path, n)


def _check_playable(path: Path, n_frames: int) -> None:
    """Refuse a film that lacks pictures: ffmpeg may end on a full disk without a word.

    Raises:
        OSError: It cannot be played, or not to its end.
    """
    from imageio_ffmpeg import count_frames_and_secs  # noqa: PLC0415 (belongs to an extra)

    try:
        found = count_frames_and_secs(path)[0]
    except Exception:
        found = 0
    if found != n_frames:
        why = f"the film was not written whole ({found} of {n_frames} pictures): is the disk full?"
        raise OSError(errno.EIO, why, str(path))


@contextmanager
def _gif(path: Path, fps: int) -> Iterator[Add]:
    """A film that runs in a web page, again and again."""
    from PIL import Image  # noqa: PLC0415 (comes with the extra)

    frames: list[Image.Image] = []

    def keep(frame: np.ndarray) -> None:
        # One palette and no dithering: what stands still is the same in every picture and costs nothing.
        frames.append(Image.fromarray(frame).quantize(palette=colours, dither=Image.Dither.NONE))

    colours = Image.new("P", (1, 1))
    colours.putpalette([part for colour in screen_colours() for part in colour])
    yield keep
    if frames:
        pause = [round(1000.0 / fps)] * (len(frames) - 1) + [round(1000.0 * _HOLD_S)]
        frames[0].save(
            path,
            format="GIF",
            save_all=True,
            append_images=frames[1:],
            duration=pause,
            loop=0,
            optimize=False,
        )


@contextmanager
def _held(add: Add, fps: int) -> Iterator[Add]:
    """Repeat the last picture, so that there is time to look at it."""
    last: list[np.ndarray] = []

    def keep(frame: np.ndarray) -> None:
        last[:] = [frame]
        add(frame)

    yield keep
    for frame in last * round(_HOLD_S * fps):
        add(frame)


@contextmanager
def _png(path: Path, fps: int) -> Iterator[Add]:
    """The last picture."""
    import imageio.v2 as imageio  # noqa: PLC0415 (belongs to an extra)

    last: list[np.ndarray] = []

    def keep(frame: np.ndarray) -> None:
        last[:] = [frame]

    yield keep
    for frame in last:
        imageio.imwrite(path, frame)


KINDS: Mapping[str, Callable[[Path, int], AbstractContextManager[Add]]] = MappingProxyType(
    {".mp4": _mp4, ".gif": _gif, ".png": _png}
)
