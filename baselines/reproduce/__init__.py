"""The paper's figures and claims, regenerated and judged: ``wifipgo reproduce --help``."""

from wifipgo.command import figures as figures  # before all that loads matplotlib
