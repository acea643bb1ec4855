"""Scan a thing while you walk around it: `python examples/scan_object.py LINK CAMERA RIG [PAIRS]`; the model is in model.ply.

For example after `phone-host demo`, as in save_every_tenth_cloud.py. The demo's things move, so little of them fits; `phone-host scan` does the same
with a page, pictures and recordings.
"""

import sys

from phone_host.api import Scan, ScanWanted, open_scanner, write_model


def main(link: str, camera: str, rig: str, pairs: str = "300") -> None:
    """Scan, tell what helps, save."""
    scan = Scan(ScanWanted(threads=2))
    with open_scanner(link=link, camera=camera, rig=rig, pairs=int(pairs)) as scanner:
        for result in scanner:
            pair = scan.take(str(result.number), result.ledger.host.exposed_ns / 1e9, result.processed)
            print(f"pair {pair.name}: {pair.state.value}{f': {pair.weakness.advice}' if pair.weakness.advice else ''}")
    model = scan.model()
    write_model("model.ply", model)
    print(f"model.ply: {scan.fused} of {len(scan.pairs)} pairs, {len(model.mesh.triangles)} triangles")


if __name__ == "__main__":
    main(*sys.argv[1:])
