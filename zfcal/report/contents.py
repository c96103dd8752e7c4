"""What stands on a page, as text alone: whoever has it need not be able to draw."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A picture as the page shows it.

    Parameters
    ----------
    name, title, short, note
        As those of the `Picture`.
    panels
        Elements of the page.
    keys
        The mark of each entry, ``svg``, and its ``label``.
    """

    name: str
    title: str
    short: str
    note: str
    panels: list[str]
    keys: list[dict[str, str]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Statement:
    """A question of the reader's and its answer.

    Parameters
    ----------
    question
        In everyday words.
    answer
        Sentences.
    figure
        The number that stands out, with its name; empty without one.
    warns
        Whether the answer puts all others in doubt.
    """

    question: str
    answer: str
    figure: tuple[str, str] = ("", "")
    warns: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """Something that is not there yet, and the command that makes it.

    Parameters
    ----------
    what
        What is missing, and why it matters.
    command
        What to type; empty where nothing can be done.
    """

    what: str
    command: str = ""
