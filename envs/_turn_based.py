"""The environment one robot after the other, as PettingZoo's AEC interface wants it."""

from collections.abc import Mapping
from typing import Any

from pettingzoo import AECEnv
from pettingzoo.utils.wrappers import BaseWrapper, OrderEnforcingWrapper


class CheckedActionsWrapper(BaseWrapper[str, Any, Any]):
    """Takes and refuses what the parallel form does, in the turn of the robot that it is about.

    Finite numbers outside the space are clipped, of whatever precision; a robot that is out gets None.
    """

    def __init__(self, env: AECEnv[str, Any, Any]) -> None:
        """Wrap."""
        super().__init__(env)

    def step(self, action: Any) -> None:
        """One robot's turn.

        Raises:
            ValueError: Names the agent, the rule and the action got.
        """
        agent = self.env.agent_selection
        if not (self.env.terminations[agent] or self.env.truncations[agent]):
            given: Mapping[str, Any] = {agent: action}
            action = self.env.unwrapped.checked(given, [agent])[0]
        super().step(action)


class InOrderWrapper(OrderEnforcingWrapper[str, Any, Any]):
    """PettingZoo's wrapper for the order of calls, which says what it wraps."""

    def __repr__(self) -> str:
        """What it is and where it stands."""
        return f"{self.unwrapped!r}, one robot after the other"

    def __str__(self) -> str:
        """As PettingZoo's own, which does not name itself."""
        return str(self.env)
