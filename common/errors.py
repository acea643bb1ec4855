"""The one error tree. Each class says when it is raised, whose fault it is and which exit code it means.

Every message is one line that names the culprit (option, key, file, device, peer) and the remedy.
Exit codes are part of the commands' contract: 0 done, 2 wrong usage or settings, 3 a device or link cannot be had, 4 the data are bad
or missing, or a check failed; 129 hung up, 130 interrupted, 131 quit, 143 terminated.
"""

from typing import ClassVar

from common.plain_text import printable


class TandemError(Exception):
    """Base of all errors a user may see; never raised itself.

    Args:
        problem: what is wrong, naming the culprit.
        remedy: what to do about it.

    Attributes:
        program: of a command line that is not taken, the command or verb that refuses it; empty: it is about something else.
    """

    exit_code: ClassVar[int] = 1
    program = ""

    def __init__(self, problem: str, remedy: str) -> None:
        super().__init__(problem, remedy)
        self.problem = problem
        self.remedy = remedy

    def __str__(self) -> str:
        return printable(f"{self.problem}: {self.remedy}")


class SettingsError(TandemError):
    """Raised for an option, key or URI that makes no sense. The user's fault; nothing was started."""

    exit_code = 2


class UnavailableError(TandemError):
    """Raised when a device, port or peer cannot be had now. Nobody's fault; trying again later may help."""

    exit_code = 3


class TakenError(UnavailableError):
    """Raised when another program has the device. Nobody's fault; the other one must let go first."""


class MissingDeviceError(UnavailableError):
    """Raised when a device is not there. Nobody's fault; it may be plugged in at any time."""


class AbsentBoardError(UnavailableError):
    """Raised when no board answers in time. Nobody's fault; it may be started at any time."""


class BusyBoardError(UnavailableError):
    """Raised when the board talks to another host. Nobody's fault; the other one must let go first."""


class OtherVersionError(UnavailableError):
    """Raised when the board speaks another protocol version. Nobody's fault; one of the two needs an update."""


class DataError(TandemError):
    """Raised when a file, image or result is bad or missing, or a check failed. The input's fault."""

    exit_code = 4


class ProtocolError(TandemError):
    """Raised by the codec for bytes that are not one of our messages. The peer's fault; the packet is dropped and counted."""

    exit_code = 4


class ClockMismatchError(TypeError):
    """Raised when stamps of two clocks are mixed. Our fault: a bug, never caught."""
