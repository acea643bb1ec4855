"""Man pages and completion, as troff and bash read them."""

import argparse
import shutil
import subprocess
from collections.abc import Callable

import pytest

import board_agent.cli
import phone_host.bench.cli
import phone_host.cli
from common.program.manual import completion, man_page, verbs_of

PROGRAMS = [phone_host.cli.parser, board_agent.cli.parser, phone_host.bench.cli.parser]


@pytest.mark.parametrize("make", PROGRAMS)
def test_a_man_page_names_every_verb_and_option(make: Callable[[], argparse.ArgumentParser]) -> None:
    """Troff takes it without a warning, and shows each option as it is typed."""
    parser = make()
    page = man_page(parser)
    flags = {flag for verb, _ in verbs_of(parser).values() for flag in verb._option_string_actions}  # noqa: SLF001 - argparse tells of them nowhere else
    shown = page.replace(r"\-", "-")
    assert all(f".SS {name}\n" in shown for name in verbs_of(parser))
    assert flags <= set(shown.replace(",", " ").split())
    if shutil.which("groff") is None:
        pytest.skip("groff is not installed")
    read = subprocess.run(["groff", "-man", "-ww", "-Tutf8"], input=page, capture_output=True, text=True, check=True)
    assert read.stderr == ""


@pytest.mark.parametrize(
    ("make", "words", "found"),
    [
        (phone_host.cli.parser, ["ster"], ["stereo"]),
        (phone_host.cli.parser, ["run", "--align"], ["--align-phase"]),
        (phone_host.cli.parser, ["run", "--axes", "y"], ["y-up"]),
        (phone_host.cli.parser, ["stereo", "left"], []),
        (board_agent.cli.parser, ["doc"], ["doctor"]),
        (phone_host.bench.cli.parser, ["--emul"], ["--emulate"]),
    ],
)
def test_bash_completes_verbs_options_and_choices(
    make: Callable[[], argparse.ArgumentParser], words: list[str], found: list[str]
) -> None:
    """As bash itself asks for them; a file's name is left to it."""
    parser = make()
    function = f"_{parser.prog.replace('-', '_')}"
    asked = (
        f'COMP_WORDS=({parser.prog} {" ".join(words)}); COMP_CWORD={len(words)}; {function}; echo "${{COMPREPLY[@]}}"'
    )
    told = subprocess.run(
        ["bash", "-c", f"{completion(parser, 'bash')}\n{asked}"], capture_output=True, text=True, check=True
    )
    assert (told.stdout.split(), told.stderr) == (found, "")


def test_other_shells_get_what_bash_gets() -> None:
    """Zsh reads the script for bash; fish has a line for each option of each verb."""
    parser = board_agent.cli.parser()
    assert completion(parser, "bash") in completion(parser, "zsh")
    lines = completion(parser, "fish").splitlines()
    for name, (verb, _) in verbs_of(parser).items():
        own = [line for line in lines if f"from {name}'" in line]
        assert len(own) == len(verb._option_string_actions)  # noqa: SLF001 - likewise
