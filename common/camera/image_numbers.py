"""The numbers of images in files: read from their names, and told to the host in the camera's name.

A hello has a fixed form: an older host refuses one with a field more. The camera's name is free text, shown to people.
So a replay ends its name with what a host must know: `replay left (16 images, 3 to 18)`. A name without that (an older
board, another camera) tells nothing, and its images count from 0.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

from common.protocol.wire_fields import MAX_TEXT

_DIGITS: Final = re.compile(r"\d+")

MOST_SPAN: Final = 10_000_000
"""Numbers further apart (times of day, say) are not used: at the lowest rate, 0.01 fps, stamps first + number / fps would not fit a message."""

_MOST_DIGITS: Final = 15
"""A longer number does not fit the JSON of a browser, 2**53, and is no count of images."""

_TOLD: Final = re.compile(r" \((\d{1,9}) images?(?:, (\d{1,15}) to (\d{1,15}))?(, looped)?\)\Z")


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
    def words(self) -> str:
        """For people: `16 images, 3 to 18`."""
        images = "1 image" if self.count == 1 else f"{self.count} images"
        return images if self.first is None else f"{images}, {self.first} to {self.last}"


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
    different in all names, and of several such numbers it runs through the fewest values: a time of day leaves more out
    than a counter does. Of two alike it is the last one. `stereo` and `calibrate` see both sides and take the place that
    pairs most, which is the same place unless the two sides are numbered in different ways; a camera sees only its own.

    Args:
        stems: file names without suffix, of different images.

    Returns:
        A number for each; empty if they are not numbered, and for a single image: its number tells it from nothing.
    """
    if len(stems) < 2:
        return ()
    found = [_DIGITS.findall(stem) for stem in stems]
    best: tuple[int, ...] = ()
    for place in range(1, 1 + min(map(len, found))):
        texts = [digits[-place] for digits in found]
        if any(len(text.lstrip("0")) > _MOST_DIGITS for text in texts):
            continue
        numbers = tuple(int(text) for text in texts)
        if len(set(numbers)) == len(numbers) and _span(numbers) < (_span(best) if best else MOST_SPAN):
            best = numbers
    return best


def _span(numbers: Sequence[int]) -> int:
    return max(numbers) - min(numbers)


def with_numbers(name: str, images: ImageNumbers) -> str:
    """Return a camera's name that tells of its images, short enough for a hello."""
    told = f" ({images.words}{', looped' if images.looped else ''})"
    return name[: MAX_TEXT - len(told)] + told


def numbers_told(name: str) -> ImageNumbers | None:
    """Read back what `with_numbers` has told; None if the name tells nothing, or what cannot be true."""
    found = _TOLD.search(name)
    if not found:
        return None
    count, looped = int(found[1]), bool(found[4])
    if found[2] is None:
        return ImageNumbers(count=count, looped=looped) if count else None
    first, last = int(found[2]), int(found[3])
    if not 1 <= count <= last - first + 1 <= MOST_SPAN:
        return None
    return ImageNumbers(count=count, first=first, last=last, looped=looped)


def plain_camera(name: str) -> str:
    """Return a camera's name without what it tells of its images."""
    return _TOLD.sub("", name)
