"""`zfcal.analyse`, and what its command does with its options."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from zfcal.api import tables
from zfcal.api.trials import TrialPath, heard_by, paths_of, tables_of, task_of, work_of
from zfcal.api.values import Names, existing, names, one_of, taken
from zfcal.errors import OptionError
from zfcal.stages.analyse.analyse import AnalyseOptions
from zfcal.stages.analyse.analyse import analyse as analyse_trial
from zfcal.stages.events import Tell
from zfcal.stages.segments import Segments
from zfcal.stages.streams import Work


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysis:
    """What analyses trials as the options of the command say.

    Parameters
    ----------
    chosen
        What bears on the numbers.
    options
        Those of the command.
    segments
        What was read already: trials may share it.
    """

    chosen: AnalyseOptions
    options: Mapping[str, Any]
    segments: Segments = field(default_factory=Segments)

    def __call__(self, found: Work, tell: Tell) -> None:
        """Analyse a trial."""
        task = task_of(self.options, found.ends_s)
        analyse_trial(found.root, self.chosen, tell, task=task, segments=self.segments)


def analysis_of(options: Mapping[str, Any]) -> Analysis:
    """Return what analyses trials as the options of the command say.

    Parameters
    ----------
    options
        By the names of the arguments of `analyse`.

    Raises
    ------
    OptionError
        One has another form, or could not take effect.
    """
    needed = {"control": _controls, "scoring": one_of("paper", "legacy")}
    asked = taken(options, {"features": names}, needed=needed)
    features = asked["features"]
    chosen = AnalyseOptions(
        scoring=asked["scoring"], control=asked["control"], features=features or ()
    )
    if features is not None and not chosen.further:
        raise OptionError("--features names none beyond D, W, O, T and V: these are counted.")
    return Analysis(chosen=chosen, options=asked)


def _controls(trials: TrialPath | Iterable[TrialPath]) -> tuple[Path, ...]:
    return tuple(map(existing, paths_of(trials)))


def analyse(
    trial: TrialPath,
    *,
    control: TrialPath | Iterable[TrialPath] = (),
    scoring: Literal["paper", "legacy"] = "paper",
    features: Names | None = None,
    dry_run: bool = False,
    force: bool = False,
    tell: Tell | None = None,
) -> tables.TrialTables:
    """Make statistics and scores of each window of 120 s, every 60 s: ``zfcal analyse``.

    Writes ``stats/E.parquet``, ``stats/E-following.parquet`` and ``scores/E.parquet`` for each
    second E at which a window ends, where they are missing or stale.

    Parameters
    ----------
    trial
        Its directory, or its tables. Of a file in it only the windows that depend on it are made.
    control
        Robot-free trials whose fish, pooled, are the control; none for the trial's own fish.
    scoring
        ``legacy``: as the authors' published scripts compute the score.
    features
        Statistics to count beside D, W, O, T and V, such as ``"residence,curvature"``.
    dry_run
        Write nothing; `tell` gets what would be made, and why.
    force
        Make what is up to date again.
    tell
        Function that gets an event for every file, for what is left out, and for progress
        (`zfcal.stages.events`). By default what is left out is a warning, and the rest is logged
        as ``zfcal``.

    Returns
    -------
    TrialTables
        Of the trial: ``stats()``, ``scores()`` and ``following()`` are what was made, one row per
        bin, score and measure, times in seconds and lengths in metres.

    Raises
    ------
    OptionError
        An option has a wrong type or value, or would have no effect.
    InputError
        There is no trial, its settings are wrong, or no scoring or feature has that name.
    StorageError
        The disk is full, or a place cannot be written.
    LockedError
        The same command is running on the trial.

    Examples
    --------
    >>> import zfcal
    >>> tables = zfcal.analyse("trial")
    >>> scores = tables.scores()
    >>> scores[scores["feature"] == "S"]["window_end_s"].unique().tolist()
    [120, 180]
    """
    work, found = analysis_of(locals()), work_of(trial)
    work(found, heard_by(tell))
    return tables_of(found.root)
