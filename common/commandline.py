"""What the commands' parsers have in common: help opens with examples."""

import argparse


class ExamplesFirstParser(argparse.ArgumentParser):
    """A parser whose help shows its description, the examples, before everything else, as it stands."""

    def format_help(self) -> str:
        """Give the help text."""
        examples, self.description = self.description or "", None
        try:
            return f"{examples}\n{super().format_help()}"
        finally:
            self.description = examples
