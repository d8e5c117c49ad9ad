"""Scripted policies, and the program that compares them: ``wifipgo evaluate``."""

import sys

try:  # first: Ctrl-C ends a command that loads; and names of packages may be taken by others
    from wifipgo.command.own_packages import check_floors
except ImportError as problem:
    shadow = getattr(sys.modules.get("wifipgo"), "__file__", None) or "another package"
    advice = "rename it, or work in another folder"
    raise ImportError(f"{shadow} shadows the package 'wifipgo': {advice}") from problem

check_floors("wifipgo", "envs")
