"""One robot's share of a linearised team: its own unknowns, and what its neighbours' do to them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array, diags_array

from wifipgo import se2, se3
from wifipgo.graph.distributed.channel import Channel, Message
from wifipgo.graph.factorised import factorised
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.solvers.linear_blocks import LinearBlocks

MOST_TRIES = 100  # of a round, until everybody has heard
Column = Float[np.ndarray, " unknowns"]


class Share(NamedTuple):
    """What a robot knows of the team for good.

    Attributes:
        number: Which robot this is.
        own: Rows of its poses in the graph.
        separators: Rows of neighbours' poses that it has measurements of.
        links: Which measurements touch its poses.
        told_to: Places among its own poses of what each neighbour wants to know.
        heard_from: Places among the separators of what each neighbour tells, in the same order.
        free: Which of its unknowns are not known beforehand.
    """

    number: int
    own: Int[np.ndarray, " own"]
    separators: Int[np.ndarray, " separators"]
    links: Bool[np.ndarray, " edges"]
    told_to: dict[int, Int[np.ndarray, " told"]]
    heard_from: dict[int, Int[np.ndarray, " heard"]]
    free: Bool[np.ndarray, " unknowns"]


def shares(graph: PoseGraph, known: Int[np.ndarray, " known"]) -> list[Share]:
    """Shares of all robots, by number."""
    return [_share(graph, known, number) for number in graph.robots.tolist()]


def _share(graph: PoseGraph, known: Int[np.ndarray, " known"], number: int) -> Share:
    own, used = np.flatnonzero(graph.robot == number), graph.weight > 0.0
    ends = np.stack([graph.tail, graph.head], axis=1)
    mine = (graph.robot[ends] == number) & used[:, None]
    across = ends[used & (mine.sum(axis=1) == 1)]
    of = graph.robot[across]
    theirs, ours = across[of != number], across[of == number]
    separators, neighbour = np.unique(theirs), of[of != number]
    told, heard = {}, {}
    for r in np.unique(neighbour).tolist():
        told[r] = np.searchsorted(own, np.unique(ours[neighbour == r]))
        heard[r] = np.searchsorted(separators, np.unique(theirs[neighbour == r]))
    free = np.repeat(~np.isin(own, known), graph.freedom)
    return Share(number, own, separators, mine.any(axis=1), told, heard, free)


class Part:
    """A share, linearised: H x = g over its own unknowns, given its neighbours'.

    Attributes:
        share: What the robot knows for good.
        g: Right side.
        coarse: Its share of the system of stretches, which is the sum over all robots.
        told: Latest values of its separators.
    """

    def __init__(
        self,
        share: Share,
        blocks: LinearBlocks,
        poses: Float[np.ndarray, "near dims"],
        stretch: tuple[Int[np.ndarray, " near"], int],
    ) -> None:
        """Assemble and factorise.

        Args:
            share: What the robot knows for good.
            blocks: Its measurements.
            poses: Its own, then its separators'.
            stretch: Number of the stretch of each, and how many there are in all.
        """
        self.share, n = share, len(share.free)
        J = _jacobian(share, blocks)
        mine = csr_array(J[:, :n] @ diags_array(share.free.astype(float)))
        self._H = csr_array(mine.T @ mine + diags_array((~share.free).astype(float)))
        self._coupling = csr_array(mine.T @ J[:, n:])
        self._solve = factorised(self._H)
        self.g: Column = mine.T @ blocks.off.ravel()
        rigid = _rigid(poses, *stretch)
        self._rigid = csr_array(diags_array(share.free.astype(float)) @ rigid[:n])
        slope = self._H @ self._rigid + self._coupling @ rigid[n:]
        self.coarse: Float[np.ndarray, "stretches stretches"] = (self._rigid.T @ slope).toarray()
        self.told = np.zeros((len(share.separators), blocks.off.shape[1]))

    def times(self, x: Column) -> Column:
        """Its rows of H x, neighbours' part included as they told it."""
        product: Column = self._H @ x + self._coupling @ self.told.ravel()
        return product

    def smoothed(self, r: Column) -> Column:
        """Its own unknowns, as if nobody else moved."""
        return self._solve(r[:, None])[:, 0]

    def pull(self, r: Column) -> Float[np.ndarray, " stretches"]:
        """What moves stretches as a whole."""
        pull: Column = self._rigid.T @ r
        return pull

    def carried(self, y: Float[np.ndarray, " stretches"]) -> Column:
        """Its own unknowns where stretches move as a whole."""
        carried: Column = self._rigid @ y
        return carried


def tell(channel: Channel, parts: Sequence[Part], values: Sequence[Column], stage: str, stamp: int) -> bool:
    """Tell neighbours the values of shared poses, again until all have heard; whether they have."""
    due = [
        (part, r, Message(part.share.number, stage, stamp, x.reshape(len(part.share.own), -1, 1)[rows]))
        for part, x in zip(parts, values, strict=True)
        for r, rows in part.share.told_to.items()
    ]
    for _ in range(MOST_TRIES):
        due = [(part, r, message) for part, r, message in due if not channel.send(r, message)]
        channel.now += 1 + channel.delay_rounds
        for part in parts:
            for message in channel.collect(part.share.number):
                if (message.stage, message.stamp) == (stage, stamp):
                    part.told[part.share.heard_from[message.sender]] = message.values[..., 0]
        if not due:
            return True
    return False


def _jacobian(share: Share, blocks: LinearBlocks) -> csr_array:
    """Slopes of a robot's measurements over its own unknowns, then its separators'."""
    rows = np.concatenate([share.own, share.separators])
    order = np.argsort(rows)
    n, d = blocks.off.shape
    at = [order[np.searchsorted(rows, end, sorter=order)] for end in (blocks.tail, blocks.head)]
    i = np.broadcast_to((np.arange(n)[:, None] * d + np.arange(d))[:, :, None], (n, d, d))
    j = [np.broadcast_to((end[:, None] * d + np.arange(d))[:, None, :], (n, d, d)) for end in at]
    values = np.concatenate([blocks.J_tail.ravel(), blocks.J_head.ravel()])
    places = (np.concatenate([i.ravel(), i.ravel()]), np.concatenate([j[0].ravel(), j[1].ravel()]))
    return csr_array((values, places), shape=(n * d, len(rows) * d))


def _rigid(
    poses: Float[np.ndarray, "near dims"], stretch: Int[np.ndarray, " near"], n_stretches: int
) -> csr_array:
    """Twists of poses where their stretch moves as a whole in the world, a column a direction."""
    space = se2 if poses.shape[1] == 3 else se3
    adjoint = space.adjoint(space.inverse(poses))
    n, d = adjoint.shape[:2]
    i = np.broadcast_to((np.arange(n)[:, None] * d + np.arange(d))[:, :, None], (n, d, d))
    j = np.broadcast_to((stretch[:, None] * d + np.arange(d))[:, None, :], (n, d, d))
    return csr_array((adjoint.ravel(), (i.ravel(), j.ravel())), shape=(n * d, n_stretches * d))
