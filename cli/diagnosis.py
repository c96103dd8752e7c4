"""How `zfcal diagnose` goes through its trials."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from .output import Output

if TYPE_CHECKING:
    from zfcal.report.options import Printing
    from zfcal.stages.diagnose.diagnose import DiagnoseOptions
    from zfcal.stages.trial_context import Task


def diagnose_all(
    out: Output,
    roots: Iterable[Path],
    chosen: DiagnoseOptions,
    task: Task,
    *,
    printing: Printing,
) -> None:
    """Diagnose trials, draw their pages, and say in words what each comes to."""
    from zfcal.api.diagnosing import tell_findings
    from zfcal.report.diagnosis.render_pool import RenderPool
    from zfcal.stages.diagnose.diagnose import diagnose

    # The document of several trials holds their verdicts, and all that is said.
    in_words = out.bare or not out.as_json
    with RenderPool(printing=printing) as pool:
        for root in roots:
            tell = functools.partial(tell_findings, out.tell, root, in_words=in_words)
            work = functools.partial(diagnose, root, chosen, tell, task=task, draw=pool)
            out.attempt(work)
