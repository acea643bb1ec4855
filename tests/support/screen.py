"""What a terminal shows: the few control sequences that our programs write, on a screen of a given size."""

import re
from typing import Final

_TOKEN: Final = re.compile(r"\x1b\[(\??)([0-9;]*)([A-Za-z])|\r|\n|[^\x1b\r\n]")


class Screen:
    """A terminal's screen.

    Args:
        width: of the screen, characters.
        height: of the screen, rows.
    """

    def __init__(self, width: int, height: int) -> None:
        self._width, self._height = width, height
        self._rows = [""] * height
        self.gone: list[str] = []
        """Rows that have scrolled off the top, from first to last."""
        self._row = self._column = 0
        self.is_cursor_shown = True

    def feed(self, text: str) -> None:
        """Show what a program wrote."""
        for token in _TOKEN.finditer(text):
            if token[3]:
                self._control(token[1], token[2], token[3])
            elif token[0] == "\r":
                self._column = 0
            elif token[0] == "\n":
                self._next_row()
            else:
                self._put(token[0])

    @property
    def rows(self) -> list[str]:
        """The rows from top to bottom, without blanks at their ends."""
        return [row.rstrip() for row in self._rows]

    @property
    def everything(self) -> list[str]:
        """All rows that are not empty, also those that have scrolled off."""
        return [row for row in (*(row.rstrip() for row in self.gone), *self.rows) if row]

    def _put(self, character: str) -> None:
        if self._column == self._width:  # a terminal wraps only when the next character comes
            self._column = 0
            self._next_row()
        row = self._rows[self._row].ljust(self._column)
        self._rows[self._row] = row[: self._column] + character + row[self._column + 1 :]
        self._column += 1

    def _next_row(self) -> None:
        if self._row < self._height - 1:
            self._row += 1
        else:
            self.gone.append(self._rows.pop(0))
            self._rows.append("")

    def _control(self, private: str, number: str, letter: str) -> None:
        if private:
            if number == "25":
                self.is_cursor_shown = letter == "h"
        elif letter == "A":
            self._row = max(0, self._row - int(number or 1))
        elif letter == "K" and number == "2":
            self._rows[self._row] = ""
        elif letter != "m":
            raise AssertionError(f"this screen does not know ESC[{number}{letter}")
