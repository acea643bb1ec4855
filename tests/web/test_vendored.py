"""The libraries that the page ships are those of npm, unchanged, and what is built from them is what the sources give."""

import base64
import hashlib
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "phone_host" / "web" / "vendor"
PINS: dict[str, Any] = json.loads((SOURCES / "versions.json").read_text())


def sha256(path: Path) -> str:
    """Return a file's hash."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize("path", sorted(PINS["made"]))
def test_what_is_shipped_is_what_was_built(path: str) -> None:
    """Every prebuilt file has the hash that `make vendor` noted."""
    assert sha256(ROOT / path) == PINS["made"][path]


def test_the_sources_are_complete_with_their_licences() -> None:
    """Each file taken from a tarball lies there unchanged; each library has its licence, also beside what is served."""
    for name, package in PINS["packages"].items():
        for file, digest in package["files"].items():
            assert sha256(SOURCES / name / Path(file).name) == digest
        assert "MIT" in (SOURCES / name / "LICENSE").read_text()
        assert (ROOT / "phone_host" / "web" / "page" / "vendor" / f"LICENSE.{name}").is_file()
        assert json.loads((SOURCES / name / "package.json").read_text())["version"] == package["version"]


@pytest.mark.parametrize("name", sorted(PINS["packages"]))
def test_the_sources_are_those_of_npm(name: str, tmp_path: Path) -> None:
    """The tarball that npm gives for this version has the noted hash."""
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("needs npm")
    wanted = f"{name}@{PINS['packages'][name]['version']}"
    done = subprocess.run(
        [npm, "pack", "--silent", wanted], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=100
    )
    if done.returncode:
        pytest.skip(f"npm does not give {wanted}")
    assert sha256(tmp_path / done.stdout.strip()) == PINS["packages"][name]["tarball_sha256"]


def test_the_build_gives_the_same_bytes(tmp_path: Path) -> None:
    """Built again from the sources and the page's own modules, every prebuilt file is the same: none is older than its sources."""
    if shutil.which("node") is None or shutil.which("npx") is None:
        pytest.skip("needs node and npx")
    done = subprocess.run(
        ["node", str(ROOT / ".ci" / "vendor.mjs"), "build", str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
        timeout=110,
    )
    if done.returncode and "esbuild" in done.stderr:
        pytest.skip("npx does not give esbuild")
    assert done.returncode == 0, done.stderr
    made = json.loads((tmp_path / "versions.json").read_text())["made"]
    # Compressed bytes depend on the compressor's version: what they unpack to does not, and the text's hash says it.
    plain = {path: digest for path, digest in made.items() if not path.endswith((".br", ".gz"))}
    assert plain == {path: digest for path, digest in PINS["made"].items() if path in plain}


def test_the_modules_parse_and_load_only_each_other() -> None:
    """Every module passes `node --check`; imports name files that lie there; the page's markup names files that lie there."""
    folder = ROOT / "phone_host" / "web" / "page"
    modules = sorted(folder.glob("*.js"))
    assert len(modules) > 15
    for module in modules:
        text = module.read_text()
        for line in text.splitlines():
            if line.startswith("import ") and " from '" in line:
                assert (folder / line.split(" from '")[1].rstrip("';")).is_file(), line
        if node := shutil.which("node"):
            subprocess.run([node, "--check", str(module)], check=True, timeout=60)
    page = (folder / "index.html").read_text()
    for name in [part.split('"')[0] for part in page.split('"/static/')[1:]]:
        assert (folder / name).is_file(), name
    assert "style=" not in page


def test_the_colours_are_opencvs() -> None:
    """The page's ramp is viridis as OpenCV has it: the files' and the page's colours mean the same."""
    text = (ROOT / "phone_host" / "web" / "page" / "ramp.js").read_text()
    shown = "".join(re.findall(r"'([A-Za-z0-9+/=]{16,})'", text))
    ramp = np.frombuffer(base64.b64decode(shown), np.uint8).reshape(256, 3)
    levels = np.arange(256, dtype=np.uint8)[None]
    assert (ramp == np.asarray(cv2.applyColorMap(levels, cv2.COLORMAP_VIRIDIS))[0][:, ::-1]).all()
