"""Images from files and from encoded bytes, decoded by OpenCV and converted to 8-bit grey or BGR.

Rules:
- files and streamed frames take the same path, so that both give the same bits;
- nothing is decoded before its header was read: an image that claims more pixels than the limit is refused (see
  `common/imagesize`);
- an image is upright as soon as it is decoded: what its EXIF header says is applied, then what the user says of its
  camera. A rig belongs to upright images (decision 0032);
- images deeper than 8 bit: both images of a pair get the same scale, or the matcher would see two brightnesses (see
  `eight_bit.py`).
"""

import logging
import re
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from common.errors import DataError
from common.files import read_whole
from common.frame import FrameFault, ImageSizeError, SpoiledImageError
from common.imagesize.head import MOST_PIXELS, ImageHead, ImageKind, require_believable
from common.imagesize.head import size_text as px_text
from common.imagesize.read import read_head, whole_image
from common.orientation import UPRIGHT, Orientation
from common.program.logs import event
from common.program.out_of_memory import is_out_of_memory, noted_if_out_of_memory
from phone_host.model import Image
from phone_host.stereo.eight_bit import AnyImage, to_8_bit, upright
from phone_host.stereo.overheard import overhear
from phone_host.stereo.two_threads import in_two_threads

_LOG = logging.getLogger(__name__)

_REPLACE: Final = "copy or record the image again"

_CORRUPT: Final = ("Corrupt JPEG data", "Premature end of JPEG file", "Inconsistent progression sequence")
"""How those libjpeg warnings begin that mean wrong pixels (jerror.h)."""

_TALK: Final = ("Corrupt JPEG data", "Warning: unknown JFIF", "Unknown Adobe color", "Invalid SOS parameters", "libpng")
"""How harmless messages of image libraries begin."""

_EXTRA_BYTES: Final = re.compile(r"(\d+) extraneous bytes before marker 0x([0-9a-f]{2})")
_BEHIND_DATA: Final = frozenset({0xC4, 0xD9, 0xDA, 0xDD, *range(0xD0, 0xD8)})
_BYTES_A_PIXEL: Final = 8
_MORE_BYTES: Final = 64 << 20
"""No image file is longer than four channels of 16 bit plus this; phones append films and depth maps to a JPEG."""

WHOLE: Final = (1, 1)
"""Neither image of a pair is decoded smaller than it is stored."""

_REDUCED: Final = {
    factor: flag | cv2.IMREAD_ANYCOLOR | cv2.IMREAD_IGNORE_ORIENTATION
    for factor, flag in (
        (2, cv2.IMREAD_REDUCED_GRAYSCALE_2),
        (4, cv2.IMREAD_REDUCED_GRAYSCALE_4),
        (8, cv2.IMREAD_REDUCED_GRAYSCALE_8),
    )
}
"""How OpenCV is told to decode a JPEG smaller: its blocks of 8 x 8 values become 4 x 4, 2 x 2 or 1, so most of the work
is never done. With ANYCOLOR, "grey" in the flag's name does not hold: coloured images stay so."""

_END: Final = 0xD9
_HARMLESS_BYTES: Final = 16
_HARMLESS_BEFORE_END: Final = 48
"""Webcams are known to leave 1 to 10 bytes before restart markers (pupil-labs/pupil, issue 1816) and padding before the
end. In 1500 images with one flipped bit each, the decoder was left with 64 bytes or more before the end, and with at
most 8 before restart markers in 1 of 23 (decision 0021)."""


@dataclass(frozen=True, slots=True)
class EncodedFile:
    """An image file's bytes, with its header read and its size within the limit.

    Attributes:
        payload: all bytes of the file.
        head: what its header says.
        name: how error messages call it.
        mounted: how its camera is mounted; applied after what the header says.
    """

    payload: bytes
    head: ImageHead
    name: str
    mounted: Orientation = UPRIGHT

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the upright image, px."""
        return self.mounted.turned_size(self.head.upright_px)


def decode(payload: bytes | memoryview, name: str = "the image", most_pixels: int = MOST_PIXELS) -> Image:
    """Decode one encoded image (JPEG, PNG, ...) to 8 bit.

    Returns:
        (H, W) grey or (H, W, 3) BGR, uint8.

    Raises:
        ImageSizeError: it claims more pixels than that.
        SpoiledImageError: the bytes are spoiled or of no known kind.
    """
    return decode_file(examine(payload, name, most_pixels))


def decode_file(image: EncodedFile, reduction: int = 1) -> Image:
    """Decode one examined image, like `decode`; smaller like `decode_files`."""
    return _upright(to_8_bit((_decoded(image, reduction),))[0], image)


def decode_files(left: EncodedFile, right: EncodedFile, reductions: tuple[int, int] = WHOLE) -> tuple[Image, Image]:
    """Decode the two examined images of a pair, with one common scale where they are deeper than 8 bit.

    Args:
        left: the left image.
        right: the right image.
        reductions: by how much each may be smaller than it is stored, as `Rectifier.reductions` gives them. Images that
            cannot be decoded smaller are decoded whole.
    """
    both = _decoded_at_once(left, right, reductions) or (_decoded(left, reductions[0]), _decoded(right, reductions[1]))
    first, second = to_8_bit(both)
    return _upright(first, left), _upright(second, right)


def _upright(image: Image, file: EncodedFile) -> Image:
    return upright(upright(image, file.head.orientation), file.mounted)


def examine(payload: bytes | memoryview, name: str, most_pixels: int = MOST_PIXELS) -> EncodedFile:
    """Read the header of an encoded image; nothing is decoded.

    Raises:
        ImageSizeError: it claims more pixels than that.
        SpoiledImageError: it is of no known kind, or its header cannot be believed.
    """
    content = bytes(payload)
    head = read_head(content, name)
    require_believable(head, most_pixels, name)
    return EncodedFile(content, head, name)


def open_image(path: Path, most_pixels: int = MOST_PIXELS, mounted: Orientation = UPRIGHT) -> EncodedFile:
    """Read an image file's bytes and header; nothing is decoded.

    Args:
        path: the file.
        most_pixels: an image that claims more is refused.
        mounted: how its camera is mounted; applied after what the file's header says.

    Raises:
        DataError: the file is missing; see also `examine`.
    """
    try:
        content = read_whole(path, _BYTES_A_PIXEL * most_pixels + _MORE_BYTES)
    except IsADirectoryError as error:
        raise DataError(f"{path} is a folder", "give an image in it") from error
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror})", "give an image file that exists") from error
    return replace(examine(content, str(path), most_pixels), mounted=mounted)


def require_same_size(left_px: tuple[int, int], right_px: tuple[int, int], left_name: str, right_name: str) -> None:
    """Check that two images can be a rectified pair.

    Args:
        left_px: width and height of the left image, px.
        right_px: width and height of the right image, px.
        left_name: how error messages call the left image.
        right_name: how error messages call the right image.

    Raises:
        DataError: their sizes differ.
    """
    if left_px == right_px:
        return
    differ = f"{left_name} is {px_text(left_px)} px, {right_name} is {px_text(right_px)} px"
    if left_px == right_px[::-1]:
        raise DataError(
            f"{differ}: one of the two lies on its side",
            "turn it upright: --rotate-left 90 or 270, or --rotate-right 90 or 270; for a camera, rotate=90 or 270 in its address",
        )
    raise DataError(differ, "a rectified pair has one size; for two unlike cameras give --calibration rig.yaml")


def size_px(image: AnyImage) -> tuple[int, int]:
    """Return width and height of an image, px."""
    return image.shape[1], image.shape[0]


def size_text(image: AnyImage) -> str:
    """Return width and height of an image as people write it, such as 640x480."""
    return px_text(size_px(image))


def to_grey(image: Image) -> Image:
    """Convert an image to grey.

    Args:
        image: (H, W) grey or (H, W, 3) BGR, uint8.

    Returns:
        (H, W) uint8.
    """
    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _scaled_by(image: EncodedFile, reduction: int) -> int:
    """Return by how much an image is decoded smaller: JPEG only, and where no block of pixels is cut at an edge."""
    width, height = image.head.size_px
    fits = image.head.kind is ImageKind.JPEG and reduction in _REDUCED and not (width % reduction or height % reduction)
    return reduction if fits else 1


def _decoded_at_once(
    left: EncodedFile, right: EncodedFile, reductions: tuple[int, int]
) -> tuple[AnyImage, AnyImage] | None:
    """Decode two images in two threads: OpenCV lets go of Python's lock meanwhile.

    Returns:
        Both; None unless all is well with both. Then each must be decoded alone, to tell which of them the trouble
        comes from: libraries print without a name.
    """
    payloads = tuple(whole_image(image.payload, image.head, image.name) for image in (left, right))
    scales = _scaled_by(left, reductions[0]), _scaled_by(right, reductions[1])
    found: list[AnyImage | None] = [None, None]

    def decode_one(side: int) -> None:
        with suppress(cv2.error):
            payload = np.frombuffer(payloads[side], dtype=np.uint8)
            found[side] = cv2.imdecode(payload, _REDUCED.get(scales[side], cv2.IMREAD_UNCHANGED))

    said = overhear(lambda: in_two_threads(lambda: decode_one(0), lambda: decode_one(1)))
    first, second = found
    if said or first is None or second is None:
        return None
    return _checked(first, left, scales[0]), _checked(second, right, scales[1])


def _decoded(image: EncodedFile, reduction: int) -> AnyImage:
    name, kind, scale = image.name, image.head.kind, _scaled_by(image, reduction)
    flags = _REDUCED.get(scale, cv2.IMREAD_UNCHANGED)
    payload = np.frombuffer(whole_image(image.payload, image.head, name), dtype=np.uint8)
    found: list[AnyImage | None] = []
    try:
        with noted_if_out_of_memory(f"{name} of {px_text(image.head.size_px)} px"):
            said = overhear(lambda: found.append(cv2.imdecode(payload, flags)))
    except cv2.error as error:
        if is_out_of_memory(error):  # the image is sound
            raise
        raise SpoiledImageError(FrameFault.CORRUPT, f"{name} cannot be decoded ({error.err})", _REPLACE) from error
    [decoded] = found
    if decoded is None:
        raise SpoiledImageError(FrameFault.CORRUPT, f"{name} is no {kind.value} image or spoiled", _REPLACE)
    complaint = _complaint(said.splitlines())
    if kind is ImageKind.JPEG and complaint:
        raise SpoiledImageError(FrameFault.CORRUPT, f"{name} is spoiled ({complaint})", _REPLACE)
    return _checked(decoded, image, scale)


def _checked(decoded: AnyImage, image: EncodedFile, scale: int) -> AnyImage:
    """Return a decoded image as grey or BGR, of the size that its header claims, divided by `scale`."""
    width, height = size_px(decoded)
    if (width * scale, height * scale) != image.head.size_px:
        raise ImageSizeError(
            FrameFault.OTHER_SIZE,
            f"{image.name} is {size_text(decoded)} px, its header says {px_text(image.head.size_px)}",
            _REPLACE,
        )
    if decoded.ndim == 3:
        # Three dimensions with one or two channels: grey (and alpha). With four: BGR and alpha.
        return decoded[..., 0] if decoded.shape[2] < 3 else np.ascontiguousarray(decoded[..., :3])
    return decoded


def _complaint(said: list[str]) -> str:
    """Return the JPEG decoder's message that means wrong pixels; empty if there is none, or only harmless ones.

    libjpeg prints only the first warning of an image. Harmless are odd version numbers and scan parameters, and
    extraneous bytes before a marker: any number between segments, and a few after compressed data, as webcams leave
    there. A decoder that has lost its place leaves more.
    """
    for line in said:
        if line.startswith(_CORRUPT) and not _is_harmless(line):
            return line
        tell = _LOG.debug if line.startswith(_TALK) else _LOG.warning  # another library, in another thread
        tell(event("library_said", text=line))
    return ""


def _is_harmless(warning: str) -> bool:
    found = _EXTRA_BYTES.search(warning)
    if found is None:
        return False
    count, marker = int(found[1]), int(found[2], 16)
    return marker not in _BEHIND_DATA or count <= (_HARMLESS_BEFORE_END if marker == _END else _HARMLESS_BYTES)


def require_same_shape(image_px: tuple[int, int], asked_px: tuple[int, int], name: str) -> None:
    """Check that a camera's image shows the whole view: it has the size that was asked for, or the same shape with fewer pixels.

    Args:
        image_px: its width and height, px.
        asked_px: width and height that the camera was asked for, px.
        name: how error messages call it.

    Raises:
        ImageSizeError: it is larger, or of another shape and so can show only a part of the view.
    """
    (width, height), (asked_width, asked_height) = image_px, asked_px
    if width > asked_width or height > asked_height:
        raise ImageSizeError(
            FrameFault.TOO_LARGE,
            f"{name} is {px_text(image_px)} px, its camera was asked for {px_text(asked_px)}",
            "check the camera that sends it",
        )
    if width * asked_height != height * asked_width:
        raise ImageSizeError(
            FrameFault.OTHER_SIZE,
            f"{name} is {px_text(image_px)} px, its camera was asked for {px_text(asked_px)}, another shape",
            "leave size out of the board's setting adapt",
        )


def enlarged(image: Image, asked_px: tuple[int, int], name: str) -> Image:
    """Enlarge an image that a camera sent smaller. It shows the same view; each of its pixels is the mean of several of the larger image.

    Args:
        image: (H, W) or (H, W, 3), uint8.
        asked_px: the wanted (width, height), px; edges of pixels coincide, not centres, as with `cv2.resize`.
        name: how error messages call it.

    Returns:
        The enlarged image, or the image itself if it already has that size.

    Raises:
        ImageSizeError: it is larger or has another shape.
    """
    if size_px(image) == asked_px:
        return image
    require_same_shape(size_px(image), asked_px, name)
    return np.asarray(cv2.resize(image, asked_px, interpolation=cv2.INTER_LINEAR), dtype=np.uint8)
