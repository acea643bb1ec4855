"""A surface as a signed distance field with colour: views go in, the surface as a camera sees it comes out. Pure.

The native library computes; without it numpy does (`volume_numpy`), with the same result within a rounding.
Sources: B. Curless and M. Levoy, "A Volumetric Method for Building Complex Models from Range Images", 1996; R. A. Newcombe et al.,
"KinectFusion", 2011; M. Niessner et al., "Real-time 3D Reconstruction at Scale using Voxel Hashing", 2013.
"""

import ctypes
from dataclasses import dataclass, replace
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.diagnostic import Diagnostic
from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.native.library import Library, native
from phone_host.native.volume_jobs import (
    AbsorbJob,
    CarveJob,
    CastJob,
    FuseJob,
    RegisterJob,
    TouchJob,
    VolumeArrays,
)
from phone_host.scan import volume_numpy
from phone_host.scan.blocks import BLOCK_BYTES, ONE, SIDE, VOXELS, Blocks
from phone_host.scan.view import Camera, Depth, View
from phone_host.scan.volume_numpy import absorbed, gains_of, multiplied, reached
from phone_host.scan.volume_settings import MOST_WEIGHT, WEIGHT_ONE, VolumeSettings

_LOOKS_A_BLOCK: Final = 3
_NEARLY_FULL: Final = 0.9
_MOST_VOXELS_OFF: Final = 1 << 24
"""A camera farther off sees nothing: 32-bit numbers cannot count the voxels up to there."""

_CUBE: Final = (-1, SIDE, SIDE, SIDE)
_HALF, _EVEN = SIDE // 2, slice(None, None, 2)
_MOST_STEP_PX: Final = 4
"""Of the pixels that make room: every fourth, or more where a block is less than 12 px wide at the farthest depth."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A surface as a camera sees it.

    Attributes:
        points_m: (H, W, 3) float32, m, in the camera's axes, NaN = none.
        normals: (H, W, 3) float32, towards the camera, NaN = none.
    """

    points_m: NDArray[np.float32]
    normals: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class BlockValues:
    """Blocks and what they hold, as in `Blocks`.

    Attributes:
        places: (N, 3) int32, each once.
        field: (N, 512) int16.
        weights: (N, 512) uint16.
        colours: (N, 512, 3) uint8.
    """

    places: NDArray[np.int32]
    field: NDArray[np.int16]
    weights: NDArray[np.uint16]
    colours: NDArray[np.uint8]


class Volume:
    """A distance field that grows where views show something.

    Attributes:
        settings: its fineness and limits; coarser ones after `coarsen`.
        blocks: its values.
        left_out: blocks for which there was no memory.
    """

    def __init__(self, settings: VolumeSettings, threads: int = 1, library: Library | Diagnostic | None = None) -> None:
        self.settings, self._threads = settings, threads
        found = native() if library is None else library
        self._library = found if isinstance(found, Library) else None
        self.blocks = Blocks()
        self.left_out = 0
        self._fused = self._copied = 0
        self._changes = np.zeros(0, np.int64)  # for each block, number of the view that changed it last

    @property
    def fused(self) -> int:
        """How many times something went in."""
        return self._fused

    @property
    def memory_bytes(self) -> int:
        """Memory of the blocks in use."""
        return self.blocks.count * BLOCK_BYTES

    @property
    def is_nearly_full(self) -> bool:
        """Whether the next views may find no memory for what they show."""
        return self.blocks.count > _NEARLY_FULL * self.settings.most_blocks

    def fuse(self, view: View, world_camera: SE3, room_for: Depth | None = None) -> NDArray[np.uint8]:
        """Fuse a view.

        Args:
            view: what the camera saw.
            world_camera: where it was.
            room_for: (H, W) float32, those of its depths that are part of the model, NaN elsewhere: only for them is room made, while
                the others still tell what is empty; None: all.

        Returns:
            (count,) 1 for each block that got something. Blocks for which there was no memory are added to `left_out`.
        """
        depth = np.ascontiguousarray(view.depth_m, np.float32)
        colours = np.ascontiguousarray(view.colours, np.uint8)
        if depth.shape != view.grey.shape or colours.shape != (*depth.shape, 3):
            raise ValueError(f"depth {depth.shape} and colours {colours.shape} of an image {view.grey.shape}")
        if self._fused:
            colours = multiplied(colours, gains_of(view, world_camera, self.blocks, self.settings.voxel_m))
        shown = depth if room_for is None else np.ascontiguousarray(room_for, np.float32)
        self._make_room(shown, Camera(view.geometry, view.grey.shape, world_camera))
        if self._library is None:
            packed = replace(view, depth_m=depth, colours=colours)
            return self._noted(volume_numpy.fuse(self.blocks, self.settings, packed, world_camera.inverse()))
        changed = np.zeros(self.blocks.count, np.uint8)
        arrays = self._arrays()
        job = FuseJob(
            volume=ctypes.pointer(arrays),
            depth_m=depth.ctypes.data,
            colours=colours.ctypes.data,
            changed=changed.ctypes.data,
            camera_world=rows_of(world_camera.inverse()),
            far_m=self.settings.far_m,
            noise_per_m=view.noise_per_m,
            sure_m=self.settings.sure_m,
            weight_one=WEIGHT_ONE,
            most_weight=MOST_WEIGHT,
            threads=self._threads,
        )
        aim(job, view.geometry, depth.shape)
        self._library.run(job)
        return self._noted(changed)

    def changed_blocks(self, *, every: bool = False) -> BlockValues:
        """Return copies of the blocks that got something since the last call; with `every`, of all blocks."""
        numbers = np.arange(self.blocks.count) if every else self.changed_since(self._copied)
        self._copied = self._fused
        of = self.blocks
        return BlockValues(of.places[numbers], of.field[numbers], of.weights[numbers], of.colours[numbers])

    def changed_since(self, fused: int) -> NDArray[np.int64]:
        """Return the numbers of the blocks that got something since `fused` had a value; 0: everything."""
        return np.flatnonzero(self._changes > fused)

    def put(self, values: BlockValues) -> None:
        """Give blocks these values, in place of those that they have; new ones for which there is no memory are added to `left_out`."""
        numbers = self._added(values.places)
        there = numbers >= 0
        self.blocks.field[numbers[there]] = values.field[there]
        self.blocks.weights[numbers[there]] = values.weights[there]
        self.blocks.colours[numbers[there]] = values.colours[there]
        changed = np.zeros(self.blocks.count, np.uint8)
        changed[numbers[there]] = 1
        self._noted(changed)
        self._copied = self._fused  # whoever puts them has them

    def emptied(self) -> None:
        """Forget all that went in; the blocks stay, so that whoever has their values learns that these have changed."""
        of = self.blocks
        of.field[: of.count], of.weights[: of.count], of.colours[: of.count] = ONE, 0, 0
        self.left_out = 0
        self._noted(np.ones(of.count, np.uint8))

    def coarsen(self) -> None:
        """Make the voxels twice as wide: of the values every second one of each direction stays, in a quarter to a fifth of the memory."""
        of, count = self.blocks, self.blocks.count
        old = of.places[:count]
        places, of_old = np.unique(old >> 1, axis=0, return_inverse=True)
        made, numbers = Blocks(max(len(places), 1)), of_old.reshape(-1)
        made.add(places.astype(np.int32))
        for octant in product((0, 1), repeat=3):
            chosen = np.flatnonzero((old & 1 == octant).all(axis=1))
            x, y, z = (slice(_HALF * at, _HALF * (at + 1)) for at in octant)
            target, source = (numbers[chosen], z, y, x), (chosen, _EVEN, _EVEN, _EVEN)
            weights = of.weights[:count].reshape(_CUBE)[source]
            # A truncation is twice as long now. What was empty is at least half of one before the surface: more would let rays step over it.
            halves = np.rint(of.field[:count].reshape(_CUBE)[source] * np.float32(0.5)).astype(np.int16)
            halves[halves == 0] = 1
            made.field.reshape(_CUBE)[target] = np.where(weights > 0, halves, np.int16(ONE))
            made.weights.reshape(_CUBE)[target] = weights
            made.colours.reshape((*_CUBE, 3))[target] = of.colours[:count].reshape((*_CUBE, 3))[source]
        self.blocks, self.settings = made, self.settings.coarser
        self._changes = np.zeros(made.count, np.int64)
        self._noted(np.ones(made.count, np.uint8))

    def take_in(self, of: "Volume", into_of: SE3) -> None:
        """Average another field into this one; what finds no memory is added to `left_out`.

        Args:
            of: stays as it is; its voxels are as wide.
            into_of: takes its points to this field's.
        """
        voxel_m, held = self.settings.voxel_m, of.blocks
        numbers = self._added(reached(held.places[: held.count], into_of, voxel_m))
        chosen, back = np.zeros(self.blocks.count, np.uint8), into_of.inverse()
        chosen[numbers[numbers >= 0]] = 1
        rows = np.column_stack([back.R, back.t_m / voxel_m])
        if self._library is None:
            self._noted(absorbed(self.blocks, held, chosen, rows))
            return
        into, other = self._arrays(), _arrays_of(held, of.settings)
        job = AbsorbJob(
            into=ctypes.pointer(into),
            of=ctypes.pointer(other),
            chosen=chosen.ctypes.data,
            of_into=(ctypes.c_double * 12)(*rows.ravel().tolist()),
            most_weight=MOST_WEIGHT,
            threads=self._threads,
        )
        self._library.run(job)
        self._noted(chosen)

    def _added(self, places: NDArray[np.int32]) -> NDArray[np.int64]:
        """Add the blocks that are missing, as far as there is memory; return the numbers of all, -1: none."""
        missing = places[self.blocks.find(places) < 0]
        wanted, room = self.blocks.count + len(missing), self.blocks.room
        while room < min(wanted, self.settings.most_blocks):
            room = min(2 * room, self.settings.most_blocks)
        if room > self.blocks.room:
            self.blocks = self.blocks.grown(room)
        fit = max(self.blocks.room - self.blocks.count, 0)
        self.left_out += len(missing[fit:])
        self.blocks.add(missing[:fit])
        return self.blocks.find(places)

    def _noted(self, changed: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Remember which blocks got something."""
        self._fused += 1
        self._changes = np.concatenate([self._changes, np.zeros(len(changed) - len(self._changes), np.int64)])
        self._changes[changed > 0] = self._fused
        return changed

    def cast(self, camera: Camera, seeds_m: Depth | None = None) -> Surface:
        """Show the surface as a camera sees it.

        Args:
            camera: from where.
            seeds_m: (H, W) float32 depths near which the surface is looked for, m, NaN = nowhere; None: everywhere.
        """
        shape = camera.shape
        if seeds_m is not None and seeds_m.shape != shape:
            raise ValueError(f"seeds {seeds_m.shape} for an image {shape}")
        seeds = None if seeds_m is None else np.ascontiguousarray(seeds_m, np.float32)
        far_m = self._farthest_m(camera)
        if self._library is None:
            settings = replace(self.settings, far_m=far_m)
            return Surface(*volume_numpy.cast(self.blocks, settings, camera, seeds))
        points, normals = np.empty((*shape, 3), np.float32), np.empty((*shape, 3), np.float32)
        arrays = self._arrays()
        job = CastJob(
            volume=ctypes.pointer(arrays),
            seeds_m=None if seeds is None else seeds.ctypes.data,
            points_m=points.ctypes.data,
            normals=normals.ctypes.data,
            world_camera=rows_of(camera.world_camera),
            near_m=self.settings.voxel_m,
            far_m=far_m,
            search=int(seeds is None),
            threads=self._threads,
        )
        aim(job, camera.geometry, shape)
        self._library.run(job)
        return Surface(points, normals)

    def _farthest_m(self, camera: Camera) -> float:
        """Return the depth behind which a camera can see no block, or the far limit: rays end there."""
        places = self.blocks.places[: self.blocks.count]
        if not len(places):
            return 0.0
        side_m = SIDE * self.settings.voxel_m
        ends_m = np.array([places.min(axis=0) - 1.0, places.max(axis=0) + 2.0]) * side_m
        corners_m = np.array(list(product(*ends_m.T)))
        farthest_m = min(float(camera.world_camera.inverse().apply(corners_m)[:, 2].max()), self.settings.far_m)
        most_m = _MOST_VOXELS_OFF * self.settings.voxel_m
        is_near = farthest_m < most_m and float(np.abs(camera.world_camera.t_m).max()) < most_m
        return farthest_m if is_near else 0.0

    def _make_room(self, depth: Depth, camera: Camera) -> None:
        """Add the blocks that a depth image shows; grow while there is memory."""
        while True:
            missing = self._touch(depth, camera)
            room = min(2 * self.blocks.room, self.settings.most_blocks)
            if not missing or room <= self.blocks.room:
                self.left_out += missing
                return
            self.blocks = self.blocks.grown(room)

    def _touch(self, depth: Depth, camera: Camera) -> int:
        """Add blocks as far as there is room; return how many found none."""
        if self._library is None:
            return volume_numpy.touch(self.blocks, self.settings, depth, camera, self._step_px(camera.geometry))
        arrays = self._arrays()
        job = TouchJob(
            volume=ctypes.pointer(arrays),
            depth_m=depth.ctypes.data,
            world_camera=rows_of(camera.world_camera),
            far_m=self.settings.far_m,
            step=self._step_px(camera.geometry),
        )
        aim(job, camera.geometry, camera.shape)
        self._library.run(job)
        self.blocks.count = arrays.count
        return int(job.missing)

    def _step_px(self, geometry: StereoGeometry) -> int:
        block_px = SIDE * self.settings.voxel_m * geometry.focal_px / self.settings.far_m
        return min(max(int(block_px / _LOOKS_A_BLOCK), 1), _MOST_STEP_PX)

    def _arrays(self) -> VolumeArrays:
        return _arrays_of(self.blocks, self.settings)


def _arrays_of(blocks: Blocks, settings: VolumeSettings) -> VolumeArrays:
    assert blocks.field.shape == (blocks.room, VOXELS)
    return VolumeArrays(
        slots=blocks.slots.ctypes.data,
        places=blocks.places.ctypes.data,
        field=blocks.field.ctypes.data,
        weights=blocks.weights.ctypes.data,
        colours=blocks.colours.ctypes.data,
        slot_count=len(blocks.slots),
        room=blocks.room,
        count=blocks.count,
        voxel_m=settings.voxel_m,
        truncation_m=settings.truncation_m,
    )


def rows_of(pose: SE3) -> ctypes.Array[ctypes.c_float]:
    """Return a pose's three rows of rotation and translation, m."""
    rows = np.column_stack([pose.R, pose.t_m]).ravel()
    return (ctypes.c_float * 12)(*rows.tolist())


def aim(
    job: TouchJob | FuseJob | CarveJob | CastJob | RegisterJob, geometry: StereoGeometry, shape: tuple[int, int]
) -> None:
    """Tell a job its camera: geometry, and height and width of the image, px."""
    job.height, job.width = shape
    job.focal_px, job.cx_px, job.cy_px = geometry.focal_px, geometry.cx_px, geometry.cy_px
