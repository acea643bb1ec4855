"""Which images of one camera have another size than most of them. Pure."""

from collections import Counter
from collections.abc import Sequence

Size = tuple[int, int]


def usual_size(sizes_px: Sequence[Size | None]) -> Size | None:
    """Return the size that most images have, the first of those that are equally frequent.

    Args:
        sizes_px: width and height of each image, px; None: not known.

    Returns:
        The size; None: no size is known.
    """
    counts = Counter(size for size in sizes_px if size is not None)
    return max(counts, key=counts.__getitem__, default=None)
