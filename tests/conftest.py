"""Settings for the whole suite: repeatable examples, no deadlines, no screen."""

import matplotlib as mpl
from hypothesis import settings

mpl.use("Agg")
settings.register_profile("wifipgo", deadline=None, derandomize=True)
settings.load_profile("wifipgo")
