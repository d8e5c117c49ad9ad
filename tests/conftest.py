"""Settings for the whole suite: repeatable examples, no deadlines, no screen."""

import multiprocessing
import signal

import matplotlib as mpl
import pytest
from hypothesis import settings
from support import ready_processes, typed_calls

mpl.use("Agg")
typed_calls.install()
ready_processes.install()
# In the background Ctrl-C is ignored, which the commands under test would inherit.
signal.signal(signal.SIGINT, signal.default_int_handler)
settings.register_profile("wifipgo", deadline=None, derandomize=True)
settings.load_profile("wifipgo")


@pytest.fixture
def spawned(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets processes of this test load all that they need themselves, as those of users do."""
    monkeypatch.setattr(multiprocessing, "get_context", ready_processes.as_ever)
