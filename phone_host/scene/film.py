"""Renders a scene into two folders of JPEGs, one for each camera of a rig, for replay in a loop; knows which image shows when."""

import errno
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2

from common.camera.imagefile import SUFFIXES
from common.errors import UnavailableError
from common.places import make_folder
from phone_host.model import CameraModel, Image, Rig
from phone_host.output.atomic import write_bytes
from phone_host.scene.scene_model import Look, Scene, rig_poses
from phone_host.scene.scene_render import Renderer

JPEG_QUALITY: Final = 92
"""Below 90, compression artefacts degrade the matcher's result (study of the stereo core, 3.5b)."""

_NS: Final = 1_000_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Film:
    """Images of both cameras, taken at the same moments.

    Attributes:
        left: folder of the left camera's images.
        right: folder of the right camera's images.
        frames: images in each.
        fps: images per second.
    """

    left: Path
    right: Path
    frames: int
    fps: int

    def index_at(self, exposed_ns: int) -> int:
        """Return the number of the image that a replay (`loop=1`, `pace=clock`) exposes nearest to a time of CLOCK_MONOTONIC, ns."""
        return round(exposed_ns * self.fps / _NS) % self.frames

    def scene_at(self, scene: Scene, index: int) -> Scene:
        """Return the scene as that image shows it."""
        return scene.at(index / self.fps)

    def replay_uri(self, folder: Path) -> str:
        """Return the camera URI of one of the folders."""
        return f"replay:{folder}?fps={self.fps}&loop=1"


def render_film(
    scene: Scene,
    rig: Rig,
    looks: tuple[Look, Look],
    folder: Path,
    *,
    fps: int,
    seconds: float,
    advance: Callable[[], None],
) -> Film:
    """Render a scene for both cameras.

    Args:
        scene: what to show; it should repeat after `seconds`.
        rig: the two cameras.
        looks: the left and the right sensor.
        folder: receives the folders `left` and `right`.
        fps: images per second.
        seconds: length.
        advance: called after each image, 2 * `frames` times in all.

    Raises:
        OSError: the folder cannot be written to.
    """
    (film,) = render_films(scene, rig, looks, {JPEG_QUALITY: folder}, fps=fps, seconds=seconds, advance=advance)
    return film


def render_films(
    scene: Scene,
    rig: Rig,
    looks: tuple[Look, Look],
    folders: Mapping[int, Path],
    *,
    fps: int,
    seconds: float,
    advance: Callable[[], None],
) -> tuple[Film, ...]:
    """Render a scene for both cameras once and compress it several times.

    Args:
        scene: what to show; it should repeat after `seconds`.
        rig: the two cameras.
        looks: the left and the right sensor.
        folders: maps each JPEG quality, 1 to 100, to the folder that receives `left` and `right`.
        fps: images per second.
        seconds: length.
        advance: called after each rendered image, 2 * `frames` times in all.

    Returns:
        The films, in the order of `folders`.

    Raises:
        OSError: a folder cannot be written to.
        UnavailableError: an image that is none of the film's lies in a folder; a replay would show it.
    """
    films = {
        quality: Film(left=folder / "left", right=folder / "right", frames=round(fps * seconds), fps=fps)
        for quality, folder in folders.items()
    }
    for film in films.values():
        for folder in (film.left, film.right):
            prepare_folder(folder, film.frames)
    poses = rig_poses(rig)
    left = {quality: film.left for quality, film in films.items()}
    right = {quality: film.right for quality, film in films.items()}
    for model, pose, look, targets in ((rig.left, poses[0], looks[0], left), (rig.right, poses[1], looks[1], right)):
        times_s = [index / fps for index in range(round(fps * seconds))]
        _render(Renderer(scene, model, pose, look), model, targets, times_s, advance)
    return tuple(films.values())


def prepare_folder(folder: Path, frames: int) -> None:
    """Make a folder for images, and refuse one with an image that will not be replaced: it would be shown with them.

    Raises:
        OSError: the folder cannot be written to.
        UnavailableError: there is such an image.
    """
    ours = {_name(index, frames) for index in range(frames)}
    images = [path for path in folder.glob("*") if path.suffix.lower() in SUFFIXES]
    foreign = sorted(path.name for path in images if path.name not in ours)
    if foreign:
        image = folder / foreign[0]
        raise UnavailableError(
            f"{image} is no image of the film, but would be shown with it",
            "move it away, or give another folder with --out",
        )
    make_folder(folder)
    if folder.is_symlink():
        raise NotADirectoryError(errno.ENOTDIR, "it is a link", str(folder))


def write_image(folder: Path, index: int, frames: int, image: Image, quality: int) -> None:
    """Write an image of a film.

    Args:
        folder: one that `prepare_folder` made.
        index: its number.
        frames: how many there will be.
        image: (H, W, 3) uint8 BGR.
        quality: of the JPEG, 1 to 100.

    Raises:
        OSError: the folder cannot be written to.
    """
    done, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert done
    write_bytes(folder / _name(index, frames), jpeg.tobytes())


def _name(index: int, frames: int) -> str:
    return f"{index:0{len(str(frames))}d}.jpg"


def _render(
    renderer: Renderer,
    model: CameraModel,
    targets: Mapping[int, Path],
    times_s: Sequence[float],
    advance: Callable[[], None],
) -> None:
    for index, time_s in enumerate(times_s):
        image = renderer.frame(time_s)
        assert image.shape == (model.height_px, model.width_px, 3)
        for quality, target in targets.items():
            write_image(target, index, len(times_s), image, quality)
        advance()
