"""What all viewers share: the newest result, the samples and the state; told to them by their events."""

import asyncio
from collections import deque
from typing import Final

from common import now
from phone_host.output.json_text import json_text
from phone_host.report import run_json
from phone_host.web.encoder import Encoder
from phone_host.web.source import Newest, PageState, Source
from phone_host.web.state_json import MOST_SAMPLES, Sample, StateText, sample, state_text

_STATE_S: Final = 0.25
_REPORT_S: Final = 1.0


class Hub:
    """Shared by all viewers; used in the event loop's thread only, but for `_told`.

    Args:
        source: the program.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.encoder: Final = Encoder()
        self.watchers: Final[set[asyncio.Event]] = set()
        self.state = StateText("", "")
        self.state_version = 0
        self.report = "null"
        self.report_version = 0
        self._built_s = self._reported_s = float("-inf")
        self._commands = 0
        self._samples: deque[Sample] = deque(maxlen=MOST_SAMPLES)
        self._building = asyncio.Lock()
        self._loop = asyncio.get_running_loop()
        self._end = source.subscribe(self._told)

    def newest(self) -> Newest | None:
        """Return the newest result."""
        return self.source.newest()

    def samples_since(self, number: int) -> list[Sample]:
        """Return the samples of the state's run behind a number, oldest first."""
        return [item for item in list(self._samples) if item.number > number and item.begun == self.state.begun]

    async def refresh(self, report_s: float = _REPORT_S) -> None:
        """Bring the state up to date, unless it is a moment old, and the report, if it is older than asked.

        Args:
            report_s: greatest age of the report, s; a moment, at least.
        """
        async with self._building:
            now_s = self._loop.time()
            with_report, commands = now_s - self._reported_s >= max(report_s, _STATE_S), self._commands
            if now_s - self._built_s < _STATE_S and not (with_report and report_s < _REPORT_S):
                return
            state, report = await self.encoder.run(lambda: self._built(with_report=with_report))
            self._built_s = self._loop.time() if commands == self._commands else float("-inf")
            if state != self.state:
                self.state, self.state_version = state, self.state_version + 1
            if with_report:
                self._reported_s = now_s
                if report != self.report:
                    self.report, self.report_version = report, self.report_version + 1

    def outdate(self) -> None:
        """A command was done: whoever asks next gets the state after it."""
        self._commands += 1
        self._built_s = float("-inf")
        self.wake()

    async def watch(self) -> None:
        """Keep the state up to date while somebody looks, for ever."""
        told = 0, 0
        while True:
            await asyncio.sleep(_STATE_S)
            if self.watchers:
                await self.refresh()  # or somebody else's question was before
                if told != (newest := (self.state_version, self.report_version)):
                    told = newest
                    self.wake()

    def wake(self) -> None:
        """Have each viewer see whether there is something for it."""
        for watcher in self.watchers:
            watcher.set()

    def close(self) -> None:
        """Hear no more of the source."""
        self._end()
        self.encoder.close()

    def _built(self, *, with_report: bool) -> tuple[StateText, str]:
        state: PageState = self.source.state()
        report = "null" if state.run is None or not with_report else json_text(run_json.build(state.run))
        return state_text(state, list(self._samples), now.monotonic_ns()), report

    def _told(self) -> None:
        """Note the newest result. Called from threads of the run, which must not wait."""
        newest = self.source.newest()
        if newest is not None and (not self._samples or newest.number > self._samples[-1].number):
            self._samples.append(sample(newest.number, newest.result.ledger, newest.begun))
        try:
            self._loop.call_soon_threadsafe(self.wake)
        except RuntimeError:  # the loop has ended
            return
