"""What the figures and the page draw from: a trial's artifacts, read and sorted.

Plain data. Files are opened in ``gather``; nothing here draws.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import MappingProxyType

import numpy as np

from zfcal.arena import Arena
from zfcal.arrays import Floats, Ints
from zfcal.artifacts.lineage import Lineage
from zfcal.behaviour.features.registry import SCORED, named
from zfcal.behaviour.statistics import Statistics
from zfcal.parameters import Parameters
from zfcal.report.driven import Driven
from zfcal.report.followed import Followed
from zfcal.report.seen import Seen, Visits
from zfcal.trial import Trial

MODEL = "model-vs-control"
SOCIAL = "social-vs-control"
ROBOT = "robot-vs-fish"

FEATURE_NAMES: Mapping[str, str] = MappingProxyType(
    {name: named(name).label for name in SCORED} | {"S": "Biomimetic score S"}
)
"""The features, by the paper's letters, in its order."""

FEW = 100
"""A histogram of fewer observations, ten for each bin, is hardly more than chance."""

PUBLISHED_S = ((180, 0.610), (300, 0.827), (360, 0.850))
"""Second and S of the published reference (mean of 10 trials); the last holds from then on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """One score with its ceiling; NaN where there is none.

    Parameters
    ----------
    value
        The similarity.
    low, high
        2.5 and 97.5 % quantiles of what the ceiling is the mean of.
    ceiling
        What a perfect match would score.
    n
        Of how many comparisons the ceiling is the mean.
    """

    value: float
    low: float = float("nan")
    high: float = float("nan")
    ceiling: float = float("nan")
    n: int = 0

    @property
    def against_ceiling(self) -> float:
        """The score over its ceiling: about one where nothing is missed."""
        return self.value / self.ceiling if self.ceiling > 0 else float("nan")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """One score over the windows of a trial.

    Parameters
    ----------
    end_s : ndarray of int64, shape (window,)
        Seconds at which the windows end, ascending.
    value, low, high, ceiling : ndarray, shape (window,)
        As in the scores table; NaN where that is null.
    n : ndarray of int64, shape (window,)
        Of how many comparisons the ceiling is the mean; 0 without one.
    """

    end_s: Ints
    value: Floats
    low: Floats
    high: Floats
    ceiling: Floats
    n: Ints

    @property
    def last(self) -> int | None:
        """Index of the last window that has a value; None without any."""
        known = np.flatnonzero(~np.isnan(self.value))
        return int(known[-1]) if known.size else None

    def mark(self, index: int) -> Mark:
        """Return the score of one window."""
        parts = (self.value, self.low, self.high, self.ceiling)
        value, low, high, ceiling = (float(part[index]) for part in parts)
        return Mark(value=value, low=low, high=high, ceiling=ceiling, n=int(self.n[index]))

    def since(self, second: int) -> Course:
        """Return the windows that end at a second or later."""
        late = self.end_s >= second
        return Course(**{f.name: getattr(self, f.name)[late] for f in fields(self)})

    def mean(self) -> Mark:
        """Return the mean over the windows that have a value."""
        known = ~np.isnan(self.value)
        parts = (self.value, self.low, self.high, self.ceiling)
        value, low, high, ceiling = (_mean(part[known]) for part in parts)
        return Mark(value=value, low=low, high=high, ceiling=ceiling)


NO_COURSE = Course(
    end_s=np.zeros(0, dtype=np.int64),
    value=np.zeros(0),
    low=np.zeros(0),
    high=np.zeros(0),
    ceiling=np.zeros(0),
    n=np.zeros(0, dtype=np.int64),
)

CourseKey = tuple[str, str, str | None]
"""What is compared, the feature, and the zone (None for all of them)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Published:
    """By which rule a model was published, and why.

    Parameters
    ----------
    rule
        Its name.
    because
        The reason, in words.
    of_s
        Second at which the window ends that the model was made of; None where it is not known.
    """

    rule: str
    because: str = ""
    of_s: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RuleScore:
    """What the model of a rule scored on a window after it was made.

    Parameters
    ----------
    rule
        Its name.
    end_s, made_at_s
        Seconds at which the window ends that it was judged on, and the one at which it was made.
    score
        S; NaN where nothing could be counted.
    """

    rule: str
    end_s: int
    made_at_s: int
    score: Mark


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """The model of one calibration round.

    Parameters
    ----------
    second
        End of its window; 0 is the starting model.
    parameters
        The model itself.
    intervals
        Lower and upper bound by gene name, in the parameter's own unit.
    unidentified
        Names of the parameters that the window does not pin down.
    intervals_by
        ``likelihood``, or ``score`` for those of the genomes that score as well.
    published
        Why this model was published; None where the file does not say.
    score
        The score of the statistics that it was calibrated on, with its ceiling; None for S.
    score_of
        Names of these statistics.
    hypervolume
        Of the population, generation by generation; empty where the file does not say.
    """

    second: int
    parameters: Parameters
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    unidentified: frozenset[str] = frozenset()
    intervals_by: str = "score"
    published: Published | None = None
    score: Mark | None = None
    score_of: tuple[str, ...] = ()
    hypervolume: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """One artifact and where it comes from; the path is relative to its trial.

    The lineage names no inputs: there are ``n_inputs``, and `zfcal inspect` shows them.
    """

    path: str
    sha256: str
    lineage: Lineage
    n_inputs: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Integration:
    """How fish-like the robot moves, pooled over the later part of a trial.

    Parameters
    ----------
    start_s, end_s
        The stretch of time that was pooled.
    robot
        The robot against the fish, by feature; empty without a robot. The
        ceiling puts each fish in the robot's place; its ``n`` tells how many.
    halves
        The fish of every other minute against those of the minutes between, by
        feature: a ceiling without a model. Empty where there is too little.
    missing
        Why a part is missing, in sentences.
    """

    start_s: int
    end_s: int
    robot: Mapping[str, Mark] = field(default_factory=dict)
    halves: Mapping[str, float] = field(default_factory=dict)
    missing: Sequence[str] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrialView:
    """All that the report shows of one trial.

    Parameters
    ----------
    root
        The trial's directory.
    trial
        Its settings.
    arena
        Its tank.
    courses
        The scores over time.
    statistics
        The stored counts by window end and case.
    rounds
        The models, the starting one first.
    model_statistics
        What the last calibrated model does in a long simulation; None without
        one, and where it is not shown.
    model_visits
        Where that model's fish are in a long simulation; None as for its statistics.
    seen
        All agents; None without tracks.
    integration
        The robot among the fish.
    sources
        The artifacts that were read.
    rule_scores
        Forward scores of the rules by which models are published, in the order of their windows;
        empty where rules were not judged.
    driven
        How quick the robot was driven, drive by drive; those that are closed.
    following
        Whether fish follow the robot; None where it was not measured.
    left_out
        One line per file that could not be read.
    label
        What it is called among several; empty for the directory's name.
    scoring
        ``paper`` or ``legacy``, as the scores say.
    has_control_trials
        Whether the control group is the fish of other trials.
    published
        Whether the published scores, which are of other fish, are to stand beside its own.
    """

    root: Path
    trial: Trial
    arena: Arena
    courses: Mapping[CourseKey, Course]
    statistics: Mapping[tuple[int, str], Statistics]
    rounds: Sequence[Round]
    model_statistics: Statistics | None
    seen: Seen | None
    integration: Integration
    sources: Sequence[Source]
    model_visits: Visits | None = None
    rule_scores: Sequence[RuleScore] = ()
    driven: tuple[Driven, ...] = ()
    following: Followed | None = None
    left_out: Sequence[str] = ()
    label: str = ""
    scoring: str = "paper"
    has_control_trials: bool = False
    published: bool = False

    @property
    def name(self) -> str:
        """The directory's name, as people call the trial, or its label."""
        return self.label or self.root.resolve().name

    @property
    def made_elsewhere(self) -> frozenset[int]:
        """Ends of windows whose published model was made of another window, in seconds."""
        return frozenset(
            each.second
            for each in self.rounds
            if each.published is not None and each.published.of_s not in {None, each.second}
        )

    @property
    def calibrated(self) -> Round | None:
        """The last round's model; None before the first."""
        return next((r for r in reversed(self.rounds) if r.second > 0), None)

    @property
    def tracked_s(self) -> float:
        """Seconds of the recording up to the last sample; 0 without tracks."""
        return 0.0 if self.seen is None else self.seen.end_s

    def course(self, compared: str, feature: str, zone: str | None = None) -> Course:
        """Return a score over time, empty where there is none."""
        return self.courses.get((compared, feature, zone), NO_COURSE)


def _mean(values: Floats) -> float:
    known = values[~np.isnan(values)]
    return float(known.mean()) if known.size else float("nan")
