"""The scripts of static pages: the live page's own modules, prebuilt, so that the project has one viewer. Light.

A page holds its script as text and names the text's hash in its policy: the library that the live page loads, too, then what is built of
our modules. The scripts take all values from attributes and load nothing. `make vendor` builds them; a test compares their hashes.
"""

import base64
import hashlib
from enum import Enum
from functools import cache
from importlib import resources


class Script(Enum):
    """What a page needs; the value is its files in this package."""

    CHARTS = ("web/page/vendor/uplot.js", "report/page_charts.js")
    COPY = ("report/page_copy.js",)
    DEPTH = ("web/page/vendor/three.js", "report/page_depth.js")


@cache
def script(kind: Script) -> str:
    """Return the text of a script.

    Args:
        kind: CHARTS draws charts; COPY connects buttons that copy commands; DEPTH reads depth and turns the cloud, too.
    """
    package = resources.files("phone_host")
    return "".join(package.joinpath(file).read_text("ascii") for file in kind.value)


@cache
def script_hash(kind: Script) -> str:
    """Return what a page's policy allows (Content Security Policy, level 3): this text and no other."""
    return "sha256-" + base64.b64encode(hashlib.sha256(script(kind).encode()).digest()).decode("ascii")
