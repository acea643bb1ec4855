"""Scan a thing: `python examples/scan_object.py LINK CAMERA RIG [WAY] [PAIRS]`; the model is in the folder `scan`, as `phone-host scan` leaves it.

WAY is how: `around` (walk around it), `table` (around a thing on a table), `mat` (the printed mat lies below it) or `turntable` (it turns, the cameras stand
still). For example after `phone-host demo`, as in save_every_tenth_cloud.py. The demo's things move, so little of them fits.
"""

import sys

from phone_host.api import ScanWanted, open_scanner, parse_mat, save_scan, scan_for

WAYS = {
    "around": ScanWanted(threads=2),
    "table": ScanWanted(on_table=True, threads=2),
    "mat": ScanWanted(mat=parse_mat("10x8:25mm:18mm:5x5"), threads=2),
    "turntable": ScanWanted(turntable=True, threads=2),
}


def main(link: str, camera: str, rig: str, way: str = "around", pairs: str = "300") -> None:
    """Scan, tell what helps, save."""
    scan = scan_for(WAYS[way])
    with open_scanner(link=link, camera=camera, rig=rig, pairs=int(pairs)) as scanner:
        for result in scanner:
            pair = scan.take(str(result.number), result.ledger.host.exposed_ns / 1e9, result.processed)
            print(f"pair {pair.name}: {pair.state.value}{f': {pair.weakness.advice}' if pair.weakness.advice else ''}")
    save_scan("scan", scan, matcher="tandem")
    print(f"scan/model.ply: {scan.fused} of {len(scan.pairs)} pairs")


if __name__ == "__main__":
    main(*sys.argv[1:])
