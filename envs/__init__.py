"""PettingZoo environments. The public module is `envs.rendezvous_v0`.

Importing this package registers, without loading what it names:

- ``pettingzoo.make("parallel", "wifipgo/rendezvous-v0")`` and ``"aec"`` (PettingZoo 1.27 on; older ones have
  no registry),
- ``gymnasium.make("wifipgo/RendezvousTeam-v0")``, one controller for the whole team; ``gymnasium.make_vec``
  makes many teams that are stepped at once.
"""

import sys

if sys.argv[:1] == ["-m"]:  # a command is about to load: Ctrl-C ends it without a traceback
    import wifipgo.command.early_interrupts  # noqa: F401

from envs._registry import register_all

register_all()
