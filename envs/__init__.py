"""PettingZoo environments. The public module is `envs.rendezvous_v0`.

Importing this package registers, without loading what it names:

- ``pettingzoo.make("parallel", "wifipgo/rendezvous-v0")`` and ``"aec"`` (PettingZoo 1.27 on; older ones have
  no registry),
- ``gymnasium.make("wifipgo/RendezvousTeam-v0")``, one controller for the whole team; ``gymnasium.make_vec``
  makes many teams that are stepped at once.
"""

import sys

try:  # first: Ctrl-C ends a command that loads; and names of packages may be taken by others
    from wifipgo.command.own_packages import check_floors
except ImportError as problem:
    shadow = getattr(sys.modules.get("wifipgo"), "__file__", None) or "another package"
    advice = "rename it, or work in another folder"
    raise ImportError(f"{shadow} shadows the package 'wifipgo': {advice}") from problem

check_floors("wifipgo")

from envs._registry import register_all  # noqa: E402

register_all()
