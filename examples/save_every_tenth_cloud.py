"""Save every tenth cloud as PLY: `python examples/save_every_tenth_cloud.py LINK CAMERA RIG [PAIRS]`.

For example after `phone-host demo`, with the board side running in another terminal (the demo's last lines show the
command; add --link tcp://127.0.0.1:5555):

    python examples/save_every_tenth_cloud.py tcp://127.0.0.1:5555 'replay:out/demo/film/right?fps=15&loop=1' out/demo/rig.yaml
"""

import sys
from pathlib import Path

from phone_host.api import open_scanner, write_ply


def main(link: str, camera: str, rig: str, pairs: str = "100") -> None:
    """Scan and save."""
    with open_scanner(link=link, camera=camera, rig=rig, pairs=int(pairs), lossless=True) as scanner:
        for result in scanner:
            cloud = result.processed.cloud
            if result.number % 10 == 0 and cloud is not None:
                path = Path(f"cloud-{result.number:06d}.ply")
                points = write_ply(path, cloud, result.processed.pair.left)
                print(f"{path}: {points} points")


if __name__ == "__main__":
    main(*sys.argv[1:])
