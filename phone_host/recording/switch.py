"""A recording that may begin and end while a run goes on: stands where a recorder stands, and hands on to the present one."""

from collections.abc import Callable
from pathlib import Path
from threading import Lock

from common.errors import SettingsError
from common.frame import Buffer, Frame
from common.ledger import PairLedger
from common.protocol.message import CameraDescription
from phone_host.diagnostics.run_snapshot import RecordingAccount
from phone_host.model import BoardFrame
from phone_host.output.cameras_json import CAMERAS_NAME
from phone_host.recording.recorder import Recorder
from phone_host.sync.clock import ClockEstimate


class RecordingSwitch:
    """Hands on to a recorder, while there is one.

    Args:
        make: begins a recording in a file.
    """

    def __init__(self, make: Callable[[Path], Recorder]) -> None:
        self._make = make
        self._recorder: Recorder | None = None
        self._last: RecordingAccount | None = None
        self._board: CameraDescription | None = None
        self._changing = Lock()

    @property
    def account(self) -> RecordingAccount | None:
        """The account of the present recording, else of the last one; None: there was none."""
        recorder = self._recorder
        return self._last if recorder is None else recorder.account

    @property
    def is_on(self) -> bool:
        """Whether there is a recorder."""
        return self._recorder is not None

    def begin(self, path: Path) -> None:
        """Begin a recording.

        Args:
            path: the file; it must not exist.

        Raises:
            SettingsError: one goes on, or the cameras have no clock.
            UnavailableError: the file exists or cannot be made.
        """
        with self._changing:
            going_on = self._recorder
            if going_on is not None and not going_on.account.is_over:
                raise SettingsError("a recording is going on", "end it first")
            recorder = self._make(path)
            if self._board is not None:
                recorder.board_camera(self._board)
            self._recorder = recorder
            if going_on is not None:
                going_on.finish()

    def end(self, cameras: str = "") -> RecordingAccount | None:
        """End the present recording, if there is one, and return its account; None: there was none.

        Args:
            cameras: content of cameras.json, which is known only now; empty: it is not.
        """
        with self._changing:
            recorder = self._recorder
            if recorder is None:
                return None
            self._last = recorder.finish({CAMERAS_NAME: cameras.encode()} if cameras else {})
            self._recorder = None
            return self._last

    def board_camera(self, camera: CameraDescription) -> None:
        """See Recorder."""
        self._board = camera
        if (recorder := self._recorder) is not None:
            recorder.board_camera(camera)

    def board_frame(self, frame: BoardFrame) -> None:
        """See Recorder."""
        if (recorder := self._recorder) is not None:
            recorder.board_frame(frame)

    def own_frame(self, frame: Frame) -> None:
        """See Recorder."""
        if (recorder := self._recorder) is not None:
            recorder.own_frame(frame)

    def delays(self, ledger: PairLedger) -> None:
        """See Recorder."""
        if (recorder := self._recorder) is not None:
            recorder.delays(ledger)

    def computed(self, topic: str, write: Callable[[int], tuple[Buffer, ...]], ledger: PairLedger, at_ns: int) -> None:
        """See Recorder."""
        if (recorder := self._recorder) is not None:
            recorder.computed(topic, write, ledger, at_ns)

    def clock(self, estimate: ClockEstimate | None, boot_id: str, at_ns: int) -> None:
        """See Recorder."""
        if (recorder := self._recorder) is not None:
            recorder.clock(estimate, boot_id, at_ns)
