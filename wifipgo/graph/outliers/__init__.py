"""What guards an optimisation against outliers: weights by direction, PCM, the table of methods."""

from typing import TYPE_CHECKING

from wifipgo.former_names import of_face

if not TYPE_CHECKING:
    __getattr__ = of_face(__name__)
