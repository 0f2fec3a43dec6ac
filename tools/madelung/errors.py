"""The one exception that a user's input can cause."""

from __future__ import annotations


class InputError(Exception):
    """Bad input or usage: one sentence with file, row, what is wrong and what to do.

    The command line prints it as one line on stderr and exits with code 2.
    """
