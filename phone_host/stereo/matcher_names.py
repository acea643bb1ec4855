"""The matchers by name. Light: settings and help need the names, not the algorithms."""

from enum import Enum


class MatcherName(Enum):
    """The matchers by the name a user types.

    BLOCK is the paper's: 8 x 8 sum of absolute differences, winner takes all. SGBM is semi-global matching, the default.
    """

    BLOCK = "block"
    SGBM = "sgbm"
