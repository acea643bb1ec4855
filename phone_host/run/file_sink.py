"""A run's results on disk: settings.json, delays.jsonl, pair folders, cameras.json, overlay.yaml, report.json and the page.

A full disk never stops the run and loses nothing that memory can hold. While writing fails, lines of delays.jsonl wait
in memory (bounded) and pairs are counted as unsaved. Once there is room again, the waiting lines are written in order.
The exit code tells if anything is still missing at the end. If the disk is merely slower than the pairs, saved pairs
are dropped, each counted as a drop of the sink `pairs`; lines are never dropped.

Files that an earlier run listed as its own in the same folder are replaced (`output/listed.py`). Anything else in the
way ends the run before it begins. Where there is nothing to replace, files appear under their names at once. Else they
lie in the hidden folder `.tandemscan.new` until the run has written its report and all the rest: only then do the
earlier results go (decision 0088). Those of a run that is not whole stay in `partial-run` instead (decision 0120). A saved pair survives a power cut as soon as it is there; lines and report do once
the run has ended.
"""

import errno
import logging
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Final

from common import now
from common.errors import UnavailableError
from common.ledger import PairLedger
from common.program.logs import event
from phone_host.accounts.delays import SinkAccount
from phone_host.model import Result, Unwritten
from phone_host.output.axes import Axes
from phone_host.output.cameras_json import CAMERAS_NAME
from phone_host.output.json_text import json_text
from phone_host.output.listed import ListedFolder
from phone_host.output.open_folders import remove_result
from phone_host.output.overlay_yaml import OVERLAY_NAME
from phone_host.output.pair_files import RUN_FILES, write_pair
from phone_host.run.sinks import NotWrittenError, SinkQueue

_LOG = logging.getLogger(__name__)

_RETRY_NS: Final = 1_000_000_000
"""While the disk is full, writing is retried at this interval, not at every pair."""

_PENDING_BYTES: Final = 16 * 1024 * 1024
"""Memory for lines while the disk is full: about ten minutes at 30 pairs per second."""

_LINES: Final = 16384
"""Most lines that wait while the disk hangs: about 16 MB of ledgers, nine minutes at 30 pairs per second."""

_WRITERS: Final = 2
"""Threads that write one pair's files. Of 640x480 they take 41 ms with depth.png; one thread took 53 ms without it (decision 0033)."""

NAMES: Final = r"delays\.jsonl|report\.json|settings\.json|cameras\.json|overlay\.yaml|index\.html|pair-[0-9]{6,}"
"""The names that a run writes into its folder."""


class _Trouble:
    """Tracks whether writing fails now, and logs when that begins and ends. Used by one thread at a time.

    Args:
        folder: the folder, for the log.
        what: what cannot be written, for the log.
    """

    def __init__(self, folder: Path, what: str) -> None:
        self._folder, self._what = folder, what
        self.now = self.last = ""

    def begins(self, error: OSError, what: str = "", remedy: str = "make room; the run goes on") -> None:
        """Something could not be written; `what` names it if it is only part of what this tracks."""
        cause = error.strerror or str(error)
        if not self.now:
            missing = what or self._what
            _LOG.error(event("results_not_written", folder=self._folder, what=missing, cause=cause, remedy=remedy))
        self.now = self.last = cause

    def ends(self) -> None:
        """Something could be written."""
        if self.now:
            _LOG.info(event("results_written_again", folder=self._folder, what=self._what))
            self.now = ""


class _Lines:
    """delays.jsonl. Lines that cannot be written wait in memory and follow in order.

    Args:
        descriptor: descriptor of the empty file; its owner closes it.
        trouble: is told when writing fails and when it succeeds.
    """

    def __init__(self, descriptor: int, trouble: _Trouble) -> None:
        self._file = descriptor
        self._trouble = trouble
        self._pending: list[bytes] = []
        self._pending_bytes = self._written_bytes = 0
        self._tried_ns = 0
        self.lost = 0

    @property
    def unwritten(self) -> int:
        """The number of lines that are lost or still wait."""
        return self.lost + len(self._pending)

    @property
    def are_begun(self) -> bool:
        """Whether a line is in the file."""
        return self._written_bytes > 0

    def append(self, ledger: PairLedger) -> None:
        """Add a line."""
        line = ledger.to_json().encode() + b"\n"
        self._pending.append(line)
        self._pending_bytes += len(line)
        if not self._trouble.now or now.monotonic_ns() - self._tried_ns > _RETRY_NS:
            self.flush()
        while self._pending_bytes > _PENDING_BYTES:
            self._pending_bytes -= len(self._pending.pop(0))
            self.lost += 1

    def flush(self) -> None:
        """Write the waiting lines. Lines that cannot be written keep waiting."""
        if not self._pending:
            return
        self._tried_ns = now.monotonic_ns()
        data = b"".join(self._pending)
        try:
            done = os.pwrite(self._file, data, self._written_bytes)
            if done < len(data):  # the disk filled up in mid-line: the next attempt overwrites the torn line
                os.ftruncate(self._file, self._written_bytes)
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            self._trouble.begins(error)
            return
        self._written_bytes += done
        self._pending.clear()
        self._pending_bytes = 0
        self._trouble.ends()


class FileSink:
    """Writes into one folder, or nowhere. Lines and pairs have separate queues, so that neither waits for the other.

    Attributes:
        listed: the folder; None: nothing is written, or no longer.

    Args:
        folder: created if missing; None to write nothing.
        save_every: save every Nth pair, starting with the first; 0 for none.
        waits: whether the worker waits for room for a pair that is due to be saved, so that none is missing.
        settings: settings of the run, each with its value and origin; None: not saved.
        axes: of the points in saved clouds.
        command: the verb that runs.

    Raises:
        UnavailableError: the folder cannot be created or written to, or something that is not ours is in the way.
    """

    def __init__(
        self,
        folder: Path | None,
        save_every: int,
        *,
        waits: bool = False,
        settings: Mapping[str, object] | None = None,
        axes: Axes = Axes.CAMERA,
        command: str = "run",
    ) -> None:
        self._save_every, self._axes = save_every, axes
        self._unsaved_pairs = self._lost_lines = 0
        self._missing: tuple[str, ...] = ()
        self._saved_pairs, self._stays = 0, ""
        self.listed: ListedFolder | None = None
        self._file = -1
        if folder is None:
            return
        self._folder = folder
        try:
            self.listed = ListedFolder(folder, NAMES, command=command)
            self.listed.open()
            if self.listed.earlier:
                self.listed.stage()
            self.listed.add("report.json")
            self._file = self.listed.create("delays.jsonl")
            if settings is not None:
                self.listed.add("settings.json")
                self.listed.write_text("settings.json", json_text(settings, indent=1) + "\n")
        except OSError as error:
            self._let_go()
            raise UnavailableError(
                f"results folder {folder} cannot be used ({error.strerror})",
                "check that you may write to it and that the disk has room, or give another with --out",
            ) from None
        except BaseException:
            self._let_go()
            raise
        self._of_lines, self._of_pairs = _Trouble(folder, "lines"), _Trouble(folder, "pairs")
        self._of_report = _Trouble(folder, "report")
        self._lines = _Lines(self._file, self._of_lines)
        self._line_queue = SinkQueue("lines", self._lines.append, depth=_LINES)
        self._pair_queue = SinkQueue("pairs", self._save, waits=waits)

    def await_place(self, number: int) -> None:
        """See Sink."""
        if self.listed is not None and self._is_due(number):
            self._pair_queue.await_place()

    def offer(self, result: Result) -> None:
        """See Sink."""
        if self.listed is None:
            return
        self._lost_lines += not self._line_queue.offer(result.ledger)
        if self._is_due(result.number):
            self._pair_queue.offer(result)

    def finish(self) -> None:
        """See Sink."""
        if self.listed is not None:
            self._pair_queue.finish()
            self._line_queue.finish()
            self._lines.flush()

    @property
    def failure(self) -> Exception | None:
        """See Sink."""
        return None if self.listed is None else self._line_queue.failure or self._pair_queue.failure

    @property
    def accounts(self) -> tuple[SinkAccount, ...]:
        """See Sink. Lines that wait in memory for the disk count as written here; `unwritten` counts them."""
        return () if self._file < 0 else (self._line_queue.account, self._pair_queue.account)

    @property
    def complete(self) -> bool:
        """Whether everything so far has been written."""
        return self._file < 0 or not (self.unwritten.lines or self.unwritten.pairs or self._of_report.now)

    @property
    def missing(self) -> str:
        """The files of the run's end that could not be written, and why, in words; empty: none."""
        if self.complete:
            return ""
        names = f"{', '.join(self._missing)} ({self._of_report.last})" if self._missing else "some of the results"
        return names + self._stays

    @property
    def place(self) -> Path | None:
        """The folder in which the files of the run lie until it is closed; None: nothing is written."""
        return None if self.listed is None else self.listed.place

    @property
    def unwritten(self) -> Unwritten:
        """What could not be written so far."""
        if self._file < 0:
            return Unwritten()
        cause = self._of_lines.last or self._of_pairs.last or self._of_report.last
        lost = self._lost_lines
        return Unwritten(
            lines=lost + self._lines.unwritten, pairs=self._unsaved_pairs, cause=cause or ("it hangs" if lost else "")
        )

    def close(
        self,
        report: dict[str, object],
        page: str = "",
        cameras: str = "",
        overlay: str = "",
        *,
        replaces_earlier: bool = True,
    ) -> None:
        """Finish the queued work, write report.json and release the folder. May be called again.

        Args:
            report: the JSON object to write.
            page: the HTML document to write as index.html beside it; empty: none.
            cameras: content of cameras.json; empty: none.
            overlay: content of overlay.yaml; empty: none.
            replaces_earlier: whether the run is whole, so that an earlier run's results may be replaced by it.
        """
        if self.listed is None:
            return
        texts = {
            "report.json": json_text(report, indent=1) + "\n",
            "index.html": page,
            CAMERAS_NAME: cameras,
            OVERLAY_NAME: overlay,
        }
        try:
            self.finish()
            troubles = self._write_last({name: text for name, text in texts.items() if text})
            if not troubles and self.complete and (replaces_earlier or not self.listed.is_staged):
                troubles = self._published()
            if troubles:
                self._missing = tuple(troubles)
                error = next(iter(troubles.values()))
                self._of_report.begins(error, ",".join(troubles), "make room and run again")
            if self.listed.is_staged:
                self._keep_earlier()
        finally:
            self._let_go()

    def abandon(self) -> None:
        """Release the folder of a run that does not begin, and leave nothing there that a later run takes for its results."""
        if self.listed is not None:
            self.finish()
            if not self.listed.is_staged:
                for name in ("settings.json", "delays.jsonl"):
                    with suppress(OSError):
                        remove_result(name, self.listed.descriptor)
            self._let_go()

    def _published(self) -> dict[str, OSError]:
        """Let the results take the place of the earlier ones; return what failed."""
        assert self.listed is not None
        try:
            self.listed.publish()
        except OSError as error:
            return {"report.json": error}
        return {}

    def _keep_earlier(self) -> None:
        """Leave an earlier run's results where they are, and what this one has saved beside them."""
        assert self.listed is not None
        why, where = "this run has no pair", {}
        if self._saved_pairs or (self.complete and self._lines.are_begun):
            why = "this run ended early" if self.complete else "this run is not whole"
            with suppress(OSError):
                where["of_this_run"] = str(self.listed.keep_staged())
        _LOG.warning(event("earlier_results_stay", folder=self._folder, **where, why=why))
        saved = "".join(f", and what could be written is in {place}" for place in where.values())
        self._stays = f"; the earlier results stay in {self._folder}{saved}"

    def _write_last(self, texts: Mapping[str, str]) -> dict[str, OSError]:
        """Write the files of the run's end. One for which there is no room does not keep the others from being written.

        Returns:
            The files that could not be written, each with its error.
        """
        assert self.listed is not None
        troubles: dict[str, OSError] = {}
        try:
            os.fsync(self._file)
        except OSError as error:
            troubles["delays.jsonl"] = error
        for name, text in texts.items():
            try:
                if name != "report.json":
                    self.listed.add(name)
                self.listed.write_text(name, text)
            except OSError as error:
                troubles[name] = error
        try:
            self.listed.sync()
        except OSError as error:
            troubles.setdefault("report.json", error)
        return troubles

    def _let_go(self) -> None:
        if self.listed is None:
            return
        if self._file >= 0:
            os.close(self._file)
        self.listed.close()
        self.listed = None

    def _is_due(self, number: int) -> bool:
        return self._save_every > 0 and number % self._save_every == 0

    def _save(self, result: Result) -> None:
        """Write a pair's folder, completely or not at all."""
        assert self.listed is not None
        try:
            with (
                ThreadPoolExecutor(_WRITERS) as writers,
                self.listed.new_folder(f"pair-{result.number:06d}", writers.map) as folder,
            ):
                write_pair(folder, result.processed, RUN_FILES, self._axes, writers.map)
        except OSError as error:
            self._unsaved_pairs += 1
            self._of_pairs.begins(error)
            raise NotWrittenError from None
        self._saved_pairs += 1
        self.listed.spare_staged()
        self._of_pairs.ends()
