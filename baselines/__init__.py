"""Scripted policies, and the program that compares them: ``python -m baselines.evaluate``."""

import sys

if sys.argv[:1] == ["-m"]:  # a command is about to load: Ctrl-C ends it without a traceback
    import wifipgo.command.early_interrupts  # noqa: F401
