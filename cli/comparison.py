"""How `zfcal compare` tells what was found."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .output import Output


def compare_and_say(
    out: Output, roots: tuple[list[Path], list[Path]], asked: Mapping[str, Any]
) -> None:
    """Compare two sets of trials; the table is the result where no file is."""
    from zfcal.api.comparing import compare_sets, tell_comparison
    from zfcal.report.comparison.table import lines_of

    document = compare_sets(roots, asked, out.tell)
    if document is None:
        return
    text, is_result = "\n".join(lines_of(document)), asked["out"] is None
    out.result(document, text=text if is_result else None)
    if not is_result:
        out.note(text)
    tell_comparison(document, out.tell)
