"""Makes Debian's Python say what Android's says, and hides what that one lacks. The first module that any program here imports.

`platform` and `sysconfig` go on naming Linux, so that pip takes wheels that run here: they stand for Android's of the same version.
"""

import ctypes  # noqa: F401 - on Android it would look for libpython, which Debian's interpreter has inside
import platform
import socket
import sys
import sysconfig

platform.uname()  # remembers the answer
_NAMED = sysconfig.get_platform()
sysconfig.get_platform = lambda: _NAMED
sys.platform = "android"
for name in ("grp", "_posixshmem", "_multiprocessing"):
    sys.modules[name] = None  # type: ignore[assignment]  # the import system's sign for "not to be found"
for name in [name for name in vars(socket) if name.startswith(("AF_BLUETOOTH", "BTPROTO", "BDADDR"))]:
    delattr(socket, name)
