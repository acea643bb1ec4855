"""Computes one pair of image files and refuses what cannot be right. For `measure` and `relief`."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from common import now
from common.errors import DataError, SettingsError
from common.orientation import Orientation
from phone_host.measure.trust import Concern
from phone_host.model import Processed
from phone_host.run.stereo_job import Watcher
from phone_host.run.stereo_trust import judge_pair
from phone_host.stereo.core import StereoCore
from phone_host.stereo.images import decode_files, open_image, require_same_size

Size = tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class PairJob:
    """What to compute.

    Attributes:
        left: image file of the left camera.
        right: image file of the right camera.
        make_core: makes the stereo core for images of this size (width and height of the left one, px).
        most_pixels: an image that claims more is refused.
        mounted: by which turns the images become upright, after what their EXIF headers say.
    """

    left: Path
    right: Path
    make_core: Callable[[Size], StereoCore]
    most_pixels: int
    mounted: tuple[Orientation, Orientation]


@dataclass(frozen=True, slots=True, eq=False)
class ComputedPair:
    """A pair with depth.

    Attributes:
        core: what computed it.
        processed: it, with geometry.
        concerns: reasons not to trust it that do not rule it out.
    """

    core: StereoCore
    processed: Processed
    concerns: tuple[Concern, ...]


def compute_pair(job: PairJob, watcher: Watcher, check: Callable[[Size], None] = lambda _size_px: None) -> ComputedPair:
    """Compute a pair.

    Args:
        job: what to compute.
        watcher: is told how far it is.
        check: looks at the left image's width and height, px, before anything is computed.

    Raises:
        SettingsError: there is no focal length or no baseline.
        DataError: the pair cannot be computed, or cannot be right.
    """
    watcher.say("reading")
    opened = tuple(
        open_image(path, job.most_pixels, turn) for path, turn in zip((job.left, job.right), job.mounted, strict=True)
    )
    left_px, right_px = (image.size_px for image in opened)
    check(left_px)
    core = job.make_core(left_px)
    if core.rig is None:
        require_same_size(left_px, right_px, str(job.left), str(job.right))
    core.require_sizes(left_px, right_px)
    images = decode_files(opened[0], opened[1], core.reductions(left_px, right_px))
    watcher.say("matching")
    processed = core.compute(*images, now.monotonic_ns, whole_px=(left_px, right_px))
    if processed.geometry is None:
        raise SettingsError("there are no millimetres without focal length and baseline", "give --calibration")
    watcher.say("checking")
    concerns = judge_pair(core, processed, job.mounted).concerns
    blocking = next((concern for concern in concerns if concern.doubt.blocks), None)
    if blocking is not None:
        why = f"these images cannot be measured, because {blocking.sentence} ({blocking.remedy})"
        raise DataError(why, "mend that, then try again")
    return ComputedPair(core, processed, concerns)
