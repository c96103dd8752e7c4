"""What a trial is at, as JSON for the page. Files are read, none is written or kept open.

The form is the page's own: server and page are of one version.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, final

from zfcal.arena import Arena
from zfcal.artifacts.reading.contents import looks_of
from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.artifacts.tables import read_extra
from zfcal.artifacts.validation import check, read_json
from zfcal.errors import ZfcalError
from zfcal.stages.recording import starts_between, stretch_of
from zfcal.stages.skipping import skipped_ends
from zfcal.trial import Trial
from zfcal.units import SEGMENT_S
from zfcal.view.minutes import minute_starts
from zfcal.view.reading import Reader
from zfcal.view.rounds import rounds_of, scores_of

_VERDICTS = {
    "named": "An effect is missing in the model.",
    "tie": "An effect is missing; several explain it as well.",
    "unexplained": "Model and fish differ, and no known effect explains it.",
    "no-effect": "No effect is missing that this recording could show.",
    "untestable": "The recording is too short to show an effect.",
}


@final
class TrialState:
    """Looks at a trial again and again; only what has changed is read.

    Parameters
    ----------
    trial, arena
        The trial.
    """

    def __init__(self, trial: Trial, arena: Arena) -> None:
        self._trial = trial
        self._arena = arena
        self._reader = Reader(trial.root)

    def look(self) -> dict[str, Any]:
        """Return the state of the trial.

        Returns
        -------
        dict
            ``gone`` (whether the trial cannot be found), ``minutes`` (seconds at which those
            start that can be played), ``whole`` (whether the recording is there to its end),
            ``last`` (for ``track``, ``analyse`` and ``calibrate`` the second to which it is
            done, or null), ``rounds``, ``scores``, ``skipped`` (ends of windows without a
            model), ``findings`` (or null) and ``problems`` (files that cannot be read).
        """
        root, reader = self._trial.root, self._reader
        reader.begin()
        gone = looks_of(self._trial.config) is None
        rounds = rounds_of(reader, self._trial, self._arena)
        segments = _or_none(lambda: segment_starts(root)) or []
        minutes = _or_none(lambda: minute_starts(root)) or []
        stats = list(reader.files("stats", ".parquet"))
        return {
            "gone": gone,
            "minutes": minutes,
            "whole": minutes[-1:] == segments[-1:] and self._is_whole(segments),
            "last": {
                "track": segments[-1] + int(SEGMENT_S) if segments else None,
                "analyse": stats[-1] if stats else None,
                "calibrate": rounds[-1]["end_s"] if rounds and rounds[-1]["end_s"] else None,
            },
            "rounds": rounds,
            "scores": scores_of(reader),
            "skipped": sorted(_or_none(lambda: skipped_ends(root)) or ()),
            "findings": reader.read(root / "diagnosis" / "findings.json", findings_of),
            "problems": reader.problems,
        }

    def _is_whole(self, segments: list[int]) -> bool:
        """Return whether the last segment says that the recording ends with it."""
        stretches = [
            self._reader.read(segment_path(self._trial.root, start), _stretch) for start in segments
        ]
        if not stretches or stretches[-1] is None:
            return False
        return starts_between(*stretches[-1])[-1] == segments[-1]


def _stretch(path: Path) -> tuple[float, float] | None:
    """Return from where to where the recording of a segment goes; None for no word.

    Raises
    ------
    InputError, DamagedError
        The segment is none: each is asked for, so that this is told.
    """
    read_extra(path)
    return stretch_of(path)


def findings_of(path: Path) -> dict[str, Any]:
    """Return what a diagnosis found.

    Returns
    -------
    dict
        ``verdict``, a sentence, and ``effects``, each with ``name``, ``says`` and ``p``.

    Raises
    ------
    InputError, DamagedError
        The file is none that a diagnosis writes.
    """
    found = read_json(path)
    check(found, "findings", path)
    effects = [{key: each[key] for key in ("name", "says", "p")} for each in found["effects"]]
    return {"verdict": _VERDICTS[found["verdict"]], "effects": effects}


def _or_none(ask: Any) -> Any:
    """Return an answer; None where a folder cannot be listed, which the next look may mend."""
    try:
        return ask()
    except (OSError, ZfcalError):
        return None
