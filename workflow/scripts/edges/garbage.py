"""Let Python look for garbage seldom.

The Snakefile and every script use this module, so it imports only fast modules.
"""

import atexit
import gc

# Number of new objects between two garbage collections. Python's default of 700 suits programs
# that run longer.
_SELDOM = 100_000


def collect_seldom() -> None:
    """Let this process look for garbage seldom, and not at its end.

    A short program makes hardly any garbage that only a collection finds. What its imports have
    made is never garbage, but Python would go through it again and again, and once more at the end.
    """
    gc.freeze()
    gc.set_threshold(_SELDOM)
    atexit.register(gc.freeze)
