"""Random pose graphs of several robots, for tests."""

import numpy as np

from wifipgo import se2, se3
from wifipgo.graph.posegraph import PoseGraph, pose_graph


def compose(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return se2.compose(a, b) if a.shape[-1] == 3 else se3.compose(a, b)


def between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return se2.between(a, b) if a.shape[-1] == 3 else se3.between(a, b)


def small(twist: np.ndarray) -> np.ndarray:
    """Transform of a tangent vector; in the plane to first order."""
    return twist if twist.shape[-1] == 3 else se3.exp(twist)


def random_graph(
    seed: int,
    *,
    dims: int = 7,
    robots: int = 3,
    poses: int = 5,
    meetings: int = 8,
    noise: float = 0.05,
    start_noise: float = 0.3,
) -> tuple[np.ndarray, PoseGraph]:
    """Truth and graph: chains with gaps in their numbers, a ring of robots, some meetings more."""
    rng = np.random.default_rng(seed)
    freedom = 3 if dims == 3 else 6
    robot, index = np.indices((robots, poses)).reshape(2, -1)
    index = index * 2 + robot
    truth = small(rng.uniform(-2.0, 2.0, (robots * poses, freedom)))
    row = np.arange(robots * poses).reshape(robots, poses)
    tail, head = row[:, :-1].ravel(), row[:, 1:].ravel()
    if robots > 1:
        tail, head = np.append(tail, row[:, 1]), np.append(head, np.roll(row, -1, axis=0)[:, 2])
    met = rng.integers(0, len(truth), (meetings, 2))
    met = met[met[:, 0] != met[:, 1]]
    tail, head = np.append(tail, met[:, 0]), np.append(head, met[:, 1])
    z = compose(between(truth[tail], truth[head]), small(noise * rng.normal(size=(len(tail), freedom))))
    key = np.stack([robot, index], axis=-1)
    start = compose(truth, small(start_noise * rng.normal(size=(len(truth), freedom))))
    graph = pose_graph(
        robot=robot,
        index=index,
        poses=start,
        tail=key[tail],
        head=key[head],
        z=z,
        information=np.broadcast_to(np.eye(freedom), (len(tail), freedom, freedom)).copy(),
        weight=rng.uniform(0.3, 1.0, len(tail)),
    )
    return truth, graph
