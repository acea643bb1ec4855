"""What the page says while a camera's film is checked."""

from collections.abc import Sequence

from common.diagnostic import Diagnostic
from phone_host.doctor.camera_check.check import Progress, Stage
from phone_host.model.capture import Unseen
from phone_host.serve.check import CaptureGuide


def test_the_page_is_told_what_is_new_and_no_more() -> None:
    """A hundred frames of one stage are told in steps; a reason why film tells nothing stands in the words at once."""
    told: list[Sequence[Diagnostic]] = []
    guide = CaptureGuide(told.append)
    guide.wait()
    assert [each.message for each in told.pop()] == ["waiting for the camera"]
    for number in range(100):
        guide.tell(Progress(Stage.STILL, number / 1000, 0, None))
    assert len(told) == 2
    guide.tell(Progress(Stage.MOVE, 0.1, 1, Unseen.PLAIN))
    ((said,),) = told[-1:]
    assert "too few details" in said.message
    assert "1 of" in said.remedy
