"""One search for a model: what is asked of it, how it is kept, and what it has to beat.

What it starts from and where its result goes is the business of those who ask for it.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

from zfcal.artifacts.atomic import append_bytes, check_free, write_bytes_whole
from zfcal.artifacts.lineage import JSON, Lineage, to_json
from zfcal.artifacts.machine import cores
from zfcal.artifacts.reading.opening import read_limited
from zfcal.calibrate.baselines import random_search, unchanged
from zfcal.calibrate.checkpoint import from_bytes, to_bytes
from zfcal.calibrate.pace import Deadline
from zfcal.calibrate.rounds import RoundResult, calibrate_window
from zfcal.calibrate.scheduler import Cluster
from zfcal.calibrate.search import Progress as Search
from zfcal.calibrate.task import DEFAULT_GENERATIONS, Settings
from zfcal.calibrate.task import Task as RoundTask
from zfcal.errors import DamagedError, InputError
from zfcal.stages.events import Progress, Tell
from zfcal.stages.taken import unless_taken
from zfcal.trial import Trial

_INSTANT_S = 0.001


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrateOptions:
    """How to calibrate.

    Parameters
    ----------
    settings
        How much a round does; bears on the result.
    budget_s
        Wall-clock seconds a round may take; None for no limit. The artifact
        records the generations that were run, not the budget.
    seed
        None for the trial's.
    n_workers
        Threads; None for one a core. The numbers do not depend on it.
    baselines
        Whether to score random search and the last model beside the champion.
    seed_likelihood
        Whether the maximum-likelihood estimate from the window's tracks joins the
        first population; False is the paper's way.
    cluster
        Who simulates instead of this machine's threads. The numbers do not depend
        on it.
    model
        The model whose parameters, and strengths of effects, are calibrated; None for the
        trial's own starting model.
    keeps_way
        Whether rounds publish as those that the trial has already, and by the rule that has been
        better where it has none, whatever the settings say.
    """

    settings: Settings = field(default_factory=Settings)
    budget_s: float | None = None
    seed: int | None = None
    n_workers: int | None = None
    baselines: bool = False
    seed_likelihood: bool = True
    cluster: Cluster | None = None
    model: Path | None = None
    keeps_way: bool = False

    def __post_init__(self) -> None:
        if self.budget_s is not None and not self.budget_s > 0:
            raise InputError(f"A budget must be a positive time, got {self.budget_s!r} s.")
        if self.budget_s is not None and self.settings.generations is not None:
            raise InputError(
                "A round ends after --generations or with its --budget, not with both.",
                hint="Give one of them; the artifact records the generations that were run.",
            )

    @property
    def generations_asked(self) -> int:
        """Generations of a round that has no budget."""
        asked = self.settings.generations
        return DEFAULT_GENERATIONS if asked is None else asked

    def seed_of(self, trial: Trial) -> int:
        """Return the seed of all random numbers of a calibration on a trial."""
        return trial.seed if self.seed is None else self.seed

    @property
    def not_asked(self) -> tuple[str, ...]:
        """Options of a round's lineage that nobody asked for: a budget ends it where it ends."""
        return ("generations",) if self.budget_s is not None else ()

    @property
    def workers(self) -> int:
        """Threads to use."""
        return self.n_workers or cores()

    def model_of(self, trial: Trial) -> Path:
        """Return the file of the model that is calibrated in a trial."""
        return trial.root / trial.model if self.model is None else self.model

    def left_since(self, began_s: float) -> CalibrateOptions:
        """Return the options with what is left of the budget of a round that began then.

        Parameters
        ----------
        began_s
            By the monotonic clock. What came before the search is a part of the round.
        """
        if self.budget_s is None:
            return self
        left_s = self.budget_s - (time.monotonic() - began_s)
        return replace(self, budget_s=max(left_s, _INSTANT_S))

    def deadline(self) -> Deadline | None:
        """Return when a round that starts now has to be over."""
        if self.budget_s is None:
            return None
        return Deadline(ends_s=time.monotonic() + self.budget_s, clock=time.monotonic)


AS_PUBLISHED = CalibrateOptions(
    settings=Settings(
        optimiser="deap", champion="score", n_confirmed=0, diversity="population", renews=False
    ),
    seed_likelihood=False,
)
"""The paper's own way (docs/as-published.md), save for what no option brings back."""


class Checkpoint:
    """The file that keeps a search: whole at first, then a block for each generation.

    Parameters
    ----------
    path
        Where it lies.
    key
        Of the round; a file with another one is of no use.
    """

    def __init__(self, path: Path, key: str) -> None:
        self._path = path
        self._key = key
        self._kept: Search | None = None

    def save(self, progress: Search) -> None:
        """Keep where the search is.

        Raises
        ------
        StorageError
            The disk is full, or the place cannot be written.
        """
        data = to_bytes(progress, key=self._key, since=self._kept)
        if self._kept is None:
            write_bytes_whole(self._path, data, parents=False)
        else:
            append_bytes(self._path, data)
        self._kept = progress

    def load(self, *, at_most: int | None) -> Search | None:
        """Return where a killed round was; None to start anew.

        Parameters
        ----------
        at_most
            Generations that are asked for: one that is farther is of no use.
        """
        try:
            progress = from_bytes(read_limited(self._path), key=self._key)
        except (OSError, DamagedError):
            # Starting anew ends in the same result, and the first save replaces the file.
            return None
        if progress is None or (at_most is not None and progress.state.generation > at_most):
            return None
        return progress


def checkpoint_key(lineage: Lineage) -> str:
    """Return what a checkpoint must agree in to be of use: all but the generations."""
    said = lineage.as_dict()
    del said["schema"]
    said["options"] = {
        name: value
        for name, value in said["options"].items()
        if name not in {"generations", "baselines"}
    }
    return to_json(said)


def run_search(
    round_task: RoundTask,
    options: CalibrateOptions,
    checkpoint: Path,
    tell: Tell,
    *,
    key: str,
) -> RoundResult:
    """Calibrate, with a checkpoint after every generation; go on where a killed run was.

    Parameters
    ----------
    round_task
        What to calibrate on what.
    options
        How.
    checkpoint
        Where to keep it; the caller removes it when the result is written. Where a folder
        stands there, nothing is kept, and that is told.
    tell
        Hears of each generation.
    key
        What a checkpoint must agree in to be of use.
    """
    at_most = options.generations_asked if options.budget_s is None else None
    started_s = time.monotonic()
    stage = f"window to {round_task.seeds.window_end_s} s"
    kept = Checkpoint(checkpoint, key)
    is_kept = False
    with unless_taken(checkpoint, tell):
        check_free(checkpoint)
        is_kept = True

    def watch(search: Search) -> None:
        if is_kept:
            kept.save(search)
        done, total = search.state.generation, options.generations_asked
        if options.budget_s is not None:
            done, total = int(time.monotonic() - started_s), math.ceil(options.budget_s)
        tell(Progress(stage=stage, done=min(done, total), total=total))

    return calibrate_window(
        round_task,
        options.settings,
        deadline=options.deadline(),
        watch=watch,
        resume=kept.load(at_most=at_most),
    )


def baseline_scores(
    round_task: RoundTask, options: CalibrateOptions, result: RoundResult
) -> dict[str, JSON]:
    """Return the score of what the round has to beat; empty unless baselines are asked for.

    Parameters
    ----------
    round_task
        Of the round.
    options
        Say whether, and how long an evaluation is.
    result
        Random search gets as many evaluations as it took.
    """
    if not options.baselines:
        return {}
    n = result.evaluations
    luck = random_search(round_task, options.settings, n_evaluations=n)
    scores = {"random_search": luck.scores.overall}
    if round_task.previous is not None:
        champion = round_task.previous.champion
        scores["last_window_unchanged"] = unchanged(
            round_task, options.settings, genes=champion
        ).scores.overall
    return {name: None if math.isnan(value) else value for name, value in scores.items()}
