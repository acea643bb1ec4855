"""What the project's own files promise: packages, pins, licence, version, imports, commands."""

import fnmatch
import hashlib
import importlib.metadata
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from common.versions import PACKAGE_VERSION
from phone_host.native.build_library import LIBRARY_FILE, REASON_FILE

ROOT = Path(__file__).resolve().parents[3]
TOP_PACKAGES = ("board_agent", "common", "phone_host")
COMMANDS = ("board-agent", "phone-host", "delay-bench")
BIN = Path(sys.executable).parent
MARKERS_OF_LINUX = [
    {"python_version": version, "python_full_version": f"{version}.9", "sys_platform": "linux"}
    for version in ("3.11", "3.12", "3.13", "3.14")
]


def pyproject() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def pinned(name: str) -> list[str]:
    """The requirements of a file, one string each, hashes included."""
    text = (ROOT / "requirements" / name).read_text(encoding="utf-8").replace("\\\n", " ")
    return [line for line in text.splitlines() if line.strip() and not line.startswith("#")]


def without_hashes(line: str) -> Requirement:
    return Requirement(line.split("--hash", 1)[0].strip())


def modules_in_tree(*packages: str) -> list[str]:
    paths = [path.relative_to(ROOT) for package in packages for path in sorted((ROOT / package).rglob("*.py"))]
    names = [".".join(path.with_suffix("").parts) for path in paths if path.name != "__main__.py"]
    return [name.removesuffix(".__init__") for name in names]


def run_python(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, cwd=ROOT).stdout


def test_package_list_is_the_tree() -> None:
    """Every folder with Python files is in the explicit package list, and nothing else is."""
    folders = {path.parent.relative_to(ROOT) for top in TOP_PACKAGES for path in (ROOT / top).rglob("*.py")}
    assert sorted(".".join(folder.parts) for folder in folders) == sorted(pyproject()["tool"]["setuptools"]["packages"])


def test_package_data_reach_the_wheel() -> None:
    """Every other file in a package (pages, py.typed) is covered by a package-data pattern; otherwise the wheel would lack it."""
    patterns: dict[str, list[str]] = pyproject()["tool"]["setuptools"]["package-data"]
    left_out = []
    for package in pyproject()["tool"]["setuptools"]["packages"]:
        for path in (ROOT / package.replace(".", "/")).iterdir():
            wanted = patterns.get("*", []) + patterns.get(package, [])
            built = path.name in {LIBRARY_FILE, REASON_FILE}  # by setup.py, which puts it into the wheel itself
            if path.is_file() and path.suffix not in {".py", ".pyc"} and not built:
                left_out += [] if any(fnmatch.fnmatch(path.name, pattern) for pattern in wanted) else [str(path)]
    assert left_out == []


@pytest.mark.parametrize("package", TOP_PACKAGES)
def test_packages_are_typed(package: str) -> None:
    """Each package has the marker that lets type checkers read its annotations."""
    assert (ROOT / package / "py.typed").is_file()


@pytest.mark.parametrize("name", ["run.txt", "dev.txt", "bench.txt", "docs.txt", "fuzz.txt"])
def test_pins_have_hashes_and_no_address(name: str) -> None:
    """Every requirement is one exact version with hashes, and no line names an index or a local path."""
    text = (ROOT / "requirements" / name).read_text(encoding="utf-8")
    assert not re.search(r"://|--index|--extra-index|--find-links|^-|@|(^|\s)/", text, re.MULTILINE)
    for line in pinned(name):
        assert [clause.operator for clause in without_hashes(line).specifier] == ["=="], line
        assert re.fullmatch(r"[^#]*?( +--hash=sha256:[0-9a-f]{64})+ *", line), line


@pytest.mark.parametrize("markers", MARKERS_OF_LINUX, ids=lambda markers: markers["python_version"])
@pytest.mark.parametrize("name", ["run.txt", "dev.txt"])
def test_pins_satisfy_the_ranges(name: str, markers: dict[str, str]) -> None:
    """For each Python version every dependency, extra and build requirement has exactly one pin, which lies in its range."""
    project = pyproject()["project"]
    extras = project["optional-dependencies"]
    ranges = [*pyproject()["build-system"]["requires"], *project["dependencies"], *extras["bluetooth"]]
    ranges += extras["dev"] if name == "dev.txt" else []
    pins: dict[str, str] = {}
    for pin in map(without_hashes, pinned(name)):
        if pin.marker is None or pin.marker.evaluate(markers):
            package = canonicalize_name(pin.name)
            assert package not in pins, f"two versions of {package}"
            pins[package] = next(iter(pin.specifier)).version
    for wanted in map(Requirement, ranges):
        version = pins.get(canonicalize_name(wanted.name), "none")
        assert version != "none" and wanted.specifier.contains(version), f"{wanted}: pinned {version}; run make lock"  # noqa: PT018


def test_development_only_adds_packages() -> None:
    """Whoever runs `make demo` first and `make venv` later gets no package replaced: each pin of run.txt is one of dev.txt.

    A development tool may want a package on more Pythons than we do: dev.txt may name fewer conditions for it.
    """
    dev = {" ".join(line.split()) for line in pinned("dev.txt")}
    for line in pinned("run.txt"):
        pin, _, rest = line.partition(" ;")
        always = " ".join([*pin.split(), *re.findall(r"--hash=\S+", rest)])
        assert {" ".join(line.split()), always} & dev, line


def test_the_demo_needs_no_development_tools() -> None:
    """`make demo` installs run.txt alone; it has no test runner, linter or type checker."""
    names = {without_hashes(line).name for line in pinned("run.txt")}
    assert names & {Requirement(text).name for text in pyproject()["project"]["optional-dependencies"]["dev"]} == set()
    done = subprocess.run(
        ["make", "--dry-run", "--always-make", "demo"], cwd=ROOT, check=True, capture_output=True, text=True
    )
    assert [line for line in done.stdout.splitlines() if ".ci/venv" in line] == [".ci/venv run"]


@pytest.mark.parametrize("name", ["bench.txt", "docs.txt", "fuzz.txt"])
def test_other_pins_agree_with_the_rest(name: str) -> None:
    """The requirements of benchmarks and fuzzing never change the version of a package that the product was tested with."""
    tested = {str(without_hashes(line)).split(";")[0].strip() for line in pinned("dev.txt")}
    names = {Requirement(text).name for text in tested}
    for requirement in map(without_hashes, pinned(name)):
        assert requirement.name not in names or str(requirement).split(";")[0].strip() in tested


def test_only_one_opencv_is_pinned() -> None:
    """Two OpenCV distributions overwrite each other's files, so exactly one is installed."""
    names = {
        without_hashes(line).name
        for name in ("run.txt", "dev.txt", "bench.txt", "docs.txt", "fuzz.txt")
        for line in pinned(name)
    }
    assert {name for name in names if "opencv" in name} == {"opencv-python-headless"}


def test_licence_is_apache_2() -> None:
    """The licence file is the unaltered Apache-2.0 text, and the metadata name the same licence."""
    # The digest of the text that the Apache Software Foundation publishes as LICENSE-2.0.txt.
    published = "cfc7749b96f63bd31c3c42b5c471bf756814053e847c10f3eb003417bc523d30"
    assert hashlib.sha256((ROOT / "LICENSE").read_bytes()).hexdigest() == published
    assert pyproject()["project"]["license"] == "Apache-2.0"


def test_version_has_one_source() -> None:
    """The version is in common/versions.py only: pyproject.toml takes it from there, the installed metadata repeat it, and no other module states a version.

    Older metadata mean an outdated environment: run `make venv`, or `pip install -e . --no-deps`.
    """
    project = pyproject()
    assert project["project"]["dynamic"] == ["version"]
    assert "version" not in project["project"]
    assert project["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "common.versions.PACKAGE_VERSION"}
    assert importlib.metadata.version("tandemscan") == PACKAGE_VERSION
    own = re.compile(r"^\s*(__version__|(PACKAGE_)?VERSION)\b[^=]*=\s*[\"'f]", re.MULTILINE)
    files = [path for top in TOP_PACKAGES for path in (ROOT / top).rglob("*.py") if path.name != "versions.py"]
    assert [str(path) for path in files if own.search(path.read_text(encoding="utf-8"))] == []


def test_board_loads_only_what_debian_gives_it() -> None:
    """Importing every module of common and board_agent, except the one that talks to BlueZ, loads no package but pyzmq, msgpack and pyserial, and no asyncio."""
    modules = [name for name in modules_in_tree("common", "board_agent") if name != "common.link.bluez"]
    code = (
        "import importlib, sys\n"
        "before = set(sys.modules)\n"
        f"for name in {modules!r}: importlib.import_module(name)\n"
        "tops = {name.partition('.')[0] for name in set(sys.modules) - before}\n"
        "print(*sorted(name for name in tops - set(sys.stdlib_module_names) if 'cython' not in name))\n"
        "print('asyncio' in sys.modules)\n"
    )
    tops, asyncio_loaded = run_python(code).splitlines()
    assert set(tops.split()) <= {"board_agent", "common", "zmq", "msgpack", "serial"}
    assert asyncio_loaded == "False"


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_ignore_a_foreign_common(command: str, tmp_path: Path) -> None:
    """A command started in a folder that holds a foreign `common` package uses our own."""
    foreign = tmp_path / "common"
    foreign.mkdir()
    (foreign / "__init__.py").write_text("raise RuntimeError('the foreign common was imported')\n", encoding="utf-8")
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    done = subprocess.run(
        [BIN / command, "--help"], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert command in done.stdout
