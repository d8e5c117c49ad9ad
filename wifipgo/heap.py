"""Memory that arrays free, kept for the next ones."""

import numpy as np

# glibc learns from what is freed how much to keep, up to this much; see mallopt(3), M_MMAP_THRESHOLD.
_MOST_LEARNED = 2**25 - 2**13


def keep_freed_memory() -> None:
    """Let the C library keep what arrays free instead of giving it back to the system.

    Arrays of some 100 kB, of which a step of many worlds makes hundreds, are else mapped, faulted in page by
    page and unmapped again each time, which takes longer than what is done with them. The array that teaches
    it is never touched, so it takes no memory; other C libraries learn nothing from it.
    """
    np.empty(_MOST_LEARNED, np.uint8)
