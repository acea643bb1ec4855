"""board-agent cameras: list formats, rates and controls."""

import argparse
import json

from board_agent.cameras import list_cameras, table, values


def run(options: argparse.Namespace) -> int:
    """Print what this machine's cameras offer."""
    found = list_cameras()
    print(json.dumps(values(found)) if options.json else table(found))
    return 0
