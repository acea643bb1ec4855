"""A run's results on disk: delays.jsonl, pair folders, report.json. A full disk loses nothing that memory can keep, and never stops the run.

While writing fails, lines of delays.jsonl wait in memory (bounded) and pairs are counted as unsaved; when there is room again the lines
follow in order. What is still missing at the end is said with the exit code.

Of an earlier run in the same folder what it listed there as its own is removed (`formats/listed.py`); anything else in the way ends the run
before it begins. report.json and the page survive a power cut; saved pairs do not wait for the disk, since the pipeline would wait with them.
"""

import errno
import json
import logging
import os
import shutil
from pathlib import Path
from typing import Final

from common import now
from common.errors import UnavailableError
from common.ledger import PairLedger
from common.program.logs import event
from phone_host.model import Processed, Unwritten
from phone_host.output.listed import ListedFolder
from phone_host.output.pfm import write_pfm
from phone_host.output.ply import write_ply
from phone_host.output.preview import write_png

_LOG = logging.getLogger(__name__)

_RETRY_NS: Final = 1_000_000_000
"""While the disk is full it is tried again this often, not at every pair."""

_PENDING_BYTES: Final = 16 * 1024 * 1024
"""Lines kept while the disk is full: about ten minutes at 30 pairs per second."""

NAMES: Final = r"delays\.jsonl|report\.json|index\.html|pair-[0-9]{6,}"
"""What a run writes into its folder."""

PAIR_FILES: Final = r"(left|right)\.png|disparity\.pfm|cloud\.ply"
"""What it writes into the folder of a saved pair."""


class Results:
    """Writes into one folder, or nowhere.

    Args:
        folder: made if missing; None to write nothing.
        save_every: every which pair is saved, from the first on; 0 for none.

    Raises:
        UnavailableError: the folder cannot be made or written to, or something that is not ours is in the way.
    """

    def __init__(self, folder: Path | None, save_every: int) -> None:
        self._folder = folder
        self._save_every = save_every
        self._pending: list[bytes] = []
        self._pending_bytes = 0
        self._lost_lines = self._unsaved_pairs = 0
        self._cause = self._last_cause = ""
        self._tried_ns = 0
        self._file = -1
        self._written_bytes = 0
        self._own: ListedFolder | None = None
        if folder is not None:
            try:
                self._own = ListedFolder(folder, NAMES, inner=PAIR_FILES)
                self._own.add("report.json")
                self._file = self._own.create("delays.jsonl")
            except OSError as error:
                raise UnavailableError(
                    f"results folder {folder} cannot be used ({error.strerror})", "give another with --out"
                ) from None

    @property
    def complete(self) -> bool:
        """Whether everything has been written so far."""
        return not (self._lost_lines or self._pending or self._unsaved_pairs or self._cause)

    @property
    def unwritten(self) -> Unwritten:
        """What has not been written so far."""
        return Unwritten(self._lost_lines + len(self._pending), self._unsaved_pairs, self._last_cause)

    def save_pair(self, number: int, processed: Processed) -> None:
        """Write a pair's folder if it is its turn; all of it or nothing.

        Args:
            number: the pair's number in this run, from 0.
            processed: its images and depth.
        """
        if self._folder is None or self._own is None or not self._save_every or number % self._save_every:
            return
        final = self._folder / f"pair-{number:06d}"
        part = final.with_suffix(".part")
        try:
            self._own.add(final.name)
            part.mkdir()
            write_png(part / "left.png", processed.pair.left)
            write_png(part / "right.png", processed.pair.right)
            if processed.disparity is not None:
                write_pfm(part / "disparity.pfm", processed.disparity)
            if processed.cloud is not None:
                write_ply(part / "cloud.ply", processed.cloud, processed.pair.left)
            part.rename(final)
        except OSError as error:
            if not isinstance(error, FileExistsError):  # what is there is not ours
                shutil.rmtree(part, ignore_errors=True)
            self._unsaved_pairs += 1
            self._failed(error)

    def append(self, ledger: PairLedger) -> None:
        """Add a line to delays.jsonl."""
        if self._folder is None:
            return
        line = ledger.to_json().encode() + b"\n"
        self._pending.append(line)
        self._pending_bytes += len(line)
        if not self._cause or now.monotonic_ns() - self._tried_ns > _RETRY_NS:
            self.flush()
        while self._pending_bytes > _PENDING_BYTES:
            self._pending_bytes -= len(self._pending.pop(0))
            self._lost_lines += 1

    def finish(self, report: dict[str, object], page: str = "") -> None:
        """Write report.json and close.

        Args:
            report: the JSON object to write.
            page: the HTML document to write beside it as index.html; empty: none.
        """
        if self._own is None:
            return
        self.flush()
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

    def flush(self) -> None:
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
