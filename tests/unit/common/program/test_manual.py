"""Man pages and completion, as troff and the shells read them."""

import argparse
import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

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


TYPED = [
    (phone_host.cli.parser, ["ster"], ["stereo"]),
    (phone_host.cli.parser, ["run", "--no-cor"], ["--no-correction"]),
    (phone_host.cli.parser, ["run", "--axes", "y"], ["y-up"]),
    (phone_host.cli.parser, ["stereo", "left"], []),
    (board_agent.cli.parser, ["doc"], ["doctor"]),
    (phone_host.bench.cli.parser, ["--emul"], ["--emulate"]),
]
typed = pytest.mark.parametrize(("make", "words", "found"), TYPED)


@typed
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


def fish(parser: argparse.ArgumentParser, line: str, folder: Path) -> list[str]:
    """What fish offers for a line, without the descriptions."""
    if shutil.which("fish") is None:
        pytest.skip("fish is not installed")
    words = ["fish", "-N", "-c", f"{completion(parser, 'fish')}\ncomplete -C '{line}'"]
    environment = {**os.environ, "HOME": str(folder)}
    told = subprocess.run(words, capture_output=True, text=True, check=True, cwd=folder, env=environment)
    assert told.stderr == ""
    return [offer.split("\t")[0] for offer in told.stdout.splitlines()]


@typed
def test_fish_completes_what_bash_completes(
    make: Callable[[], argparse.ArgumentParser], words: list[str], found: list[str], tmp_path: Path
) -> None:
    """As fish itself tells what it offers."""
    parser = make()
    assert fish(parser, f"{parser.prog} {' '.join(words)}", tmp_path) == found


def test_fish_knows_which_values_may_be_left_out(tmp_path: Path) -> None:
    """Behind such an option comes another one, and its values come behind an equals sign; the other options want theirs."""
    parser = phone_host.cli.parser()
    assert fish(parser, "phone-host run --align-phase=h", tmp_path) == ["--align-phase=host"]
    assert fish(parser, "phone-host run --align-phase --ax", tmp_path) == ["--axes"]
    lines = [line for line in completion(parser, "fish").splitlines() if "from run'" in line]
    assert [" -r " in line for name in ("align-phase", "serve", "axes") for line in lines if f" -l {name} " in line] == [
        False, False, True,
    ]  # fmt: skip


@pytest.mark.parametrize(("make", "words", "found"), TYPED[::2])  # compinit takes its time
def test_zsh_completes_what_bash_completes(
    make: Callable[[], argparse.ArgumentParser], words: list[str], found: list[str], tmp_path: Path
) -> None:
    """In a terminal of its own, by a user who has no .zshrc: nothing has called compinit."""
    if shutil.which("zsh") is None:
        pytest.skip("zsh is not installed")
    parser = make()
    (tmp_path / "script").write_text(completion(parser, "zsh"))
    line = " ".join([parser.prog, *words])
    whole = " ".join([parser.prog, *words[:-1], *found])
    asked = f"""
        zmodload zsh/zpty
        zpty shell zsh -f -i
        zpty -w shell "source script; echo REA''DY"
        zpty -r shell out '*READY*'
        zpty -w -n shell $'{line}\t'
        zpty -r shell out $'*{whole}*' && echo done"""
    environment = {**os.environ, "HOME": str(tmp_path), "TERM": "dumb"}
    told = subprocess.run(
        ["zsh", "-f", "-c", asked],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
        env=environment,
        timeout=60,
    )
    assert (told.stdout, told.stderr) == ("done\n", "")


def test_fish_has_a_line_for_each_option() -> None:
    """Of each verb."""
    parser = board_agent.cli.parser()
    lines = completion(parser, "fish").splitlines()
    for name, (verb, _) in verbs_of(parser).items():
        own = [line for line in lines if f"from {name}'" in line]
        assert len(own) == len(verb._option_string_actions)  # noqa: SLF001 - likewise
