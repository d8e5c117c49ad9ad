"""What robots send each other, counted: bytes, messages, losses, delays."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from wifipgo.errors import require

PACKET_S = 1e-4  # preamble, pauses and acknowledgement of a packet of 802.11n


class Message(NamedTuple):
    """Values of the sender's poses that the receiver has measurements of.

    Attributes:
        sender: Number of the robot.
        stage: What the values are of.
        stamp: Round in which they were found; 0 is before the first.
        values: One block a pose, in an order that both ends know.
    """

    sender: int
    stage: str
    stamp: int
    values: Float[np.ndarray, "poses k c"]


class Channel:
    """Carries messages between robots, and may lose or delay them.

    A message that is not acknowledged is sent again, up to ``attempts`` times in all; every
    time counts. Then it is lost, and the receiver goes on with what it had.

    Attributes:
        bytes_sent: Of the values in all messages, those lost and those sent again among them.
        n_sent: Messages sent.
        n_lost: Messages that did not arrive.
        airtime_s: That messages took, one after another, where rates of links are known.
        delay_rounds: Rounds that a message takes.
    """

    def __init__(
        self,
        *,
        loss: float = 0.0,
        attempts: int = 3,
        delay_rounds: int = 0,
        rng: np.random.Generator | None = None,
        rate_mbit_s: Callable[[int, int], float] | None = None,
    ) -> None:
        """Open the channel.

        Args:
            loss: Probability that a message does not arrive.
            attempts: How often a message is sent until it arrives.
            delay_rounds: Rounds that a message takes; 0 arrives at once.
            rng: Chance of losses; needed if there are any.
            rate_mbit_s: Of the link from one robot to another, > 0: what a message costs in time.
        """
        require(0.0 <= loss <= 1.0, "loss", "in [0, 1]", loss)
        require(attempts >= 1, "attempts", ">= 1", attempts)
        require(delay_rounds >= 0, "delay_rounds", ">= 0", delay_rounds)
        require(loss == 0.0 or rng is not None, "rng", "given where messages may be lost", rng)
        self._attempts, self.delay_rounds = attempts, delay_rounds
        self._arrives: Callable[[], bool] = lambda: rng is None or bool(rng.random() >= loss)
        self._rate_mbit_s, self.airtime_s = rate_mbit_s, 0.0
        self._waiting: dict[int, list[tuple[int, Message]]] = {}
        self.bytes_sent = self.n_sent = self.n_lost = self.now = 0

    def send(self, receiver: int, message: Message) -> bool:
        """Send, again if need be; whether it arrives, which the sender knows by the acknowledgement."""
        for _ in range(self._attempts):
            self.bytes_sent += message.values.nbytes
            self.n_sent += 1
            if self._rate_mbit_s is not None:
                mbit_s = self._rate_mbit_s(message.sender, receiver)
                self.airtime_s += PACKET_S + 8e-6 * message.values.nbytes / mbit_s
            if self._arrives():
                self._waiting.setdefault(receiver, []).append((self.now + self.delay_rounds, message))
                return True
            self.n_lost += 1
        return False

    def collect(self, receiver: int) -> list[Message]:
        """Messages that have arrived since the receiver last looked, oldest first."""
        waiting = self._waiting.pop(receiver, [])
        later = [(due, message) for due, message in waiting if due > self.now]
        if later:
            self._waiting[receiver] = later
        return [message for due, message in waiting if due <= self.now]
