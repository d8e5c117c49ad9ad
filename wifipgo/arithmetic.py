"""Floating point as this package was written for, whatever ``numpy.seterr`` says in the program around it."""

import numpy as np

# Tails of likelihoods and of weights underflow to 0 by design; everything else is a fault and warns, as
# numpy does by itself. A decorator at the entrances: one call of it costs less than a microsecond.
plain_arithmetic = np.errstate(divide="warn", over="warn", under="ignore", invalid="warn")
# For functions of the library whose arithmetic may underflow without harm: users find faults in programs of
# their own with ``np.seterr(all="raise")``, which still ends what overflows or is not a number.
harmless_underflow = np.errstate(under="ignore")
