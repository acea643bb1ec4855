"""The libraries that the page ships are those that `make vendor` built, from our own modules as they are now. `make vendor-check` builds them again."""

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
PINS: dict[str, Any] = json.loads((ROOT / "phone_host" / "web" / "vendor" / "versions.json").read_text())


def sha256(path: Path) -> str:
    """Return a file's hash."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize("path", sorted(PINS["made"]))
def test_what_is_shipped_is_what_was_built(path: str) -> None:
    """Every prebuilt file has the hash that `make vendor` noted."""
    assert sha256(ROOT / path) == PINS["made"][path]


@pytest.mark.parametrize("path", sorted(PINS["own"]))
def test_no_prebuilt_file_is_older_than_our_own_modules_in_it(path: str) -> None:
    """Every module of ours that was built in has the hash that it had then; otherwise `make vendor` was forgotten."""
    assert sha256(ROOT / path) == PINS["own"][path]


def test_every_library_has_its_version_and_its_licence() -> None:
    """Beside what is served lies the licence, and what is built from a library names its version."""
    served = ROOT / "phone_host" / "web" / "page" / "vendor"
    for name, package in PINS["packages"].items():
        assert "MIT" in (served / f"LICENSE.{name}").read_text()
        assert f"/* {name} {package['version']}, MIT License" in (served / f"{name}.js").read_text()
        assert re.fullmatch(r"[0-9a-f]{64}", package["tarball_sha256"])


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
