"""Names under which PettingZoo and gymnasium make the environments."""

import gymnasium
import pettingzoo

RENDEZVOUS_ID = "wifipgo/rendezvous-v0"
TEAM_ID = "wifipgo/RendezvousTeam-v0"


def register_all() -> None:
    """Register what is not registered yet."""
    if hasattr(pettingzoo, "register"):  # 1.27 and newer
        _register_rendezvous()
    if TEAM_ID not in gymnasium.registry:
        gymnasium.register(
            TEAM_ID,
            entry_point="envs._team_env:RendezvousTeamEnv",
            vector_entry_point="envs._team_vector_env:RendezvousTeamVectorEnv",
        )


def _register_rendezvous() -> None:
    if RENDEZVOUS_ID not in pettingzoo.parallel_registry:
        pettingzoo.register("parallel", RENDEZVOUS_ID, entry_point="envs.rendezvous_v0:parallel_env")
    if RENDEZVOUS_ID not in pettingzoo.aec_registry:
        pettingzoo.register("aec", RENDEZVOUS_ID, entry_point="envs.rendezvous_v0:env")
