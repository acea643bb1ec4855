"""A board listener for receivers that are measured by themselves."""


class Unheard:
    """Takes no notice."""

    def session_began(self) -> None:
        """A session began."""

    def frame_arrived(self, exposed_ns: int, index: int | None) -> None:
        """A frame arrived."""
