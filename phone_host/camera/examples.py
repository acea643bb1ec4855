"""Example URIs of host cameras, for help and errors. Light: imports no camera."""

from typing import Final

from common.camera.options import EXAMPLE as COMMON_EXAMPLE
from phone_host.camera.browser_uri import EXAMPLE as BROWSER_EXAMPLE
from phone_host.camera.http_uri import EXAMPLE as HTTP_EXAMPLE

EXAMPLE: Final = f"{COMMON_EXAMPLE} or {HTTP_EXAMPLE} or {BROWSER_EXAMPLE}"
