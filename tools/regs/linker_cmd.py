"""Reads the MEMORY and SECTIONS of TI's linker command files."""

from __future__ import annotations

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class Region:
    """A range of 16-bit words."""

    name: str
    origin: int
    length: int

    @property
    def end(self) -> int:
        """First address behind the region."""
        return self.origin + self.length

    def words(self) -> range:
        """Every address of the region."""
        return range(self.origin, self.end)


def parse_memory(text: str) -> list[Region]:
    """The regions of a MEMORY block, in the order of the file."""
    rows = re.findall(
        r"(\w+)\s*:\s*origin\s*=\s*(0x[0-9A-Fa-f]+)\s*,\s*length\s*=\s*(0x[0-9A-Fa-f]+)",
        _without_comments(text),
    )
    return [Region(name, int(at, 16), int(length, 16)) for name, at, length in rows]


def parse_placement(text: str) -> dict[str, str]:
    """Region in which each output section of a SECTIONS block runs, by the section's name."""
    body = _without_comments(text).partition("SECTIONS")[2]
    plain = re.findall(r"([.\w]+)\s*:\s*(?:\{[^{}]*\}\s*)?>\s*(\w+)", body)
    copied = re.findall(r"([.\w]+)\s*:\s*\{[^{}]*\}\s*LOAD\s*=\s*\w+\s*,\s*RUN\s*=\s*(\w+)", body)
    return dict(plain + copied)


def parse_load(text: str) -> dict[str, str]:
    """Region from which a section that runs elsewhere is loaded, by the section's name."""
    body = _without_comments(text).partition("SECTIONS")[2]
    return dict(re.findall(r"([.\w]+)\s*:\s*\{[^{}]*\}\s*LOAD\s*=\s*(\w+)", body))


def _without_comments(text: str) -> str:
    return re.sub(r"/\*.*?\*/", " ", text, flags=re.DOTALL)
