"""Public module of the environment, by PettingZoo's custom: ``parallel_env``, ``env``, ``raw_env``."""

from typing import Any

from pettingzoo import AECEnv
from pettingzoo.utils.conversions import parallel_to_aec_wrapper

from envs._autoreset import Turn, step_and_reset
from envs._observation import Field, layout, observe
from envs._playing import OBSERVATIONS
from envs._rendezvous import RendezvousEnv
from envs._reward import REWARDS
from envs._snapshot import EpisodeSnapshot
from envs._spaces import by_name
from envs._team_env import RendezvousTeamEnv
from envs._team_vector_env import RendezvousTeamVectorEnv
from envs._turn_based import CheckedActionsWrapper, InOrderWrapper
from envs._vector import RESET_MASK, RendezvousVectorEnv, flat_vector_env, vector_env
from envs._vector_results import Buffers, VectorStep
from envs.directions import N_BINS, bin_azimuths

parallel_env = RendezvousEnv


def raw_env(**kwargs: Any) -> AECEnv[str, Any, Any]:
    """The environment through the AEC interface, without checks; arguments of `parallel_env`."""
    return InOrderWrapper(parallel_to_aec_wrapper(parallel_env(**kwargs)))


def env(**kwargs: Any) -> AECEnv[str, Any, Any]:
    """The environment through the AEC interface, with checks of order and actions."""
    return InOrderWrapper(CheckedActionsWrapper(raw_env(**kwargs)))


__all__ = [
    "N_BINS",
    "OBSERVATIONS",
    "RESET_MASK",
    "REWARDS",
    "Buffers",
    "EpisodeSnapshot",
    "Field",
    "RendezvousEnv",
    "RendezvousTeamEnv",
    "RendezvousTeamVectorEnv",
    "RendezvousVectorEnv",
    "Turn",
    "VectorStep",
    "bin_azimuths",
    "by_name",
    "env",
    "flat_vector_env",
    "layout",
    "observe",
    "parallel_env",
    "raw_env",
    "step_and_reset",
    "vector_env",
]
