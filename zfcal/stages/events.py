"""What a stage tells while it works.

A stage takes a callback and hands it these; who shows them, and how, is the
caller's business (the command line, or a loop that waits for new segments).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias


@dataclass(frozen=True, slots=True, kw_only=True)
class Made:
    """An artifact appeared.

    Parameters
    ----------
    path
        Where it is.
    reason
        Why it was made, such as ``missing``.
    """

    path: Path
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class UpToDate:
    """An artifact is there already, and nothing that bears on it has changed."""

    path: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Planned:
    """An artifact would be made, were this not a dry run."""

    path: Path
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LeftOut:
    """Something was left out, and the rest goes on.

    Parameters
    ----------
    path
        The file that is damaged, or the artifact that could not be made for it.
    problem
        What is wrong, in a sentence that names the file.
    hint
        What to do about it.
    damaged
        Whether an input is at fault: then the command ends with exit code 3.
    """

    path: Path
    problem: str
    hint: str = ""
    damaged: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Note:
    """Something worth knowing, or a warning.

    Parameters
    ----------
    text
        What, in a sentence.
    warning
        Whether it is one.
    kind, values
        What happened, for lines of JSON: its name there, and what belongs to it.
    """

    text: str
    warning: bool = False
    kind: str = ""
    values: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far a stage is: ``done`` of ``total`` steps."""

    stage: str
    done: int
    total: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """Numbers for whoever reads JSON; they stand in an artifact as well."""

    value: dict[str, Any]


Event: TypeAlias = Made | UpToDate | Planned | LeftOut | Note | Progress | Result
Tell: TypeAlias = Callable[[Event], None]


def say_nothing(event: Event) -> None:
    """Take an event and do nothing: for callers that want the files alone."""


def as_line(event: object) -> tuple[str, dict[str, Any]]:
    """Return an event's kind in a line of JSON, and its values; an empty kind for none."""
    match event:
        case Made():
            return "made", {"path": str(event.path), "reason": event.reason}
        case UpToDate():
            return "up-to-date", {"path": str(event.path)}
        case LeftOut():
            words = {"path": str(event.path), "problem": event.problem, "hint": event.hint}
            return "left-out", words
        case Note():
            return "note", {"text": event.text, "warning": event.warning}
        case Result():
            return "result", {"value": event.value}
    return "", {}
