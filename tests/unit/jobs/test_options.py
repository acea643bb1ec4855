"""What the programs take: every option, and what help says of it, as tests/golden/options.txt has it. `python -m tests.unit.jobs.test_options` writes that file."""

import argparse
from collections.abc import Iterator
from pathlib import Path

import board_agent.cli
import phone_host.bench.cli
import phone_host.cli
from tests.support.requests import options_of, verbs_of

GOLDEN = Path(__file__).parents[2] / "golden" / "options.txt"
PARSERS = (phone_host.cli.parser, board_agent.cli.parser, phone_host.bench.cli.parser)


def described(action: argparse.Action) -> str:
    """An option in one line: how it is called, its values, its default and its help."""
    kind = type(action).__name__.strip("_").removesuffix("Action")
    shown = {
        "nargs": action.nargs,
        "const": action.const,
        "default": action.default,
        "choices": action.choices,
        "metavar": action.metavar,
        "required": action.required,
    }
    told = " ".join(f"{name}={value!r}" for name, value in shown.items() if value is not None and value is not False)
    return f"{' '.join(action.option_strings) or action.dest} {kind} {told}: {action.help}"


def options(parser: argparse.ArgumentParser) -> Iterator[str]:
    """The options of a program and its verbs, sorted: their order and groups may change."""
    for verb in verbs_of(parser).values():
        yield from options(verb)
    yield from sorted(f"{parser.prog} {described(action)}" for action in options_of(parser))


def current() -> str:
    return "".join(f"{line}\n" for make in PARSERS for line in options(make()))


def test_the_options_are_those_that_were_decided() -> None:
    """No option, choice, default or help text changes unnoticed."""
    assert current().splitlines() == GOLDEN.read_text().splitlines()


def test_help_shows_first_what_most_people_need() -> None:
    """The untitled options of verbs with groups are at most fourteen: ten, and those of every command."""
    for verb, parser in verbs_of(phone_host.cli.parser()).items():
        _, untitled, *groups = parser._action_groups  # noqa: SLF001 - argparse tells of them nowhere else
        titles = [group.title for group in groups]
        assert len(set(titles)) == len(titles), verb
        if titles:
            assert len(untitled._group_actions) <= 14, verb  # noqa: SLF001 - likewise


def test_no_option_takes_an_empty_value_or_half_a_number() -> None:
    """Also those in groups of the help are read by our readers, not by Python's own types, which take "", "1_0" and foreign digits."""
    raw = [
        f"{parser.prog} {action.dest}"
        for make in PARSERS
        for parser in (make(), *verbs_of(make()).values())
        for action in options_of(parser)
        if action.nargs != 0 and action.type in {None, str, int, float, Path}
    ]
    assert [name for name in raw if not name.endswith((" help", " version", " verb", " completion"))] == []


if __name__ == "__main__":
    GOLDEN.write_text(current())
