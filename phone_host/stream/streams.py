"""What a run needs of the two sides from which frames come, live or replayed."""

from typing import Protocol

from common.camera.base import CameraHealth
from common.protocol.message import BoardHello, Locks, LockState, Steering
from phone_host.accounts.link_account import LinkAccount
from phone_host.stream.refusals import BoardRefusal
from phone_host.sync.clock import ClockEstimate


class Stream(Protocol):
    """What both sides have."""

    @property
    def ended(self) -> bool:
        """Whether the last frame has come."""

    @property
    def failure(self) -> Exception | None:
        """What ended it."""

    def start(self) -> None:
        """Let frames come."""


class OwnStream(Stream, Protocol):
    """This machine's camera; see OwnCamera."""

    @property
    def spoiled(self) -> int:
        """Images that are none."""

    @property
    def skipped(self) -> int:
        """Images that were left out."""

    @property
    def from_the_future(self) -> int:
        """Images whose stamp had not come yet."""

    @property
    def health(self) -> CameraHealth:
        """The camera's health."""

    @property
    def held(self) -> Locks:
        """The controls that the camera is held at."""

    @property
    def has_held(self) -> bool:
        """Whether the camera has been told everything that it is to be held at."""

    @property
    def steering(self) -> Steering:
        """How the camera's phase can be moved."""

    def hold(self, locks: Locks) -> None:
        """Hold controls of the camera."""

    def steer(self, later_ns: int) -> None:
        """Let the camera expose later."""

    def stop(self) -> None:
        """Let none come any more."""


class BoardStream(Stream, Protocol):
    """The board; see Receiver."""

    @property
    def account(self) -> LinkAccount:
        """The links' account so far."""

    @property
    def refused(self) -> BoardRefusal | None:
        """Why the board refuses this host."""

    @property
    def connected(self) -> bool:
        """Whether a board talks to us now."""

    @property
    def carrier(self) -> str:
        """Name of the link that carries frames now."""

    @property
    def hello(self) -> BoardHello | None:
        """The board's description of itself."""

    @property
    def locks(self) -> LockState | None:
        """How the board's camera is held."""

    @property
    def estimate(self) -> ClockEstimate | None:
        """The clock estimate now."""

    def wake(self) -> None:
        """There is room for a frame."""

    def steer(self, later_ns: int) -> None:
        """Let the board's camera expose later."""

    def hold(self, locks: Locks) -> None:
        """Have the board's camera held like this."""

    def stop(self) -> None:
        """Let none come any more."""
