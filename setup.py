"""The build of the native library; everything else about the package stands in pyproject.toml.

The library is no extension module but a plain shared library for ctypes: one file serves all versions of Python, so the
wheel's tag is py3-none-PLATFORM. A missing compiler or a failing build does not fail the installation (see `build_library`).
"""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from setuptools import Extension, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent
PACKAGE = Path("phone_host", "native")


def _builder() -> ModuleType:
    """Load build_library.py by its path: what the package imports is not installed while it is built."""
    spec = importlib.util.spec_from_file_location("tandem_build_library", ROOT / PACKAGE / "build_library.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


BUILDER = _builder()


class BuildNative(build_ext):
    """Builds the library into the build folder, or for an editable installation into the checkout."""

    def run(self) -> None:
        """Build, or leave the reason why not."""
        built = BUILDER.build_or_explain(self._folder())
        if isinstance(built, str):
            self.warn(f"the native library was not built ({built}); OpenCV's matcher is used instead")
        else:
            for text in built.left_out:
                self.warn(f"the native library is built without {text}")

    def get_ext_filename(self, fullname: str) -> str:
        """Return the library's path in the package, without a tag of a version of Python."""
        return str(Path(*fullname.split(".")).with_name(BUILDER.LIBRARY_FILE))

    def get_outputs(self) -> list[str]:
        """Return what was made."""
        folder = Path(self.build_lib, PACKAGE)
        return [str(path) for name in (BUILDER.LIBRARY_FILE, BUILDER.REASON_FILE) if (path := folder / name).exists()]

    def get_output_mapping(self) -> dict[str, str]:
        """Return nothing: an editable installation finds the library where it was made."""
        return {}

    def _folder(self) -> Path:
        return ROOT / PACKAGE if self.inplace or self.editable_mode else Path(self.build_lib, PACKAGE)


class Wheel(bdist_wheel):
    """A wheel for one platform and every Python 3."""

    def get_tag(self) -> tuple[str, str, str]:
        """Return the tag."""
        return ("py3", "none", super().get_tag()[2])


setup(
    ext_modules=[Extension("phone_host.native._tandem", sources=[], optional=True)],
    cmdclass={"build_ext": BuildNative, "bdist_wheel": Wheel},
)
