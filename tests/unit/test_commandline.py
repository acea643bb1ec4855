"""What all commands do alike: errors of usage are one line."""

import pytest

from common.commandline import ExamplesFirstParser


def sample() -> ExamplesFirstParser:
    parser = ExamplesFirstParser("sample", description="examples:\n  sample run\n")
    verb = parser.add_subparsers(dest="verb", required=True, metavar="VERB").add_parser("run")
    verb.add_argument("--count", type=int, required=True)
    verb.add_argument("--kind", choices=("a", "b"))
    return parser


@pytest.mark.parametrize(
    ("arguments", "start", "culprit"),
    [
        ([], "sample: error: ", "VERB"),
        (["walk"], "sample: error: ", "walk"),
        (["run"], "sample run: error: ", "--count"),
        (["run", "--count", "many\nlines"], "sample run: error: ", "many"),
        (["run", "--count", "1", "--kind", "c"], "sample run: error: ", "--kind"),
        (["run", "--count", "1", "--spee\nd", "3"], "sample: error: ", "--spee"),
    ],
)
def test_wrong_usage_is_one_line_and_exit_2(
    arguments: list[str], start: str, culprit: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """The command's and a verb's own errors are one line on stderr that names the culprit, without the usage."""
    with pytest.raises(SystemExit) as caught:
        sample().parse_args(arguments)
    assert caught.value.code == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(start)
    assert said.err.endswith(" --help\n")
    assert said.err.count("\n") == 1
    assert culprit in said.err
