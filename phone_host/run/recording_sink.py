"""Hands the ledgers of a run's pairs to its recording. It needs no queue of its own: the recorder has one."""

from phone_host.measure.sink_account import SinkAccount
from phone_host.model import Result
from phone_host.recording.switch import RecordingSwitch


class RecordingSink:
    """A sink that keeps the delays of each pair.

    Attributes:
        failure: none: a disk that is full ends the recording, not the run.

    Args:
        recorder: writes.
    """

    def __init__(self, recorder: RecordingSwitch) -> None:
        self._recorder = recorder
        self.failure: Exception | None = None

    def await_place(self, number: int) -> None:
        """See Sink."""

    def offer(self, result: Result) -> None:
        """See Sink."""
        self._recorder.delays(result.ledger)

    def finish(self) -> None:
        """See Sink; the host ends the recorder."""

    @property
    def accounts(self) -> tuple[SinkAccount, ...]:
        """None: the recording has its own account."""
        return ()
