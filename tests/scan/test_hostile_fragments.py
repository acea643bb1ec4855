"""Fragments of a scan that were made to do harm, and rays that never meet anything: both end, within their memory and their steps."""

import io
import subprocess
import sys
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.diagnostic import Diagnostic
from common.errors import DataError
from phone_host.geometry.se3 import SE3
from phone_host.native.library import Library, native
from phone_host.scan.field_bytes import Arrays, field_bytes, field_of, packed, unpacked
from phone_host.scan.scan import scan_for
from phone_host.scan.submap_bytes import submap_bytes, submap_of
from phone_host.scan.view import Camera
from phone_host.scan.volume import Volume
from tests.scan.test_scan_submaps import POSES, WANTED, taken
from tests.scan.test_scan_volume import NONE, SETTINGS, filled
from tests.support.plane_films import GEOMETRY

_SUBMAP, _FIELD = b"tandemscan submap 5\n", b"tandemscan field 3\n"
_MOST_MORE_BYTES = 250 << 20
_SHAPE = (24, 32)
_LIBRARIES = [NONE, *([native()] if isinstance(native(), Library) else [])]


@pytest.fixture(scope="module")
def submap() -> bytes:
    """A sound one."""
    return submap_bytes(taken(scan_for(WANTED), POSES[:1]).close_submap())


def _changed(content: bytes, head: bytes, change: Callable[[Arrays], None]) -> bytes:
    arrays = unpacked(content, head, dict, DataError("x", "y"))
    change(arrays)
    return packed(head, arrays)


def _at(name: str, place: int | tuple[int, ...], value: float) -> Callable[[Arrays], None]:
    def change(arrays: Arrays) -> None:
        array = arrays[name].copy()
        array[place] = value
        arrays[name] = array

    return change


def _twice(arrays: Arrays) -> None:
    for name in ("block_places", "field", "weights", "colours"):
        arrays[name] = np.concatenate([arrays[name], arrays[name][:1]])


ABSURD: dict[str, Callable[[Arrays], None]] = {
    "an endless far limit": _at("model", 1, np.inf),
    "a far limit of a million km": _at("model", 1, 1e9),
    "a far limit that is no number": _at("model", 1, np.nan),
    "near depths that are no number": _at("model", 4, np.nan),
    "endless noise": _at("model", 5, np.inf),
    "endless memory": _at("model", 2, np.inf),
    "voxels of a billionth of a mm": _at("model", 0, 1e-12),
    "a pose that is no number": _at("poses", (0, 0, 3), np.nan),
    "an endless pose": _at("pose", (0, 1, 3), np.inf),
    "a pose beyond all distances": _at("poses", (0, 2, 3), 1e20),
    "a pose that is no rotation": _at("pose", (0, 0, 0), 7.0),
    "a place whose pose is no number": _at("place_poses", (0, 1, 1), np.nan),
    "a point that is no number": _at("place_points", (0, 1), np.nan),
    "an endless focal length": _at("geometry", 0, np.inf),
    "a focal length of 0": _at("geometry", 0, 0.0),
    "blocks beyond all distances": _at("block_places", (0, 0), 2**31 - 1),
    "two blocks in one place": _twice,
    "numbers of another kind": lambda arrays: arrays.update(field=arrays["field"].astype(np.float64)),
    "words": lambda arrays: arrays.update(model=np.array(["a", "b", "c", "d"])),
    "no shape": lambda arrays: arrays.update(poses=np.array(1.0)),
}


@pytest.mark.parametrize("name", ABSURD)
def test_absurd_fragments_are_refused(submap: bytes, name: str) -> None:
    """Limits and poses that no scan has: one line with the file's name. The same bytes without the change are read."""
    assert submap_of(_changed(submap, _SUBMAP, lambda _: None), "submap-1.bin").is_whole
    with pytest.raises(DataError, match=r"^submap-1.bin is damaged"):
        submap_of(_changed(submap, _SUBMAP, ABSURD[name]), "submap-1.bin")


def _bomb(head: bytes) -> bytes:
    """512 MB of zeros in half a megabyte."""
    packer = zlib.compressobj(6)
    return head + b"".join(packer.compress(bytes(16 << 20)) for _ in range(32)) + packer.flush()


def _inner_bomb(head: bytes) -> bytes:
    """The same as an array that is compressed a second time within."""
    file = io.BytesIO()
    np.savez_compressed(file, model=np.zeros(256 << 20, np.uint8), block_places=np.zeros(1, np.uint8))
    return head + zlib.compress(file.getvalue())


@pytest.mark.parametrize("make", [_bomb, _inner_bomb])
def test_fragments_take_no_more_memory_than_they_may(tmp_path: Path, make: Callable[[bytes], bytes]) -> None:
    """A small file that becomes hundreds of megabytes is one line, and takes a bounded amount on the way: the whole program beside one that reads nothing."""
    path = tmp_path / "submap-0000.bin"
    path.write_bytes(make(_SUBMAP))
    assert path.stat().st_size < 2 << 20
    script = (
        "import sys; from pathlib import Path; from common.errors import DataError\n"
        "from phone_host.run.kept_submaps import read_submaps\n"
        "try: read_submaps(Path(sys.argv[1]))\n"
        "except DataError as error: print(str(error).replace(' ', '_'))\n"
        "print(open('/proc/self/status').read().partition('VmHWM:')[2].split()[0])"
    )
    (tmp_path / "empty").mkdir()
    told = [
        subprocess.run(
            [sys.executable, "-c", script, folder], capture_output=True, text=True, timeout=60, check=True
        ).stdout.split()
        for folder in (tmp_path, tmp_path / "empty")
    ]
    assert "is_damaged" in told[0][0]
    assert 1024 * (int(told[0][1]) - int(told[1][1])) < _MOST_MORE_BYTES


def test_sound_fields_are_far_from_the_limits() -> None:
    """A field becomes at most a quarter as large as it may: of the ratio alone, without what any file may take."""
    volume = filled(NONE)
    content = field_bytes(volume)
    assert len(zlib.decompress(content[len(_FIELD) :])) < 16 * len(content)
    assert field_of(content, "a field").settings == volume.settings


@pytest.mark.parametrize("library", _LIBRARIES, ids=["numpy", "native"][: len(_LIBRARIES)])
@pytest.mark.parametrize("far_m", [1e3, 1e30, float("inf")])
def test_rays_end_for_any_far_limit(library: Library | Diagnostic, far_m: float) -> None:
    """The surface is that of the usual limit, bit for bit, and a camera that looks away, or stands beyond all distances, sees nothing."""
    usual = filled(library)
    volume = Volume(replace(SETTINGS, far_m=far_m), 1, library)
    volume.put(usual.changed_blocks(every=True))
    camera = Camera(GEOMETRY, _SHAPE, POSES[0])
    assert np.array_equal(volume.cast(camera).points_m, usual.cast(camera).points_m, equal_nan=True)
    away = SE3.of(np.array([0.0, np.pi, 0.0, 0.0, 0.0, 0.0]))
    distant = SE3(np.eye(3), np.array([0.0, 0.0, -1e9]))
    lost = SE3(np.eye(3), np.array([0.0, np.nan, 0.0]))
    for pose in (away, distant, lost):
        assert np.isnan(volume.cast(Camera(GEOMETRY, _SHAPE, pose)).points_m).all()
    assert np.isnan(Volume(replace(SETTINGS, far_m=far_m), 1, library).cast(camera).points_m).all()
