"""Products too small for a number are zero, and no error, whatever the caller told numpy to do then."""

import numpy as np

# For functions whose arithmetic may underflow without harm. ``np.seterr(all="raise")``, with which users find
# faults in programs of their own, would end them; overflow and nan still do.
harmless_underflow = np.errstate(under="ignore")
