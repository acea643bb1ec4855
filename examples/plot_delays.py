"""Plot where the time goes: `python examples/plot_delays.py LINK CAMERA [PAIRS]` writes delays.svg. It needs no rig: pairs are not matched."""

import sys
from pathlib import Path

import numpy as np

from phone_host.api import DELAYS, open_scanner

WIDTH_PX, ROW_PX, LEFT_PX = 800, 28, 120


def main(link: str, camera: str, pairs: str = "300") -> None:
    """Measure, then plot the median and the 95th percentile of each delay as bars."""
    with open_scanner(link=link, camera=camera, pairs=int(pairs), lossless=True) as scanner:
        ledgers = [result.ledger for result in scanner]
    delays_ms = {name: np.array([getattr(ledger, f"{name}_ns") for ledger in ledgers]) / 1e6 for name in DELAYS}
    longest_ms = max(float(np.percentile(values, 95)) for values in delays_ms.values()) or 1.0
    rows = []
    for row, (name, values) in enumerate(delays_ms.items()):
        median_ms, p95_ms = (float(value) for value in np.percentile(values, (50, 95)))
        scale, y = (WIDTH_PX - LEFT_PX) / longest_ms, row * ROW_PX
        rows.append(f'<rect x="{LEFT_PX}" y="{y}" width="{p95_ms * scale:.1f}" height="20" fill="#bfdbfe"/>')
        rows.append(f'<rect x="{LEFT_PX}" y="{y}" width="{median_ms * scale:.1f}" height="20" fill="#2563eb"/>')
        rows.append(f'<text x="0" y="{y + 15}">{name}</text>')
        rows.append(f'<text x="{LEFT_PX + 4}" y="{y + 15}">{median_ms:.2f} ms; 95 %: {p95_ms:.2f} ms</text>')
    size = f'width="{WIDTH_PX}" height="{ROW_PX * len(delays_ms)}"'
    text = "".join(rows)
    Path("delays.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="13">{text}</svg>\n'
    )
    print(f"delays.svg: {len(ledgers)} pairs, end-to-end {np.median(delays_ms['end_to_end']):.1f} ms at the median")


if __name__ == "__main__":
    main(*sys.argv[1:])
