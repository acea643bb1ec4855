"""Loops of a camera that is never lost: where it comes back to what it saw long before, the drift of the way between is taken out of the model. Pure.

Each view that becomes a place, or comes near one of an older stretch, is compared with the places of older stretches. Where enough features agree, its depth is laid against the surface
of that older stretch alone, built again from its kept views: what was fused since cannot mislead. If it lies there, that is a loop. The ties then
put the stretches; each moves as a whole, and the field is built again from the kept views. If in doubt, nothing is moved.
"""

import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.diagnostic import Diagnostic
from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.native.library import Library
from phone_host.scan.piece import Piece, PoseGate
from phone_host.scan.relocalisation import lies_alone, shown_place
from phone_host.scan.stretches import ClosedLoop, Placed, Stretches, WayCertainty
from phone_host.scan.view import View, narrowed

_WIDTH_PX: Final = 320
"""A voxel is some 2.5 px of the matched image for each metre of the distance (`fineness`): half of VGA leaves one depth for each voxel 0.8 m away."""

_QUALITY: Final = 90
"""Of the colours' JPEG: a tenth of their bytes, and its errors are less than a sensor's noise."""

_LEVEL: Final = 1
"""Of the depths' deflation: a room's become a quarter in 1 ms."""

_MOST_EVERY: Final = 8
"""Of so many views one is kept at least: neighbours share more than half of what they show after 8 views of a walk, seldom after 16."""


@dataclass(frozen=True, slots=True, eq=False)
class _Kept:
    depth: bytes  # float16, m, deflated
    shape: tuple[int, ...]
    colours: NDArray[np.uint8]  # as JPEG
    geometry: StereoGeometry
    noise_px: float
    patch_px: float

    @property
    def bytes(self) -> int:
        return len(self.depth) + self.colours.nbytes

    @property
    def view(self) -> View:
        depth = np.frombuffer(zlib.decompress(self.depth), np.float16).reshape(self.shape).astype(np.float32)
        colours = cv2.imdecode(self.colours, cv2.IMREAD_COLOR)
        return View(
            grey=np.zeros(depth.shape, np.uint8),
            colours=np.asarray(colours, np.uint8),
            depth_m=depth,
            geometry=self.geometry,
            noise_px=self.noise_px,
            patch_px=self.patch_px,
        )


class KeptViews:
    """Small copies of all views so far, or of every second, fourth or eighth, from which the field can be built again when parts of it have moved.

    When they are too many, every second one goes, and from then on every second view is kept. When so few were kept that a surface may be seen by none of
    them, none is kept any more.

    Attributes:
        every: of how many views one is kept now.
        bytes: what they take.
    """

    def __init__(self, most_bytes: int) -> None:
        self._kept: dict[int, _Kept] = {}
        self._most_bytes, self.bytes = most_bytes, 0
        self._seen, self.every = 0, 1

    @property
    def are_enough(self) -> bool:
        """Whether the field can be built from them."""
        return self.every <= _MOST_EVERY

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self._kept)

    def remember(self, number: int, view: View) -> None:
        """Keep a view, or pass over it."""
        self._seen += 1
        if not self.are_enough or (self._seen - 1) % self.every:
            return
        self._kept[number] = _small(view)
        self.bytes += self._kept[number].bytes
        self.bound(self._most_bytes)

    def bound(self, most_bytes: int) -> None:
        """Let every second one go until the others take no more than so many bytes."""
        while self.bytes > most_bytes and self._kept:
            self.every *= 2
            numbers = list(self._kept)[::2] if self.are_enough else []
            self._kept = {number: self._kept[number] for number in numbers}
            self.bytes = sum(kept.bytes for kept in self._kept.values())

    def of(self, numbers: Sequence[int], step: int = 1) -> Iterator[tuple[int, View]]:
        """Give those of some views that are kept, each with its number, as black views with depth and colours; of these every second one with a step of 2, and so on."""
        for number in [number for number in numbers if number in self._kept][::step]:
            yield number, self._kept[number].view


def _small(view: View) -> _Kept:
    depth, geometry, step = narrowed(view.depth_m, view.geometry, _WIDTH_PX)
    _, colours = cv2.imencode(
        ".jpg", np.ascontiguousarray(view.colours[::step, ::step]), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY]
    )
    with np.errstate(over="ignore"):
        deflated = zlib.compress(depth.astype(np.float16).tobytes(), _LEVEL)
    return _Kept(
        deflated, depth.shape, np.asarray(colours, np.uint8), geometry, view.noise_px / step, view.patch_px / step
    )


_ALONE: Final = 3
"""Of the kept views of a stretch and its neighbours every third shows its surface."""

_WAIT_SHARE: Final = 0.25
"""Of the kept views: so many come in between before the model is built again. So a view costs four more on average at most, however long the scan."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopSettings:
    """How loops are looked for, and when they move the model.

    Attributes:
        most_bytes: of the kept views.
        compared: places that a new one is compared with in full: those that most of its features vote for.
        every: views after which one is compared that was taken near an older stretch's place; one that becomes a place itself always is.
        at_once: views of which the model is built while the camera goes on; in the end it is built of all.
        least_voxels: the model is built again if a stretch moves by more.
        least_turn: or turns by more, rad.
    """

    most_bytes: int = 45_000_000
    compared: int = 3
    every: int = 4
    at_once: int = 256
    least_voxels: float = 0.5
    least_turn: float = 0.003


class LoopCloser:
    """Knows the stretches of a model, and closes loops between them."""

    def __init__(
        self, settings: LoopSettings, model: Piece, threads: int, gate: PoseGate, library: Library | Diagnostic
    ) -> None:
        self._settings, self._model = settings, model
        self._threads, self._gate, self._library = threads, gate, library
        self._kept, self._stretches = KeptViews(settings.most_bytes), Stretches(model.volume.settings.voxel_m)
        self._stretch_of: list[int] = []  # of each place
        self._compared = self._put_at = (
            0  # numbers of the last views that were compared, and at which the stretches were put
        )
        self._newest: View | None = None
        self._is_open = False  # whether there are loops that have not been looked at together
        self._is_coarse = False  # whether the model was built of some of the kept views only

    @property
    def closed(self) -> tuple[ClosedLoop, ...]:
        """The loops that count."""
        return self._stretches.closed

    @property
    def certainty(self) -> WayCertainty:
        """How sure the camera's way is."""
        return self._stretches.certainty

    def keep(self, number: int, view: View, room_bytes: int) -> None:
        """Keep a small copy of a view that is in the model, or in a piece that may become part of it."""
        self._kept.remember(number, view)
        self._kept.bound(max(room_bytes, 0))

    def joined(self, views: Sequence[Placed]) -> None:
        """Note that a piece has become part of the model."""
        self._stretches.add_piece(list(views), self._beside(views[0].world_camera))
        self._note_places()

    def fused(self, number: int, view: View, world_camera: SE3, *, was_lost: bool) -> tuple[Placed, ...]:
        """Note that a view is in the model; look for a loop, and move the model where loops say so.

        Returns:
            Where all views of the model were taken, this one last; none: nothing has moved.
        """
        beside = self._beside(world_camera) if was_lost and self._stretches.count else None
        self._stretches.add(Placed(number, world_camera), beside, self._kept.every)
        self._newest = view
        if self._is_compared(number, view, world_camera):
            self._is_open |= self._is_loop(view, world_camera)
        if not self._is_open or number - self._put_at < _WAIT_SHARE * self._kept.count:
            return ()
        self._put_at = number
        return self._put(max(1, -(-self._kept.count // self._settings.at_once)))

    def settled(self) -> tuple[Placed, ...]:
        """Move the model to where all loops so far agree best, if it is worth it; return where all its views were taken, in order within a stretch; none: nothing has moved."""
        return self._put(1) if self._is_open or self._is_coarse else ()

    def _put(self, step: int) -> tuple[Placed, ...]:
        """Put the stretches where they belong, and build the model again from every second, third ... kept view; see `settled`."""
        if self._newest is None or not self._kept.are_enough:
            return ()
        self._is_open, by, model = False, self._stretches.settled(), self._model
        turn, shift_m = self._stretches.farthest(by)
        is_little = shift_m < self._settings.least_voxels * model.volume.settings.voxel_m
        if is_little and turn < self._settings.least_turn and not (self._is_coarse and step == 1):
            return ()
        self._is_coarse = True  # until it is whole again: Ctrl-C may come in between
        self._stretches.move(by)
        model.places.move([by[stretch] for stretch in self._stretch_of])
        model.volume.emptied()
        placed = [replace(each, by=by[at]) for at in range(len(by)) for each in self._stretches.views(at)]
        self._fuse(model, placed[:-1], step)
        model.volume.fuse(self._newest, placed[-1].world_camera)  # whole: the next view follows it
        self._is_coarse = step > 1
        return tuple(placed)

    def _is_compared(self, number: int, view: View, world_camera: SE3) -> bool:
        """Return whether a view is to be compared with places of older stretches: it is a place itself, or near one of them."""
        is_place, among = self._note_places(), [place for group in self._older_places() for place in group]
        if not among or not self._kept.are_enough:
            return False
        is_due = number - self._compared >= self._settings.every
        if not is_place and not (is_due and self._model.places.is_by(view, world_camera, among)):
            return False
        self._compared = number
        return True

    def _older_places(self) -> list[list[int]]:
        """Return the places of older stretches, those first of which the ties are least sure."""
        groups = [set(older) for older in self._stretches.older()]
        return [[place for place, stretch in enumerate(self._stretch_of) if stretch in group] for group in groups]

    def _is_loop(self, view: View, world_camera: SE3) -> bool:
        """Look whether a view shows a place of an older stretch, and lies on its surface."""
        bounds = self._stretches.bounds()
        for among in self._older_places():
            limits = {place: bounds[self._stretch_of[place]] for place in among}
            found = shown_place(self._model, view, world_camera, limits, self._settings.compared)
            if found is not None:
                break
        else:
            return False
        stretch = self._stretch_of[found.number]
        lying = lies_alone(self._piece(stretch), view, (found.world_camera, world_camera))
        if lying is None:
            return False
        return self._stretches.close(stretch, world_camera, lying.pose)

    def _piece(self, stretch: int) -> Piece:
        """Build a stretch alone, and its neighbours, from every third of their kept views."""
        piece = Piece(self._model.volume.settings, self._threads, self._gate, self._library)
        piece.usual_off_sigmas = self._model.usual_off_sigmas
        self._fuse(piece, self._stretches.around(stretch), _ALONE)
        return piece

    def _fuse(self, piece: Piece, placed: Sequence[Placed], step: int = 1) -> None:
        """Fuse every view that is kept of some, or every second, third ..."""
        poses = {each.number: each.world_camera for each in placed}
        for number, view in self._kept.of(list(poses), step):
            piece.volume.fuse(view, poses[number])

    def _beside(self, world_camera: SE3) -> int:
        """Return the stretch of the place that was seen from nearest by."""
        return self._stretch_of[self._model.places.nearest(world_camera, len(self._stretch_of))]

    def _note_places(self) -> bool:
        """Note to which stretch new places belong: the last one; return whether there are any."""
        new = self._model.places.count - len(self._stretch_of)
        self._stretch_of += [self._stretches.count - 1] * new
        return new > 0
