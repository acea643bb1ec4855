"""Show a recording in Rerun: `python examples/show_in_rerun.py session.mcap` (pip install rerun-sdk), or save it: add `session.rrd`.

Rerun also opens the file itself (`rerun session.mcap`). This example shows how a program of yours reads one.
"""

import sys
from pathlib import Path

from phone_host.api import PixelFormat, open_recorded

_TYPES = {PixelFormat.MJPEG: "image/jpeg", PixelFormat.PNG: "image/png"}


def main(path: str, saved: str = "") -> None:
    """Send every image with the time of its exposure, to a window or into a file."""
    import rerun  # noqa: PLC0415 - only this example needs it

    recorded = open_recorded(Path(path))
    rerun.init("tandemscan", spawn=not saved)
    if saved:
        rerun.save(saved)
    for topic, images in recorded.images.items():
        for shown in images:
            image = shown.image
            rerun.set_time("exposed", timestamp=image.stamp_ns / 1e9)
            if image.pixel_format in _TYPES:
                encoded = rerun.EncodedImage(contents=bytes(image.payload), media_type=_TYPES[image.pixel_format])
                rerun.log(topic, encoded)


if __name__ == "__main__":
    main(*sys.argv[1:])
