"""Pose graphs of any format that is read: told by the name of the file, or by what is in the folder."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from wifipgo.errors import require
from wifipgo.graph.files.dpgo_csv import read_dpgo_csv
from wifipgo.graph.files.g2o import Reading, read_g2o, symbols
from wifipgo.graph.files.jrl import read_jrl
from wifipgo.graph.subgraphs import cut_into_robots

Reader = Callable[[Path, bool], Reading]

FORMATS: Mapping[str, Reader] = MappingProxyType(
    {
        ".g2o": lambda path, lenient: read_g2o(path, lenient=lenient),
        ".jrl": lambda path, lenient: read_jrl(path, lenient=lenient),
        ".cbor": lambda path, lenient: read_jrl(path, lenient=lenient),
        ".csv": lambda path, lenient: read_dpgo_csv(path),
    }
)
OF_FOLDERS = (".g2o", ".csv")  # one file a robot


def read_graph(path: str | Path, *, lenient: bool = False) -> Reading:
    """Read a pose graph.

    Args:
        path: A file ``.g2o``, ``.jrl``, ``.cbor`` (JRL) or ``.csv`` (dpgo), or a folder of g2o or CSV files,
            one a robot. A file of another name is read as g2o.
        lenient: Skip what is of unknown kind, and report it.

    Raises:
        BadInputError: It cannot be used; names the line or field.
        OSError: It cannot be read.
    """
    path = Path(path)
    require(path.exists(), "path", "a file or folder that exists", str(path))
    if not path.is_dir():
        return FORMATS.get(path.suffix.lower(), FORMATS[".g2o"])(path, lenient)
    there = [suffix for suffix in OF_FOLDERS if any(path.glob(f"*{suffix}"))]
    one = [file for file in path.glob("*") if file.suffix.lower() in (".jrl", ".cbor")]
    if not there:
        hint = f" (one of its files: {one[0].name})" if one else ""
        require(False, "path", f"a file, or a folder with 0.g2o, 1.g2o, ... or .csv files{hint}", str(path))
    return FORMATS[there[0]](path, lenient)


def cut(reading: Reading, n_robots: int) -> Reading:
    """One robot's graph as that of a team, see `wifipgo.graph.subgraphs.cut_into_robots`; keys are new.

    Raises:
        ValueError: There are several robots already, fewer poses than robots, or more robots than letters.
    """
    graph = cut_into_robots(reading.graph, n_robots)
    return reading._replace(graph=graph, keys=symbols(graph), landmarks=())
