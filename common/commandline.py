"""What the commands' parsers have in common: help opens with examples, an error is one line."""

import argparse
from typing import NoReturn


class ExamplesFirstParser(argparse.ArgumentParser):
    """A parser whose help shows its description, the examples, before everything else, as it stands.

    Its sub-parsers are of the same class.
    """

    def format_help(self) -> str:
        """Give the help text."""
        examples, self.description = self.description or "", None
        try:
            return f"{examples}\n{super().format_help()}"
        finally:
            self.description = examples

    def error(self, message: str) -> NoReturn:
        """Say what is wrong in one line on stderr, without the usage, and leave with exit 2."""
        one_line = " ".join(message.split())
        self.exit(2, f"{self.prog}: error: {one_line}: see {self.prog} --help\n")
