"""How the URI of an own camera looks, for help and for errors. Light: no camera is imported."""

from typing import Final

from common.camera.options import EXAMPLE as COMMON_EXAMPLE
from phone_host.camera.http_uri import EXAMPLE as HTTP_EXAMPLE

EXAMPLE: Final = f"{COMMON_EXAMPLE} or {HTTP_EXAMPLE}"
