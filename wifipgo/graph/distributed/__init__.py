"""Distributed optimisation: robots that own their poses and tell each other about separators."""

from wifipgo.graph.distributed.channel import Channel, Message
from wifipgo.graph.distributed.rounds import SCHEMES, DistributedConfig
from wifipgo.graph.distributed.two_level import TwoLevelConfig, solve_two_level
from wifipgo.graph.distributed.two_stage import DistributedReport, solve_distributed

__all__ = [
    "SCHEMES",
    "Channel",
    "DistributedConfig",
    "DistributedReport",
    "Message",
    "TwoLevelConfig",
    "solve_distributed",
    "solve_two_level",
]
