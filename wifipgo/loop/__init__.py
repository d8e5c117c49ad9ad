"""The loop: one iteration of all robots as a straight line from commands to beliefs."""

from wifipgo.loop.first_tick import start
from wifipgo.loop.iteration import advance

__all__ = ["advance", "start"]
