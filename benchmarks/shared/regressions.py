"""Where a benchmark's results go, and what has become worse since the committed ones.

A fresh run goes to ``build/benchmarks`` and leaves the committed results alone, so that
there is something to compare with; ``--write`` renews results and documentation.
Compared are ratios between things measured side by side: they depend less on the machine
than seconds do.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from benchmarks.shared.measuring import DOCS, RESULTS, ROOT, keep, table

BUILD = ROOT / "build" / "benchmarks"

LIMIT = 1.2
"""A ratio that is worse by more than this factor is reported."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ratio:
    """Two things measured side by side, one over the other.

    Parameters
    ----------
    value
        Positive; NaN where it could not be measured.
    better
        Whether less or more of it is better.
    """

    value: float
    better: Literal["less", "more"] = "less"


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """How a ratio stands against the committed one.

    Parameters
    ----------
    name
        Of the ratio.
    committed, fresh
        Its two values.
    factor
        How many times worse the fresh one is; below one it is better.
    """

    name: str
    committed: float
    fresh: float
    factor: float

    @property
    def is_worse(self) -> bool:
        """Whether it is to be reported; what cannot be compared is, too."""
        return not self.factor <= LIMIT


@dataclass(frozen=True, slots=True, kw_only=True)
class Places:
    """Where the files of a run go.

    Parameters
    ----------
    results
        Folder of the JSON.
    docs
        Folder of the Markdown.
    """

    results: Path
    docs: Path


def changes(fresh: Mapping[str, Ratio], committed: Mapping[str, Ratio]) -> list[Change]:
    """Return how each ratio that both runs have has changed, in the fresh run's order."""
    return [
        Change(
            name=name,
            committed=committed[name].value,
            fresh=ratio.value,
            factor=_factor(ratio, committed[name]),
        )
        for name, ratio in fresh.items()
        if name in committed
    ]


def _factor(fresh: Ratio, committed: Ratio) -> float:
    pair = (fresh.value, committed.value)
    above, below = pair if fresh.better == "less" else pair[::-1]
    return above / below if below > 0 else math.nan


def parser(doc: str | None, *, tiny: bool = True) -> argparse.ArgumentParser:
    """Return the options that all benchmarks have.

    Parameters
    ----------
    doc
        The script's docstring; its first line is shown.
    tiny
        Whether the script can measure next to nothing; otherwise it never does.
    """
    made = argparse.ArgumentParser(description=(doc or "").partition("\n")[0])
    made.set_defaults(tiny=False)
    if tiny:
        made.add_argument("--tiny", action="store_true", help="Only see whether it runs.")
    made.add_argument(
        "--write", action="store_true", help="Renew the committed results and documentation."
    )
    made.add_argument("--out", type=Path, help="Write all files there.")
    return made


def places(options: argparse.Namespace) -> Places:
    """Return where the files of a run with these options go.

    Raises
    ------
    SystemExit
        A tiny run is to be committed.
    """
    if options.write and options.tiny:
        raise SystemExit("What --tiny measures is not worth keeping: leave out --write.")
    if options.out is not None:
        return Places(results=options.out, docs=options.out)
    if options.write:
        return Places(results=RESULTS, docs=DOCS)
    return Places(results=BUILD, docs=BUILD)


def read(name: str, folder: Path | None = None) -> dict[str, Any] | None:
    """Return what was measured, the committed results by default; None if there is nothing."""
    path = (folder or RESULTS) / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def written(name: str, options: argparse.Namespace) -> dict[str, Any]:
    """Return what an earlier run with the same place has measured.

    Raises
    ------
    SystemExit
        There is nothing.
    """
    folder = places(options).results
    found = read(name, folder)
    if found is None:
        raise SystemExit(f"{folder} has no {name}.json; --write takes the committed one.")
    return found


def report(name: str, fresh: Mapping[str, Ratio], committed: Mapping[str, Ratio]) -> str:
    """Return the table of what has changed; say on stderr what has become worse."""
    found = changes(fresh, committed)
    if not found:
        return "Nothing is committed to compare with.\n"
    for change in found:
        if change.is_worse:
            print(
                f"{name}: {change.name} got worse by a factor of {change.factor:.2f}: "
                f"{change.committed:.3g} committed, {change.fresh:.3g} now.",
                file=sys.stderr,
            )
    rows = [
        [c.name, c.committed, c.fresh, f"{c.factor:.2f}", "WORSE" if c.is_worse else ""]
        for c in found
    ]
    return table(("ratio", "committed", "now", "times worse", ""), rows)


def conclude(
    name: str,
    found: dict[str, Any],
    text: str,
    *,
    ratios: Callable[[dict[str, Any]], Mapping[str, Ratio]],
    options: argparse.Namespace,
) -> None:
    """Keep what was measured and its document, print it, and compare it.

    Parameters
    ----------
    name
        Of the JSON, with underscores; of the document with hyphens.
    found
        What was measured.
    text
        Its document.
    ratios
        Makes the ratios of what was measured, now or when it was committed.
    options
        Of the command line.
    """
    committed = read(name)
    place = places(options)
    keep(name, found, results=place.results)
    place.docs.mkdir(parents=True, exist_ok=True)
    document = place.docs / f"benchmarks-{name.replace('_', '-')}.md"
    document.write_text(text, encoding="utf-8")
    print(text)
    if options.tiny:
        print(f"Kept in {document}; a tiny run is not compared.\n")
        return
    print(f"Kept in {document}. Against the committed results:\n")
    print(report(name, ratios(found), ratios(committed) if committed else {}))
