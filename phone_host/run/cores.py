"""The stereo core for images of any size: made when the first pair's size is known, and kept."""

from collections.abc import Callable

from common.errors import DataError, SettingsError
from phone_host.stereo.core import StereoCore
from phone_host.stereo.images import EncodedFile, require_same_size

Size = tuple[int, int]


class Cores:
    """Makes as few cores as possible.

    Attributes:
        has_none: whether none can be made, so that no pair can be computed.

    Args:
        make: makes the stereo core for images of this size (width and height of the left one, px).
    """

    def __init__(self, make: Callable[[Size], StereoCore]) -> None:
        self._make = make
        self._core: StereoCore | None = None
        self._size_px: Size = (0, 0)
        self.has_none = False

    def for_pair(self, left: EncodedFile, right: EncodedFile) -> StereoCore:
        """Return the core for these images; refuse images that it cannot take, before they are decoded.

        Raises:
            DataError: they do not fit it, or none can be made.
            SettingsError: the crop lies outside of them, or none can be made so.
        """
        is_rectified = self._core is not None and self._core.rig is None
        if self._core is None or (is_rectified and left.size_px != self._size_px):
            try:
                made = self._make(left.size_px)
            except (DataError, SettingsError):
                self.has_none = self._core is None
                raise
            self._core, self._size_px = made, left.size_px
        if self._core.rig is None:
            require_same_size(left.size_px, right.size_px, left.name, right.name)
        self._core.require_sizes(left.size_px, right.size_px)
        return self._core
