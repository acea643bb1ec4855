"""Says which Python package is missing and what installs it. Light: every start of a command imports it, and it imports none of them."""

import sys
from dataclasses import dataclass
from typing import Final

from common.android import INSTALL, is_android
from common.errors import UnavailableError
from common.plain_text import printable

_OURS: Final = frozenset({"common", "board_agent", "phone_host"})


@dataclass(frozen=True, slots=True)
class Distribution:
    """Where a module comes from.

    Attributes:
        name: its name on PyPI.
        debian: Debian's package of it that the board's package depends on; empty: none.
        extra: our extra that brings it; empty: it belongs to every installation of the host.
    """

    name: str
    debian: str = ""
    extra: str = ""


_DISTRIBUTIONS: Final = {
    "cv2": Distribution("opencv-python-headless"),
    "dbus_fast": Distribution("dbus-fast", "python3-dbus-fast", "bluetooth"),
    "lz4": Distribution("lz4", extra="recordings"),
    "manifold3d": Distribution("manifold3d", extra="print"),
    "msgpack": Distribution("msgpack", "python3-msgpack"),
    "onnxruntime": Distribution("onnxruntime", extra="onnx"),
    "rosbags": Distribution("rosbags", extra="recordings"),
    "serial": Distribution("pyserial", "python3-serial"),
    "yaml": Distribution("PyYAML"),
    "zmq": Distribution("pyzmq", "python3-zmq"),
    "zstandard": Distribution("zstandard", extra="recordings"),
}
"""By the module's name. A module that is not listed comes from the distribution of the same name."""


def remedy_for(module: str, *, on_android: bool) -> str:
    """Say what installs a module.

    Args:
        module: its name, for example `cv2`.
        on_android: whether this is Termux, whose script installs all that there is for it.
    """
    found = _DISTRIBUTIONS.get(module, Distribution(module))
    if on_android and not found.extra:
        return INSTALL
    if found.extra:
        others = [f"apt install {found.debian}"] if found.debian else []
        return " or ".join([f"pip install 'tandemscan[{found.extra}]'", *others])
    debian = f" or apt install {found.debian}" if found.debian else ""
    return f"pip install {found.name}{debian}; in a checkout: make run-venv"


def package_error(error: ImportError, purpose: str = "") -> UnavailableError | None:
    """Put a failed import into words.

    Args:
        error: what Python raised, or what a package raised instead of it.
        purpose: what the package was needed for, for example `the page`; empty: the command.

    Returns:
        The error to report; None if no other package is to blame: a module of our own is missing, which is a bug.
    """
    blamed = _blamed(error)
    if blamed is None or not blamed.name:
        return None
    module = blamed.name.partition(".")[0]
    name = _DISTRIBUTIONS.get(module, Distribution(module)).name
    needs = f"{purpose or 'this command'} needs the package {name}"
    if module in sys.stdlib_module_names:
        return UnavailableError(f"Python's module {module} is missing", "install a Python with all its modules")
    remedy = remedy_for(module, on_android=is_android())
    if isinstance(blamed, ModuleNotFoundError):
        return UnavailableError(f"{needs}, which is not installed", f"install it: {remedy}")
    return UnavailableError(f"{needs}, which cannot be loaded ({printable(str(blamed))})", f"install it anew: {remedy}")


def _blamed(error: BaseException | None) -> ImportError | None:
    """Return the first error of the chain that names a module of others: numpy raises one without a name in place of the loader's."""
    while error is not None:
        if isinstance(error, ImportError) and error.name and error.name.partition(".")[0] not in _OURS:
            return error
        error = error.__cause__ or error.__context__
    return None
