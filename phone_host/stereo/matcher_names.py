"""The names of the matchers, ours and those of other packages. Light, because settings and help need the names but not the algorithms."""

from dataclasses import dataclass
from enum import Enum
from typing import Final

from common.errors import SettingsError
from common.program.extensions import registered_names
from phone_host.stereo.network_name import PREFIX, NetworkMatcher, network_named

MATCHERS: Final = "tandemscan.matchers"
"""Entry points of other packages' matchers; see `match`."""


class MatcherName(Enum):
    """The matchers by the name a user types.

    BLOCK is the paper's: 8 x 8 sum of absolute differences, winner takes all. SGBM is semi-global matching, the default.
    """

    BLOCK = "block"
    SGBM = "sgbm"


@dataclass(frozen=True, slots=True)
class RegisteredMatcher:
    """A matcher that an installed package registers.

    Attributes:
        value: the name under which it is registered.
    """

    value: str


AnyMatcher = MatcherName | RegisteredMatcher | NetworkMatcher


def matcher_named(text: str) -> AnyMatcher:
    """Find the matcher that a user names, without loading it: ours, another package's, or a network's file.

    Args:
        text: the name.

    Raises:
        SettingsError: no matcher has that name, or an option of a network makes no sense.
    """
    if text.startswith(PREFIX):
        return network_named(text)
    own = [name.value for name in MatcherName]
    if text in own:
        return MatcherName(text)
    registered = registered_names(MATCHERS)
    if text in registered:
        return RegisteredMatcher(text)
    raise SettingsError(f"matcher {text!r} is unknown", f"give {' or '.join((*own, *registered))}, or onnx:PATH")
