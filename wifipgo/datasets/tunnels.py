"""The tunnels of Kimera-Multi as dpgo_ros has them: eight robots, one CSV each, and many wrong loops."""

from pathlib import Path

from wifipgo.errors import TextFileError, require
from wifipgo.graph.files.dpgo_csv import read_dpgo_csv
from wifipgo.graph.posegraph import PoseGraph


def read_tunnels(folder: str | Path) -> PoseGraph:
    """Read a folder of CSV files as dpgo writes them, one a robot.

    A measurement that two files have counts once. Information is ``tau`` on each axis of the position and
    ``2 kappa`` on each of the rotation vector. Poses begin along the odometry.

    Args:
        folder: Where the files are.

    Returns:
        The graph, in space, with every loop that is in the files, right or wrong.

    Raises:
        BadInputError: There are no such files, one says what cannot be, or a robot has no odometry; names the
            file and the line.
        OSError: A file cannot be read.
    """
    place = Path(folder)
    require(place.is_dir(), "folder", "a folder with one .csv file a robot", str(folder))
    graph = read_dpgo_csv(place).graph
    moved = set(graph.robot[graph.tail[graph.odometry]].tolist())
    for robot in graph.robots.tolist():
        if robot not in moved:
            what = f"odometry of robot {robot}, from one of its poses to the next"
            raise TextFileError(str(place), 0, what, "none in any file")
    return graph
