"""When a board's frames were grabbed after their exposures, as a recording tells it: in runs, one message a second for all of them. Pure."""

import json


class CaptureRuns:
    """Collects what one message of CAPTURE tells: [first sequence, [ns, ns, ...]] for each run of frames without a gap."""

    def __init__(self) -> None:
        self._runs: list[tuple[int, list[int]]] = []

    def note(self, sequence: int, capture_ns: int) -> None:
        """Take note of a frame.

        Args:
            sequence: its number.
            capture_ns: from its exposure until it was grabbed, ns.
        """
        first, values = self._runs[-1] if self._runs else (sequence, [])
        if not self._runs or first + len(values) != sequence:
            values = []
            self._runs.append((sequence, values))
        values.append(capture_ns)

    def take(self) -> bytes:
        """Return the message of what was noted, and begin anew; empty: nothing was."""
        text = json.dumps(self._runs, separators=(",", ":")).encode() if self._runs else b""
        self._runs = []
        return text
