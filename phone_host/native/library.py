"""Finds, checks and loads the native library, and declares its functions: the one place that knows both sides (src/tandem.h).

Needs neither numpy nor OpenCV. Callers check shapes and strides; the C code trusts them.
"""

import ctypes
import os
from dataclasses import dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Final

from common.android import INSTALL as TERMUX_INSTALL
from common.android import is_android
from common.diagnostic import Diagnostic
from common.errors import SettingsError, UnavailableError
from phone_host.native.build_library import LIBRARY_FILE, REASON_FILE
from phone_host.native.volume_jobs import (
    FLOAT,
    INT,
    INT64,
    POINTER,
    AbsorbJob,
    CarveJob,
    CastJob,
    FuseJob,
    RegisterJob,
    TouchJob,
    each,
)

VARIABLE: Final = "TANDEMSCAN_SIMD"
"""Environment variable that chooses another instruction set than the widest, to compare or to find a fault."""

_ABI: Final = 4  # TANDEM_ABI of tandem.h
_HERE: Final = Path(__file__).resolve().parent
_INSTALL: Final = "install gcc or clang and reinstall; in a checkout: make native"
_REINSTALL: Final = "reinstall; in a checkout: make native"


class Simd(Enum):
    """Instruction sets of the processors, by the names of tandem.h and of `TANDEMSCAN_SIMD`, the widest first."""

    AVX512 = "avx512"
    AVX2 = "avx2"
    SSE41 = "sse41"
    NEON = "neon"
    SCALAR = "scalar"

    @property
    def text(self) -> str:
        """The name as people know it."""
        return {"avx512": "AVX-512", "sse41": "SSE4.1", "scalar": "no SIMD"}.get(self.value, self.value.upper())


class IsaState(Enum):
    """Whether an instruction set can be used: `enum tandem_isa_state`."""

    USABLE = 0
    NOT_BUILT = 1
    NOT_SUPPORTED = 2


_NUMBERS: Final = {Simd.SCALAR: 0, Simd.SSE41: 1, Simd.AVX2: 2, Simd.AVX512: 3, Simd.NEON: 4}
"""`enum tandem_isa`."""


class ReprojectJob(ctypes.Structure):
    """`struct tandem_reproject_job`."""

    _fields_ = (
        *each(POINTER, "disparity_px column_slopes row_slopes cloud_m"),
        ("disparity_stride", INT64),
        *each(INT, "width height"),
        *each(FLOAT, "doffs_px product least_px at_zero_px far_m near_m"),
        *each(INT, "wide reserved"),
        *each(INT64, "found at_zero in_front too_far too_near"),
    )


class PackJob(ctypes.Structure):
    """`struct tandem_pack_job`."""

    _fields_ = (
        *each(POINTER, "cloud_m colours records"),
        *each(INT64, "cloud_stride colour_stride"),
        *each(INT, "width height channels"),
        ("flips", ctypes.c_uint8 * 3),
        ("reserved", ctypes.c_uint8),
        ("count", INT64),
    )


class MatchJob(ctypes.Structure):
    """`struct tandem_match_job`."""

    _fields_ = (
        *each(POINTER, "left right"),
        *each(INT64, "left_stride right_stride"),
        *each(POINTER, "disparity confidence workspace"),
        ("workspace_bytes", INT64),
        *each(INT, "width height disparities threads guide reserved"),
    )


class RemapJob(ctypes.Structure):
    """`struct tandem_remap_job`."""

    _fields_ = (
        *each(POINTER, "image places fractions out"),
        *each(INT64, "image_stride out_pixels"),
        *each(INT, "image_width image_height"),
    )


Job = ReprojectJob | PackJob | MatchJob | RemapJob | TouchJob | FuseJob | CarveJob | CastJob | RegisterJob | AbsorbJob
_FUNCTIONS: Final[dict[type[Job], tuple[str, bool]]] = {
    ReprojectJob: ("tandem_reproject", True),
    PackJob: ("tandem_pack", True),
    MatchJob: ("tandem_match", True),
    RemapJob: ("tandem_remap", True),
    TouchJob: ("tandem_touch", False),
    FuseJob: ("tandem_fuse", True),
    CarveJob: ("tandem_carve", True),
    CastJob: ("tandem_cast", True),
    RegisterJob: ("tandem_register", False),
    AbsorbJob: ("tandem_absorb", False),
}
"""What does each kind of job, and whether it is compiled for each instruction set: then the set's number is its first argument."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Library:
    """The loaded library, set to one instruction set. Its functions release the GIL and may run in several threads.

    Attributes:
        handle: the shared library.
        simd: the instruction set that its functions use.
        path: the file.
    """

    handle: ctypes.CDLL
    simd: Simd
    path: Path

    @property
    def isa(self) -> int:
        """The instruction set's number: the first argument of every function that computes."""
        return _NUMBERS[self.simd]

    def state_of(self, simd: Simd) -> IsaState:
        """Return whether an instruction set can be used on this processor."""
        return IsaState(self.handle.tandem_isa_state(_NUMBERS[simd]))

    def usable_sets(self) -> tuple[Simd, ...]:
        """Return the instruction sets that can be used on this processor, the widest first."""
        return tuple(simd for simd in Simd if self.state_of(simd) is IsaState.USABLE)

    def using(self, simd: Simd) -> "Library":
        """Return the same library, set to another instruction set.

        Raises:
            SettingsError: it is not built or this processor lacks it.
        """
        state, choices = self.state_of(simd), _choices(self)
        if state is IsaState.NOT_BUILT:
            raise SettingsError(
                f"TANDEMSCAN_SIMD={simd.value} cannot be used: the native library was built without it",
                f"give {choices}, or leave it empty for the fastest",
            )
        if state is IsaState.NOT_SUPPORTED:
            raise SettingsError(
                f"TANDEMSCAN_SIMD={simd.value} cannot be used: this processor has no {simd.text}",
                f"give {choices}, or leave it empty for the fastest",
            )
        return Library(handle=self.handle, simd=simd, path=self.path)

    def sources(self) -> str:
        """Return the digest of the sources that it was built from; see `build_library.sources_digest`."""
        return str(self.handle.tandem_sources().decode())

    def match_bytes(self, job: MatchJob) -> int:
        """Return the size of the workspace that a pair needs, bytes."""
        return int(self.handle.tandem_match_bytes(self.isa, ctypes.byref(job)))

    def run(self, job: Job) -> None:
        """Do a job by the C function of its kind; src/tandem.h says what each computes, and which fields it fills."""
        name, is_per_set = _FUNCTIONS[type(job)]
        result = getattr(self.handle, name)(*([self.isa] if is_per_set else []), ctypes.byref(job))
        # The set was checked when the library was made, so another answer is a fault of ours.
        assert result == 0, f"the native library answered {result}"


@cache
def native() -> Library | Diagnostic:
    """Return the library of this installation, loaded once, or why there is none.

    Raises:
        SettingsError: `TANDEMSCAN_SIMD` names no instruction set, or one that cannot be used here.
    """
    return load(_HERE, os.environ.get(VARIABLE, ""))


def required(found: Library | Diagnostic) -> Library:
    """Return the library that the matcher `tandem` needs.

    Raises:
        UnavailableError: there is none.
    """
    if isinstance(found, Diagnostic):
        raise UnavailableError(f"matcher tandem is {found.message}", f"{found.remedy}; or use --matcher sgbm")
    return found


def load(folder: Path, wanted: str = "") -> Library | Diagnostic:
    """Load a library.

    Args:
        folder: where it lies.
        wanted: name of the instruction set to use; empty: the widest that this processor has.

    Raises:
        SettingsError: no instruction set has that name, or it cannot be used here.
    """
    path = folder / LIBRARY_FILE
    try:
        handle = ctypes.CDLL(str(path))
    except OSError as error:
        return _missing(folder, error)
    try:
        _declare(handle)
    except AttributeError as error:  # a checkout went on, and its library did not
        lacking = str(error).rpartition(" ")[2]
        return _absent(f"of an older build, without {lacking}", _REINSTALL)
    if handle.tandem_abi() != _ABI:
        return _absent(f"of another version ({path})", _REINSTALL)
    best = next(simd for simd, number in _NUMBERS.items() if number == handle.tandem_isa_best())
    library = Library(handle=handle, simd=best, path=path)
    if not wanted:
        return library
    if wanted not in [simd.value for simd in Simd]:
        choices = _choices(library)
        raise SettingsError(
            f"TANDEMSCAN_SIMD={wanted} is no instruction set", f"give {choices}, or leave it empty for the fastest"
        )
    return library.using(Simd(wanted))


def fallback_note(found: Library | Diagnostic) -> str:
    """Return the sentence for a run's summary where the default matcher had to fall back; empty where the library is there."""
    if isinstance(found, Library):
        return ""
    return f"own matcher {found.message}; sgbm is used; {found.remedy}"


def model_note(found: Library | Diagnostic) -> str:
    """Return what a scan says where numpy has to make the model; empty where the library is there."""
    if isinstance(found, Library):
        return ""
    return f"the model is made by numpy, which is slower: the native library is {found.message}; {found.remedy}"


def _missing(folder: Path, error: OSError) -> Diagnostic:
    path = folder / LIBRARY_FILE
    if path.exists():
        detail = " ".join(str(error).split())
        return _absent(f"cannot be loaded ({detail})", _REINSTALL)
    try:
        reason = (folder / REASON_FILE).read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return _absent("not built", _remedy())
    return _absent(f"not built: {reason}", _remedy())


def _absent(reason: str, remedy: str) -> Diagnostic:
    return Diagnostic(reason, remedy, code="native")


def _remedy() -> str:
    return f"pkg install clang, then {TERMUX_INSTALL}" if is_android() else _INSTALL


def _choices(library: Library) -> str:
    return " or ".join(simd.value for simd in library.usable_sets())


def _declare(handle: ctypes.CDLL) -> None:
    """State the arguments and results of the library's functions."""
    handle.tandem_abi.argtypes, handle.tandem_abi.restype = [], ctypes.c_int32
    handle.tandem_sources.argtypes, handle.tandem_sources.restype = [], ctypes.c_char_p
    handle.tandem_isa_name.argtypes, handle.tandem_isa_name.restype = [ctypes.c_int32], ctypes.c_char_p
    handle.tandem_isa_state.argtypes, handle.tandem_isa_state.restype = [ctypes.c_int32], ctypes.c_int32
    handle.tandem_isa_best.argtypes, handle.tandem_isa_best.restype = [], ctypes.c_int32
    handle.tandem_match_bytes.argtypes = [ctypes.c_int32, ctypes.POINTER(MatchJob)]
    handle.tandem_match_bytes.restype = ctypes.c_int64
    for job, (name, is_per_set) in _FUNCTIONS.items():
        function = getattr(handle, name)
        function.argtypes = [*([ctypes.c_int32] if is_per_set else []), ctypes.POINTER(job)]
        function.restype = ctypes.c_int32
