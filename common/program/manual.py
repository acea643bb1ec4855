"""The man page of a program and what completes its command lines in a shell, made of what its parser declares."""

import argparse
import re
import textwrap
from collections.abc import Iterator
from typing import Final

_STATUS: Final = (
    "0 done, 2 wrong usage or settings, 3 a device, a link or a package cannot be had, 4 the data are bad or a check failed,"
    " 129, 130, 131 and 143 ended by a signal."
)
_OF_ALL: Final = (".TP\n.B \\-h, ", ".TP\n.B \\-\\-version")
"""Begin the entries of options that every verb has, too."""

_BASH: Final = """{function}()
{{
    local cur=${{COMP_WORDS[COMP_CWORD]}} words=
    case "{place}${{COMP_WORDS[COMP_CWORD-1]}}" in
{values}
    esac
    if [[ -z $words && ( $cur == -* || $COMP_CWORD == 1 ) ]]; then
        case "{verb}" in
{options}
        esac
    fi
    COMPREPLY=($(compgen -W "$words" -- "$cur"))
}}
complete -o default -F {function} {program}
"""


_ZSH: Final = """autoload -Uz compinit bashcompinit
(( $+functions[compdef] )) || compinit -i
bashcompinit
"""
"""Lets zsh read bash's script. bashcompinit rests on compinit, which a user's .zshrc may not have called, or only calls later."""


def verbs_of(parser: argparse.ArgumentParser) -> dict[str, tuple[argparse.ArgumentParser, str]]:
    """Return the parser and the summary of each verb, with all of its options; empty for a program without verbs."""
    for action in parser._actions:  # noqa: SLF001 - argparse tells of them nowhere else
        if isinstance(action, argparse._SubParsersAction):  # noqa: SLF001 - likewise
            for verb in action.choices.values():
                getattr(verb, "learn", lambda: None)()
            summaries = {each.dest: each.help or "" for each in action._choices_actions}  # noqa: SLF001 - likewise
            return {name: (verb, summaries.get(name, "")) for name, verb in action.choices.items()}
    return {}


def _declared(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    return (each for each in parser._actions if not isinstance(each, argparse._SubParsersAction))  # noqa: SLF001 - likewise


def _options(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    return [each for each in _declared(parser) if each.option_strings]


def _help(action: argparse.Action) -> str:
    return (action.help or "").replace("%%", "%")


_PURPOSES: Final = {
    "board-agent": "stream a board's time-stamped camera frames to tandemscan's host",
    "delay-bench": "measure every delay of each link between board and host",
    "phone-host": "make depth and 3D models of two cameras' images",
}


def _roff(text: str) -> str:
    """Return a text that troff shows as it is."""
    return re.sub(r"^([.'])", r"\\&\1", text.replace("\\", r"\e").replace("-", r"\-"), flags=re.MULTILINE)


def _entries(parser: argparse.ArgumentParser) -> Iterator[str]:
    for each in _declared(parser):
        called = " ".join(each.metavar) if isinstance(each.metavar, tuple) else each.metavar or ""
        value = called or "{" + ",".join(map(str, each.choices)) + "}" if each.choices else called
        name = ", ".join(each.option_strings)
        shown = f"{name} {value}".strip() if each.nargs != 0 else name
        yield f".TP\n.B {_roff(shown or each.dest)}\n{_roff(_help(each))}\n"


def man_page(parser: argparse.ArgumentParser) -> str:
    """Return the man page of a program, as troff.

    Args:
        parser: of the program.
    """
    program, verbs = parser.prog, verbs_of(parser)
    synopsis = "VERB [OPTION ...]" if verbs else "[OPTION ...]"
    examples = textwrap.dedent((parser.description or "").removeprefix("examples:\n")).strip()
    made = (
        f'.TH {program.upper()} 1 "" tandemscan "User Commands"\n.ad l\n.SH NAME\n{program} \\- {_PURPOSES[program]}\n'
    )
    made += f".SH SYNOPSIS\n.B {_roff(program)}\n{_roff(synopsis)}\n.SH EXAMPLES\n.nf\n{_roff(examples)}\n.fi\n"
    made += "".join([".SH OPTIONS\n", *_entries(parser)])
    if verbs:
        made += ".SH VERBS\n"
    for name, (verb, summary) in verbs.items():
        own = (entry for entry in _entries(verb) if not entry.startswith(_OF_ALL))
        made += "".join([f".SS {_roff(name)}\n{_roff(summary)}\n", *own])
    return f"{made}.SH EXIT STATUS\n{_STATUS}\n"


def completion(parser: argparse.ArgumentParser, shell: str) -> str:
    """Return a script with which a shell completes a program's verbs, options and the values that an option has to choose from.

    Args:
        parser: of the program.
        shell: bash, zsh or fish.
    """
    known = {"": parser, **{name: verb for name, (verb, _) in verbs_of(parser).items()}}
    if shell == "fish":
        return "".join(_fish(parser, known))
    script = _bash(parser, known)
    return script if shell == "bash" else f"{_ZSH}{script}"


def _bash(parser: argparse.ArgumentParser, known: dict[str, argparse.ArgumentParser]) -> str:
    verbs, place = [name for name in known if name], "${COMP_WORDS[1]} " if len(known) > 1 else ""
    values, options = [], []
    for name, one in known.items():
        words = [flag for each in _options(one) for flag in each.option_strings if flag.startswith("--")]
        words = [*verbs, *words] if not name else words
        options.append(f'            {name or "*"}) words="{" ".join(words)}" ;;')
        before = f"{name} " if name else "*" if verbs else ""
        for each in _options(one):
            if each.choices and not (verbs and not name):
                patterns = "|".join(f'"{before}{flag}"' for flag in each.option_strings)
                values.append(f'        {patterns}) words="{" ".join(map(str, each.choices))}" ;;')
    options = [*options[1:], options[0]]  # what is no verb comes last
    return _BASH.format(
        function=f"_{parser.prog.replace('-', '_')}",
        program=parser.prog,
        place=place,
        verb="${COMP_WORDS[1]}",
        values="\n".join(values),
        options="\n".join(options),
    )


def _fish(parser: argparse.ArgumentParser, known: dict[str, argparse.ArgumentParser]) -> Iterator[str]:
    def quoted(text: str) -> str:
        return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"

    for name, (_, summary) in verbs_of(parser).items():
        yield f"complete -c {parser.prog} -n __fish_use_subcommand -f -a {name} -d {quoted(summary)}\n"
    for name, one in known.items():
        place = f"'__fish_seen_subcommand_from {name}'" if name else "__fish_use_subcommand"
        when = f"-n {place} " if len(known) > 1 else ""
        for each in _options(one):
            takes = "" if each.nargs in {0, "?", "*"} else "-r "
            if each.choices:
                takes += f"-f -a {quoted(' '.join(map(str, each.choices)))} "
            for flag in each.option_strings:
                kind = "-l " if flag.startswith("--") else "-s "
                yield f"complete -c {parser.prog} {when}{kind}{flag.lstrip('-')} {takes}-d {quoted(_help(each))}\n"
