"""How the native library is built, packed and found: with old, odd and no compilers."""

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from common.diagnostic import Diagnostic
from common.errors import SettingsError
from phone_host.doctor.host_checks import check_native
from phone_host.native import build_library
from phone_host.native.build_library import (
    LIBRARY_FILE,
    REASON_FILE,
    Built,
    build,
    build_or_explain,
    sources_digest,
)
from phone_host.native.library import IsaState, Library, Simd, fallback_note, load, model_note

ROOT = Path(__file__).resolve().parents[2]
NATIVE = "phone_host/native"


def loaded(folder: Path, wanted: str = "") -> Library:
    """The library in a folder."""
    library = load(folder, wanted)
    assert isinstance(library, Library), library
    return library


def test_the_checkout_has_the_library_of_its_sources(native_library: Library) -> None:
    """A library of older sources would test something else: run make native."""
    assert native_library.sources() == sources_digest()


@pytest.mark.timeout(600)  # half a minute on two idle cores
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_both_compilers_build_everything_without_a_warning(
    compiler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every instruction set of this architecture is built, and no warning is given."""
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is not installed")
    monkeypatch.setenv("CC", compiler)
    built = build(tmp_path, ["-Werror"])
    assert built.left_out == ()
    library = loaded(tmp_path)
    assert {simd.value for simd in Simd if library.state_of(simd) is not IsaState.NOT_BUILT} == set(built.sets)


def test_an_old_compiler_leaves_out_what_it_does_not_know(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A compiler that has no AVX-512 flags gives a library without it; asking for it is an error that names what can be had."""
    old = tmp_path / "old-cc"
    old.write_text(
        '#!/bin/sh\ncase "$*" in *avx512f*) echo "error: unrecognized option" >&2; exit 1 ;; esac\nexec cc "$@"\n'
    )
    old.chmod(0o755)
    monkeypatch.setenv("CC", str(old))
    built = build(tmp_path)
    if "sse41" not in built.sets:
        pytest.skip("not an x86 processor")
    assert "avx512" not in built.sets
    assert any("unrecognized option" in text for text in built.left_out)
    assert loaded(tmp_path).state_of(Simd.AVX512) is IsaState.NOT_BUILT
    with pytest.raises(
        SettingsError, match=r"TANDEMSCAN_SIMD=avx512 cannot be used: the native library was built without it.*scalar"
    ):
        load(tmp_path, "avx512")


@pytest.mark.parametrize(
    ("compiler", "reason"),
    [("no-such-compiler", "the compiler CC=no-such-compiler does not exist"), ("false", "false failed: exit 1")],
)
def test_a_build_that_fails_leaves_its_reason(
    compiler: str, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reason lies where the library would, and an older library is removed."""
    (tmp_path / LIBRARY_FILE).write_bytes(b"of yesterday")
    monkeypatch.setenv("CC", compiler)
    assert build_or_explain(tmp_path) == reason
    found = load(tmp_path)
    assert isinstance(found, Diagnostic)
    assert (found.message, found.remedy[:23]) == (f"not built: {reason}", "install gcc or clang an")
    assert fallback_note(found).startswith(f"own matcher not built: {reason}; sgbm is used; install gcc")


def test_a_later_build_removes_the_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once a compiler is installed, nothing is left of the failure."""
    monkeypatch.setenv("CC", "false")
    assert build_or_explain(tmp_path) == "false failed: exit 1"
    monkeypatch.delenv("CC")
    assert isinstance(build_or_explain(tmp_path), Built)
    assert not (tmp_path / REASON_FILE).exists()
    assert fallback_note(loaded(tmp_path)) == ""


def test_no_compiler_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without cc, gcc and clang the reason says so."""
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert build_or_explain(tmp_path / "new") == "no C compiler"


def test_a_library_that_cannot_be_loaded_or_is_of_another_version(tmp_path: Path) -> None:
    """Damaged files and other libraries of that name are no crash, but a reason with a remedy."""
    (tmp_path / LIBRARY_FILE).write_bytes(b"\x7fELF damaged")
    found = load(tmp_path)
    assert isinstance(found, Diagnostic)
    assert found.message.startswith("cannot be loaded (")
    source = tmp_path / "other.c"
    source.write_text("int tandem_abi(void) { return 0; }\n")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", tmp_path / LIBRARY_FILE, source], check=True)
    assert isinstance(load(tmp_path), Diagnostic)


def test_a_library_of_an_older_build_is_told_and_not_used(native_library: Library, tmp_path: Path) -> None:
    """One of the same ABI that lacks a function of today: matcher, doctor and scan name it, and say how to build it anew."""
    content = native_library.path.read_bytes()
    assert b"\0tandem_absorb\0" in content
    (tmp_path / LIBRARY_FILE).write_bytes(content.replace(b"\0tandem_absorb\0", b"\0tandem_abszzz\0"))
    found = load(tmp_path)
    assert isinstance(found, Diagnostic)
    assert found.message == "of an older build, without tandem_absorb"
    assert found.remedy == "reinstall; in a checkout: make native"
    assert "of an older build, without tandem_absorb" in check_native(found).message
    for note in (model_note(found), fallback_note(found)):
        assert "of an older build, without tandem_absorb; " in note
        assert note.endswith("make native")
    assert model_note(native_library) == ""


def test_the_instruction_set_can_be_chosen(native_library: Library) -> None:
    """TANDEMSCAN_SIMD takes every set that can be used; another word, or one of another processor, is an error that lists them."""
    folder = native_library.path.parent
    for simd in native_library.usable_sets():
        assert loaded(folder, simd.value).simd is simd
    assert native_library.simd is native_library.usable_sets()[0]
    with pytest.raises(SettingsError, match=r"TANDEMSCAN_SIMD=mmx is no instruction set: give .*scalar"):
        load(folder, "mmx")
    other = Simd.NEON if native_library.state_of(Simd.NEON) is IsaState.NOT_BUILT else Simd.AVX2
    with pytest.raises(SettingsError, match="cannot be used"):
        load(folder, other.value)


def test_the_doctor_tells_an_unusable_choice() -> None:
    """A wrong TANDEMSCAN_SIMD is a finding of the doctor, not a traceback."""
    environment = {**os.environ, "TANDEMSCAN_SIMD": "mmx"}
    code = "from phone_host.doctor.host_doctor import native_finding; print(native_finding())"
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert "TANDEMSCAN_SIMD=mmx is no instruction set" in done.stdout


def test_sdist_and_wheel_hold_what_they_must(tmp_path: Path) -> None:
    """The sdist holds all sources and no library; a wheel made from it holds one library for every Python 3 and the whole page, and no source of either."""
    make = "import setuptools.build_meta as b, sys; print(b.build_sdist(sys.argv[1]))"
    copy = tmp_path / "tree"
    files = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout.decode()
    for name in filter(None, files.split("\0")):
        if not name.startswith(("tests/", "docs/")) and (ROOT / name).is_file():
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, copy / name)
    subprocess.run([sys.executable, "-c", make, tmp_path], cwd=copy, check=True, capture_output=True)
    (sdist,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        inside = {name.partition("/")[2] for name in archive.getnames()}
    assert {f"{NATIVE}/src/{path.name}" for path in build_library.SOURCES.iterdir()} | {"setup.py"} <= inside
    assert f"{NATIVE}/{LIBRARY_FILE}" not in inside
    pip = [sys.executable, "-m", "pip", "--no-input", "wheel", "-q", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--no-index", "-w", tmp_path, sdist], check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    assert "-py3-none-" in wheel.name
    assert not wheel.name.endswith("-any.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        archive.extractall(tmp_path / "wheel")
    pages = (ROOT / "phone_host" / "web" / "page").rglob("*")
    page = {path.relative_to(ROOT).as_posix() for path in pages if path.is_file()}
    assert page | {"phone_host/report/page_copy.js", "phone_host/report/page_depth.js"} <= set(names)
    assert not [name for name in names if name.startswith("phone_host/web/vendor/")]
    assert [name for name in names if name.startswith(NATIVE) and not name.endswith(".py")] == [
        f"{NATIVE}/{LIBRARY_FILE}"
    ]
    assert loaded(tmp_path / "wheel" / NATIVE).sources() == sources_digest()
