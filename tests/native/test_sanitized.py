"""The same tests with a library that checks every access and every operation (AddressSanitizer, UndefinedBehaviorSanitizer).

All files of this folder run again in a process of their own, so what is added to them is sanitized, too.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from phone_host.native.build_library import build, find_compiler
from tests.native.conftest import FOLDER

FLAGS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer", "-O1", "-g1")
HERE = Path(__file__).resolve().parent
NOT_AGAIN = ("test_sanitized.py", "test_build.py", "test_arm_program.py")


def runtime(compiler: tuple[str, ...]) -> str:
    """Path of the compiler's AddressSanitizer, which must be loaded before Python; skips where there is none."""
    name = subprocess.run([*compiler, "-print-file-name=libasan.so"], capture_output=True, text=True, check=False)
    path = Path(name.stdout.strip())
    if not path.is_absolute():
        pytest.skip("this compiler has no shared libasan (gcc has one: CC=gcc)")
    return str(path)


@pytest.fixture(scope="module")
def sanitized(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment with the sanitized library, built once."""
    return built_into(tmp_path_factory.mktemp("sanitized"))


def built_into(folder: Path) -> dict[str, str]:
    """Build the library with sanitizers; return the environment in which Python can load it."""
    compiler = find_compiler()
    preload = runtime(compiler)
    build(folder, FLAGS)
    return {
        **os.environ,
        FOLDER: str(folder),
        "LD_PRELOAD": preload,
        "ASAN_OPTIONS": "detect_leaks=0:abort_on_error=0:exitcode=99",  # Python itself keeps memory to the end
        "UBSAN_OPTIONS": "print_stacktrace=1",
        "PYTHONMALLOC": "malloc",
    }


@pytest.mark.timeout(900)  # building with sanitizers, too; everything runs several times slower
def test_no_access_outside_and_no_undefined_operation(sanitized: dict[str, str]) -> None:
    """Every other test of this folder passes with the sanitized library, on every instruction set."""
    left_out = [f"--ignore={HERE / name}" for name in NOT_AGAIN]
    command = [sys.executable, "-m", "pytest", "-q", "-n0", "-p", "no:cacheprovider", *left_out, str(HERE)]
    done = subprocess.run(
        command, cwd=HERE.parents[1], env=sanitized, capture_output=True, text=True, check=False, timeout=800
    )
    assert done.returncode == 0, f"{done.stdout[-3000:]}\n{done.stderr[-5000:]}"


@pytest.mark.timeout(900)
def test_the_sanitizers_are_on(sanitized: dict[str, str]) -> None:
    """A cloud that is one row too small for its disparities is reported: the check above would see such a fault."""
    code = (
        "import os, numpy as np\n"
        "from pathlib import Path\n"
        "from phone_host.native.library import PackJob, load\n"
        f"library = load(Path(os.environ['{FOLDER}']))\n"
        "cloud, colours, records = np.ones((3, 90, 3), np.float32), np.zeros((4, 90), np.uint8), np.empty(15 * 361, np.uint8)\n"
        "library.run(PackJob(cloud_m=cloud.ctypes.data, colours=colours.ctypes.data, records=records.ctypes.data,\n"
        "    cloud_stride=270, colour_stride=90, width=90, height=4, channels=1))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], env=sanitized, capture_output=True, text=True, check=False)
    assert done.returncode == 99
    assert "heap-buffer-overflow" in done.stderr
