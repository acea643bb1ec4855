"""board-agent cameras: list formats, rates and controls."""

import argparse
import json
import os
import sys

from board_agent.cameras import list_cameras, table, values
from common.camera.v4l2_device import video_nodes
from common.program.terminal import fitted


def run(options: argparse.Namespace) -> int:
    """Print what this machine's cameras offer."""
    found = list_cameras()
    print(json.dumps(values(found)) if options.json else fitted(table(found)))
    if closed := [str(path) for path in video_nodes() if not os.access(path, os.R_OK | os.W_OK)]:
        print(
            f"board-agent: this user may not open {', '.join(closed)}: use sudo, or join the group video",
            file=sys.stderr,
        )
    return 0
