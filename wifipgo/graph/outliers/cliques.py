"""Largest set of measurements that all agree with each other: a maximum clique, within a bounded time.

The search is branch and bound with colours (Tavares et al., 2015), as in networkx, whose cliques it
returns, on bits in place of lists. It is exact, and its time can grow exponentially: already
250 good measurements, of which each fits 99 % of the others, are too many. So it stops after `EXACT_WORK`
steps, the same on every machine, and a local search (Pullan and Hoos, DLS-MC, JAIR 2006) goes on
from the best clique so far. What it finds is a clique, and nearly always a largest, which nobody has proven.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Int

EXACT_WORK = 1_000_000  # colours given before the exact search stops: about a second
LOCAL_WORK = 10_000_000  # of the local search, steps times measurements: about as long


class Clique(NamedTuple):
    """Members in ascending order, and whether no larger clique exists for certain."""

    members: Int[np.ndarray, " members"]
    proven: bool


def largest_clique(agree: Bool[np.ndarray, "n n"], *, exact_work: int = EXACT_WORK) -> Clique:
    """A largest set of rows that pairwise agree; the same one in every run.

    Args:
        agree: Which agree, symmetric; the diagonal is not looked at.
        exact_work: Steps of the exact search after which a local search takes over.
    """
    adjacent: Bool[np.ndarray, "n n"] = agree & ~np.eye(len(agree), dtype=bool)
    degree = adjacent.sum(axis=1)
    order = np.argsort(-degree, kind="stable")
    n_surely = int((degree == len(agree) - 1).sum())  # what agrees with all is in every largest set
    surely, order = order[:n_surely], order[n_surely:]
    adjacent = adjacent[order][:, order]
    members, proven = _branch_and_bound(adjacent, exact_work)
    if not proven:
        members = _local_search(adjacent, members)
    return Clique(np.sort(np.append(surely, order[members])), proven)


class _Node(NamedTuple):
    """A clique, those that can join it, and those to branch on, as bits."""

    clique: tuple[int, ...]
    may_join: int
    branches: int


def _branch_and_bound(adjacent: Bool[np.ndarray, "n n"], work: int) -> tuple[list[int], bool]:
    """Best clique found, and whether the search came to its end within ``work``."""
    joins, apart = _as_bits(adjacent), _as_bits(~adjacent & ~np.eye(len(adjacent), dtype=bool))
    best: tuple[int, ...] = ()
    everybody = (1 << len(adjacent)) - 1
    open_nodes = [_Node((), everybody, everybody)]
    while open_nodes:
        clique, may_join, branches = open_nodes.pop()
        if not branches:
            continue
        row = branches.bit_length() - 1
        may_join ^= 1 << row
        open_nodes.append(_Node(clique, may_join, branches ^ (1 << row)))
        clique, may_join = (*clique, row), may_join & joins[row]
        best = clique if len(clique) > len(best) else best
        branches, spent = _to_branch_on(may_join, apart, len(best) - len(clique))
        work -= spent
        if work < 0:
            return list(best), False
        open_nodes.append(_Node(clique, may_join, branches))
    return list(best), True


def _to_branch_on(may_join: int, apart: list[int], target: int) -> tuple[int, int]:
    """Rows left when ``target`` colours are given, of which no two of one colour agree; rows coloured."""
    spent = 0
    for _ in range(target):
        free = may_join
        while free:
            lowest = free & -free
            may_join ^= lowest
            free &= apart[lowest.bit_length() - 1]
            spent += 1
        if not may_join:
            break
    return may_join, spent + 1


def _as_bits(rows: Bool[np.ndarray, "n n"]) -> list[int]:
    packed = np.packbits(rows, axis=1, bitorder="little")
    return [int.from_bytes(row.tobytes(), "little") for row in packed]


def _local_search(adjacent: Bool[np.ndarray, "n n"], start: list[int]) -> list[int]:
    """Add what fits all, else exchange one for one, the longest untouched first; the best clique on the way.

    Where neither is possible, the longest untouched row comes in, and all that it does not fit go out.
    """
    n = len(adjacent)
    conflicts = ~adjacent & ~np.eye(n, dtype=bool)
    inside = np.zeros(n, dtype=bool)
    inside[start] = True
    unfit = conflicts[start].sum(axis=0)
    touched, best = np.zeros(n, dtype=np.int64), inside.copy()
    for step in range(1, LOCAL_WORK // n):
        if inside.all():
            break
        fewest = max(int(np.where(inside, n, unfit).min()), 1)
        allowed = ~inside & (unfit <= fewest)
        rank = np.where(unfit == 0, -1, touched)
        row = int(np.where(allowed, rank, LOCAL_WORK).argmin())
        out = np.flatnonzero(conflicts[row] & inside)
        unfit += conflicts[row] - conflicts[out].sum(axis=0)
        inside[row], inside[out] = True, False
        touched[out] = touched[row] = step
        if inside.sum() > best.sum():
            best = inside.copy()
    return np.flatnonzero(best).tolist()
