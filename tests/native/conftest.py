"""The library under test: that of this checkout, or one built with sanitizers (see test_sanitized.py)."""

import os
from pathlib import Path

import pytest

from phone_host.native import library as product
from phone_host.native.library import IsaState, Library, Simd, load

FOLDER = "TANDEM_LIBRARY_FOLDER"
"""Environment variable of these tests: where the library under test lies."""


@pytest.fixture(scope="session")
def native_library() -> Library:
    """The library under test, on the widest instruction set of this processor."""
    found = load(Path(os.environ.get(FOLDER, str(Path(product.__file__).parent))))
    if not isinstance(found, Library):
        pytest.fail(f"no native library ({found.message}): run make native")
    return found


@pytest.fixture(params=list(Simd), ids=lambda simd: simd.value)
def library(native_library: Library, request: pytest.FixtureRequest) -> Library:
    """The library, once per instruction set."""
    simd: Simd = request.param
    state = native_library.state_of(simd)
    if state is IsaState.NOT_BUILT:
        pytest.skip(f"{simd.text} is not built: another architecture, or a compiler without it")
    if state is IsaState.NOT_SUPPORTED:
        pytest.skip(f"this processor has no {simd.text}")
    return native_library.using(simd)
