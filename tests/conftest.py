"""Settings for the whole suite: repeatable examples, no deadlines, no screen."""

import signal

import matplotlib as mpl
from hypothesis import settings
from support import typed_calls

mpl.use("Agg")
typed_calls.install()
# In the background Ctrl-C is ignored, which the commands under test would inherit.
signal.signal(signal.SIGINT, signal.default_int_handler)
settings.register_profile("wifipgo", deadline=None, derandomize=True)
settings.load_profile("wifipgo")
