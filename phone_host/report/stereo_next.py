"""The commands that a page of `stereo` offers: what mends the result, or what to do with a good one."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from common.program.invocation import command_line, shell_word
from phone_host.diagnostics.arrangement import EXCHANGE, tries_of
from phone_host.output.axes import Axes
from phone_host.report.page_links import NextCommand
from phone_host.report.report_page import Headline
from phone_host.report.stereo_report import PairReport, pair_verdict


@dataclass(frozen=True, slots=True, kw_only=True)
class Typed:
    """The command that made the result.

    Attributes:
        words: behind the program's name, without --json; empty: not known.
        images: those of them that are LEFT and RIGHT.
        axes: of the points in files.
        rig: path of its rig.yaml; empty: there is none.
        folder: the current one, to which its relative paths belong.
    """

    words: tuple[str, ...]
    images: tuple[str, ...]
    axes: Axes
    rig: str
    folder: Path


def next_commands(typed: Typed, pairs: Sequence[PairReport]) -> tuple[NextCommand, ...]:
    """Return commands to copy from a page.

    Args:
        typed: what made the result.
        pairs: the pairs that it shows.

    Returns:
        Where the images are exchanged, turned or mirrored, what mends that, and nothing for any other wrong result.
    """
    verdicts = [pair_verdict(pair)[0] for pair in pairs]
    if all(verdict is Headline.BAD for verdict in verdicts):
        remedies = {pair.trust.concerns[0].remedy if pair.trust.concerns else "" for pair in pairs}
        return _mending(typed, remedies.pop()) if len(remedies) == 1 else ()
    commands = []
    if typed.words and typed.axes is Axes.CAMERA and any(pair.written.points for pair in pairs):
        words = (*typed.words, "--axes", Axes.Y_UP.value)
        commands.append(NextCommand("the same with y up, as most 3D viewers expect", _line(typed, words)))
    if typed.rig:
        cameras = ("--link", "tcp://192.168.7.2:5555", "--camera", "v4l2:/dev/video0")
        run = ("run", *cameras, "--calibration", typed.rig, "--out", "live")
        commands.append(NextCommand("the same rig live: the board's camera and this machine's", _line(typed, run)))
    return tuple(commands)


def _mending(typed: Typed, remedy: str) -> tuple[NextCommand, ...]:
    commands = []
    for given in tries_of(remedy):
        if given == (EXCHANGE,):
            what, words = "LEFT and RIGHT exchanged", _exchanged(typed)
        else:
            what = " ".join(given)
            # Options that are there already would have to be combined with it.
            words = () if set(given[::2]) & set(typed.words) else (*typed.words, *given)
        if typed.words and words:
            commands.append(NextCommand(f"the same with {what}", _line(typed, words)))
    return tuple(commands)


def _exchanged(typed: Typed) -> tuple[str, ...]:
    """Return the words with LEFT and RIGHT exchanged; empty if they are not just two words beside each other."""
    words = typed.words
    at = next((index for index in range(len(words)) if words[index : index + 2] == typed.images), None)
    return () if at is None else (*words[:at], words[at + 1], words[at], *words[at + 2 :])


def _line(typed: Typed, words: tuple[str, ...]) -> str:
    """Return a line for any shell's folder: relative paths belong to the folder in which the command was typed."""
    return f"cd {shell_word(str(typed.folder))} && {command_line('phone-host', *words)}"
