"""The scripts of static pages: the live page's own modules, prebuilt, so that the project has one viewer. Light.

A page holds its script as text and names the text's hash in its policy. The scripts take all values from attributes and
load nothing. `make vendor` builds them; a test compares their hashes.
"""

import base64
import hashlib
from enum import Enum
from functools import cache
from importlib import resources


class Script(Enum):
    """What a page needs; the value is the file beside this module."""

    CHARTS = "page_charts.js"
    COPY = "page_copy.js"
    DEPTH = "page_depth.js"


@cache
def script(kind: Script) -> str:
    """Return the text of a script.

    Args:
        kind: CHARTS draws charts; COPY connects buttons that copy commands; DEPTH reads depth and turns the cloud, too.
    """
    return resources.files(__package__).joinpath(kind.value).read_text("ascii")


@cache
def script_hash(kind: Script) -> str:
    """Return what a page's policy allows (Content Security Policy, level 3): this text and no other."""
    return "sha256-" + base64.b64encode(hashlib.sha256(script(kind).encode()).digest()).decode("ascii")
