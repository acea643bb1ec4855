"""The program that compares bits on ARM (`make test-arm`), here with this machine's own library."""

import os
import subprocess
from pathlib import Path

from phone_host.native.build_library import find_compiler
from phone_host.native.library import Library
from tests.native.arm import built_program, every_case, write_cases


def test_the_program_agrees_with_python_and_sees_one_wrong_bit(native_library: Library, tmp_path: Path) -> None:
    """All sets of this machine give the bits that Python saw; with the last bit of a pixel turned over, all report it."""
    compiler = find_compiler()[0]
    program = built_program(compiler, native_library.path, tmp_path)
    cases = tmp_path / "cases"
    written = every_case(native_library)
    write_cases(cases, written)
    environment = {**os.environ, "LD_LIBRARY_PATH": str(native_library.path.parent)}
    done = subprocess.run([program, cases], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count(f"{len(written)} of {len(written)} cases") == len(native_library.usable_sets())
    content = bytearray(cases.read_bytes())
    content[-1] ^= 1
    cases.write_bytes(content)
    done = subprocess.run([program, cases], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stdout.count(f"case {len(written) - 1} of kind 2: field 4 differs") == len(native_library.usable_sets())
