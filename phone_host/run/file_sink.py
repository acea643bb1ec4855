"""A run's results on disk: settings.json, delays.jsonl, pair folders, report.json, the page. A full disk loses nothing that memory can keep, and never stops the run.

While writing fails, lines of delays.jsonl wait in memory (bounded) and pairs are counted as unsaved; when there is room again the lines
follow in order. What is still missing at the end is said with the exit code. A disk that is only slower than the pairs costs saved pairs, each
counted as a drop of the sink `pairs`, and never a line.

Of an earlier run in the same folder what it listed there as its own is removed (`output/listed.py`); anything else in the way ends the run
before it begins. All files survive a power cut; saved pairs are synced in the thread of their queue.
"""

import errno
import json
import logging
import os
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from common import now
from common.errors import UnavailableError
from common.ledger import PairLedger
from common.program.logs import event
from phone_host.measure.sink_account import SinkAccount
from phone_host.model import Processed, Result, Unwritten
from phone_host.output.listed import ListedFolder
from phone_host.output.pfm import write_pfm
from phone_host.output.ply import write_ply
from phone_host.output.preview import write_png
from phone_host.run.sinks import SinkQueue

_LOG = logging.getLogger(__name__)

_RETRY_NS: Final = 1_000_000_000
"""While the disk is full it is tried again this often, not at every pair."""

_PENDING_BYTES: Final = 16 * 1024 * 1024
"""Lines kept while the disk is full: about ten minutes at 30 pairs per second."""

_LINES: Final = 16384
"""Lines that wait for a disk that hangs: some 16 MB of ledgers, nine minutes at 30 pairs per second."""

NAMES: Final = r"delays\.jsonl|report\.json|settings\.json|index\.html|pair-[0-9]{6,}"
"""What a run writes into its folder."""

PAIR_FILES: Final = r"(left|right)\.png|disparity\.pfm|cloud\.ply"
"""What it writes into the folder of a saved pair."""


class FileSink:
    """Writes into one folder, or nowhere: lines in one queue, pairs in another, so that neither waits for the other.

    Args:
        folder: made if missing; None to write nothing.
        save_every: every which pair is saved, from the first on; 0 for none.
        waits: whether a pair that is due to be saved may make the worker wait, so that none is missing.
        settings: of the run, each with its value and its origin; None: not saved.

    Raises:
        UnavailableError: the folder cannot be made or written to, or something that is not ours is in the way.
    """

    def __init__(
        self,
        folder: Path | None,
        save_every: int,
        *,
        waits: bool = False,
        settings: Mapping[str, object] | None = None,
    ) -> None:
        self._folder = folder
        self._save_every = save_every
        self._pending: list[bytes] = []
        self._pending_bytes = 0
        self._unwritten = threading.Lock()
        self._lost_lines = self._unsaved_pairs = 0
        self._cause = self._last_cause = ""
        self._tried_ns = 0
        self._file = -1
        self._written_bytes = 0
        self._own: ListedFolder | None = None
        self._lines: SinkQueue[PairLedger] | None = None
        self._pairs: SinkQueue[Result] | None = None
        if folder is None:
            return
        try:
            self._own = ListedFolder(folder, NAMES, inner=PAIR_FILES)
            self._own.add("report.json")
            self._file = self._own.create("delays.jsonl")
            if settings is not None:
                self._own.add("settings.json")
                self._own.write_text("settings.json", json.dumps(settings, indent=1) + "\n")
        except OSError as error:
            raise UnavailableError(
                f"results folder {folder} cannot be used ({error.strerror})", "give another with --out"
            ) from None
        self._lines = SinkQueue("lines", self._append, depth=_LINES)
        self._pairs = SinkQueue("pairs", self._save, waits=waits)

    def await_place(self) -> None:
        """See Sink."""
        if self._pairs is not None:
            self._pairs.await_place()

    def offer(self, result: Result) -> None:
        """See Sink."""
        if self._lines is None or self._pairs is None:
            return
        if not self._lines.offer(result.ledger):
            with self._unwritten:
                self._lost_lines += 1
                self._last_cause = "the disk hangs"
        if self._save_every and result.number % self._save_every == 0:
            self._pairs.offer(result)

    def finish(self) -> None:
        """See Sink."""
        if self._pairs is not None:
            self._pairs.finish()
        if self._lines is not None:
            self._lines.finish()
            self._flush()

    @property
    def failure(self) -> Exception | None:
        """See Sink."""
        return next(
            (queue.failure for queue in (self._lines, self._pairs) if queue is not None and queue.failure), None
        )

    @property
    def accounts(self) -> tuple[SinkAccount, ...]:
        """See Sink."""
        return tuple(queue.account for queue in (self._lines, self._pairs) if queue is not None)

    @property
    def complete(self) -> bool:
        """Whether everything has been written so far."""
        return not (self._lost_lines or self._pending or self._unsaved_pairs or self._cause)

    @property
    def unwritten(self) -> Unwritten:
        """What has not been written so far."""
        return Unwritten(self._lost_lines + len(self._pending), self._unsaved_pairs, self._last_cause)

    def close(self, report: dict[str, object], page: str = "") -> None:
        """Work off what was taken, write report.json and let go of the folder.

        Args:
            report: the JSON object to write.
            page: the HTML document to write beside it as index.html; empty: none.
        """
        if self._own is None:
            return
        self.finish()
        try:
            os.fsync(self._file)
            self._own.write_text("report.json", json.dumps(report, indent=1) + "\n")
            if page:
                self._own.add("index.html")
                self._own.write_text("index.html", page)
            self._own.sync()
        except OSError as error:
            self._failed(error)
        os.close(self._file)
        self._own.close()
        self._own = None

    def _save(self, result: Result) -> None:
        """Write a pair's folder; all of it or nothing."""
        assert self._own is not None
        processed, name = result.processed, f"pair-{result.number:06d}"
        try:
            with self._own.new_folder(name) as part:
                _write_pair(part, processed)
        except OSError as error:
            with self._unwritten:
                self._unsaved_pairs += 1
            self._failed(error)

    def _append(self, ledger: PairLedger) -> None:
        """Add a line to delays.jsonl."""
        line = ledger.to_json().encode() + b"\n"
        self._pending.append(line)
        self._pending_bytes += len(line)
        if not self._cause or now.monotonic_ns() - self._tried_ns > _RETRY_NS:
            self._flush()
        while self._pending_bytes > _PENDING_BYTES:
            self._pending_bytes -= len(self._pending.pop(0))
            with self._unwritten:
                self._lost_lines += 1

    def _flush(self) -> None:
        """Write the lines that wait; what cannot be written goes on waiting."""
        if self._folder is None or not self._pending:
            return
        self._tried_ns = now.monotonic_ns()
        data = b"".join(self._pending)
        try:
            done = os.pwrite(self._file, data, self._written_bytes)
        except OSError as error:
            self._failed(error)
            return
        if done < len(data):  # the disk filled up in the middle of a line: the next try writes over the torn part
            os.ftruncate(self._file, self._written_bytes)
            self._failed(OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))
            return
        self._written_bytes += done
        self._pending.clear()
        self._pending_bytes = 0
        if self._cause:
            _LOG.info(event("results_written_again", folder=self._folder))
            self._cause = ""

    def _failed(self, error: OSError) -> None:
        if not self._cause:
            _LOG.error(
                event(
                    "results_not_written",
                    folder=self._folder,
                    cause=error.strerror,
                    remedy="make room; the run goes on",
                )
            )
        self._cause = self._last_cause = error.strerror or str(error)


def _write_pair(folder: Path, processed: Processed) -> None:
    write_png(folder / "left.png", processed.pair.left)
    write_png(folder / "right.png", processed.pair.right)
    if processed.disparity is not None:
        write_pfm(folder / "disparity.pfm", processed.disparity)
    if processed.cloud is not None:
        write_ply(folder / "cloud.ply", processed.cloud, processed.pair.left)
