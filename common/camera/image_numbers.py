"""The numbers of images in files: read from their names, and told to the host in the camera's name.

A hello has a fixed form: an older host refuses one with a field more. The camera's name is free text, shown to people.
So a replay ends its name with what a host must know: `replay left (16 images, 3 to 18)`. A name without that (an older
board, another camera) tells nothing, and its images count from 0.

Numbers that are times (`1403715273262142976`, ns) are told apart from these: `replay left [1403715273262142976 to
1403715274362143685] (12 images)`. An older host reads only the count, and pairs such images in their order as before.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

from common.name_order import DIGITS
from common.protocol.wire_fields import MAX_TEXT

MOST_SPAN: Final = 10_000_000
"""Numbers further apart are times: at the lowest rate, 0.01 fps, stamps first + number / fps would not fit a message."""

MOST_COUNTED: Final = 10**15
"""Larger numbers are times as well: they do not fit the JSON of a browser, 2**53, and count no images."""

TIMES_RING: Final = 2**59
"""The label of an image numbered by a time is that number modulo this, which tells numbers no further apart without doubt.

In ns it is 18 years. Hosts since 0.1 refuse labels from 2**60 on."""

_MOST_DIGITS: Final = 19
"""2**63 has as many."""

_TOLD: Final = re.compile(
    r"(?: \[(\d{1,19}) to (\d{1,19})\])? \((\d{1,9}) images?(?:, (\d{1,15}) to (\d{1,15}))?(, looped)?\)\Z"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageNumbers:
    """What a replay says about its images.

    Attributes:
        count: how many there are, at least 1.
        first: the least number in their names; None if the names do not number them.
        last: the greatest number; None as well.
        looped: whether the first one follows the last one.
    """

    count: int
    first: int | None = None
    last: int | None = None
    looped: bool = False

    @property
    def has_gaps(self) -> bool:
        """Whether some number between the first and the last is missing."""
        return self.first is not None and self.last is not None and self.last - self.first + 1 != self.count

    @property
    def are_times(self) -> bool:
        """Whether the numbers are too large or too far apart to count images."""
        return self.first is not None and self.last is not None and _are_times(self.first, self.last)

    @property
    def words(self) -> str:
        """For people: `16 images, 3 to 18`; times are left out."""
        images = "1 image" if self.count == 1 else f"{self.count} images"
        return images if self.first is None or self.are_times else f"{images}, {self.first} to {self.last}"


@runtime_checkable
class ShowsFiles(Protocol):
    """A camera whose images are files.

    Attributes:
        images: what its description tells of them.
        numbers: their numbers, in the order of showing; empty if their names do not number them.
    """

    images: ImageNumbers
    numbers: tuple[int, ...]


def numbers_of(stems: Sequence[str]) -> tuple[int, ...]:
    """Read the number of each image from its file name.

    A name may hold more than one number (`cam0_0012`, `0012_cam1`, `cam0_0012_120530`). The one that counts the images is
    different in all names, fits 63 bits, and of several such numbers runs through the fewest values: a time of day leaves
    more out than a counter does. Of two alike it is the last one. `stereo` and `calibrate` see both sides and take the place that
    pairs most, which is the same place unless the two sides are numbered in different ways; a camera sees only its own.

    Args:
        stems: file names without suffix, of different images.

    Returns:
        A number for each; empty if they are not numbered, and for a single image: its number tells it from nothing.
    """
    if len(stems) < 2:
        return ()
    found = [DIGITS.findall(stem) for stem in stems]
    best: tuple[int, ...] = ()
    for place in range(1, 1 + min(map(len, found))):
        texts = [digits[-place] for digits in found]
        if any(len(text.lstrip("0")) > _MOST_DIGITS for text in texts):
            continue
        numbers = tuple(int(text) for text in texts)
        if max(numbers) >= 2**63 or len(set(numbers)) < len(numbers):
            continue
        if _span(numbers) < (_span(best) if best else TIMES_RING):
            best = numbers
    return best


def _are_times(first: int, last: int) -> bool:
    return last - first >= MOST_SPAN or last >= MOST_COUNTED


def _span(numbers: Sequence[int]) -> int:
    return max(numbers) - min(numbers)


def with_numbers(name: str, images: ImageNumbers) -> str:
    """Return a camera's name that tells of its images, short enough for a hello."""
    times = f" [{images.first} to {images.last}]" if images.are_times else ""
    told = f"{times} ({images.words}{', looped' if images.looped else ''})"
    return name[: MAX_TEXT - len(told)] + told


def numbers_told(name: str) -> ImageNumbers | None:
    """Read back what `with_numbers` has told; None if the name tells nothing, or what cannot be true."""
    found = _TOLD.search(name)
    if not found:
        return None
    count, looped = int(found[3]), bool(found[6])
    of_times = found[1] is not None and found[4] is None
    if found[4] is None and not of_times:
        return ImageNumbers(count=count, looped=looped) if count else None
    first, last = (int(found[1]), int(found[2])) if of_times else (int(found[4]), int(found[5]))
    if not 1 <= count <= last - first + 1 <= TIMES_RING or last >= 2**63 or _are_times(first, last) is not of_times:
        return None
    return ImageNumbers(count=count, first=first, last=last, looped=looped)


def plain_camera(name: str) -> str:
    """Return a camera's name without what it tells of its images."""
    return _TOLD.sub("", name)
