"""From track segments to statistics and scores, window by window.

Makes what is missing or stale. The offline run over all windows and the online
run on the newest one are the same code: they differ in `Task.ends_s`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from zfcal.arena import VOID
from zfcal.artifacts.freshness import hash_inputs, stale_reason
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.reading.contents import numbered_of
from zfcal.artifacts.settings import read_trial
from zfcal.artifacts.tables import make_table, write_table
from zfcal.behaviour.features.registry import COUNTED, further, ordered
from zfcal.behaviour.located import Located, join
from zfcal.behaviour.rows import join_tables, statistics_to_rows
from zfcal.errors import InputError
from zfcal.stages.analyse.control import ControlGroup
from zfcal.stages.analyse.scoring import SCORINGS, Window, scores_of
from zfcal.stages.events import LeftOut, Made, Note, Progress, Result, Tell
from zfcal.stages.opening import OpenTrial, Task, at_work, tell_reason
from zfcal.stages.segments import (
    Pooled,
    Segments,
    readable,
    segment_hashes,
    segment_name,
    segment_path,
)
from zfcal.stages.settled import Items
from zfcal.stages.taken import unless_taken
from zfcal.stages.windows import starts_of, whole_segments, window_ends

STATS = "zfcal.stats/1"
SCORES = "zfcal.scores/1"

POOLED_FROM_S = 300
"""The robot is judged from here on: the first minutes are getting used to it."""

_VOID_SHARE = 0.01
"""More positions than this outside the tank are worth a warning."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AnalyseOptions:
    """What bears on the numbers.

    Parameters
    ----------
    scoring
        ``paper``, or ``legacy`` for the authors' published scripts.
    control
        Robot-free trials whose fish, pooled, are the control group; empty for
        the trial's own fish, window by window.
    features
        Statistics to count; D, W, O, T and V are counted in any case.
    """

    scoring: str = "paper"
    control: tuple[Path, ...] = ()
    features: tuple[str, ...] = COUNTED

    def __post_init__(self) -> None:
        if self.scoring not in SCORINGS:
            raise InputError(
                f"No scoring is called {self.scoring!r}, expected one of {', '.join(SCORINGS)}."
            )
        object.__setattr__(self, "features", ordered([*COUNTED, *self.features]))

    @property
    def further(self) -> tuple[str, ...]:
        """What is counted beside D, W, O, T and V."""
        return further(self.features)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Run:
    """All that the windows of one run share."""

    opened: OpenTrial
    options: AnalyseOptions
    control: ControlGroup | None
    task: Task
    tell: Tell
    segments: Segments
    whole: tuple[int, ...]

    @property
    def root(self) -> Path:
        return self.opened.trial.root

    def stats_lineage(self, hashes: dict[int, str]) -> Lineage:
        # Statistics of before there were further ones stay up to date.
        names = self.options.further
        return self._lineage(STATS, hashes, {"features": list(names)} if names else {})

    def scores_lineage(self, hashes: dict[int, str]) -> Lineage:
        return self._lineage(SCORES, hashes, {"scoring": self.options.scoring})

    def _lineage(self, schema: str, hashes: dict[int, str], more: dict[str, JSON]) -> Lineage:
        inputs = {segment_name(start): digest for start, digest in hashes.items()}
        inputs |= hash_inputs(self.root, self.opened.arena_files)
        options: dict[str, JSON] = {**self.opened.clock_options, **more}
        # Without a robot there is no social case; with one the number of them does not matter.
        options["robot"] = self.opened.trial.n_robots > 0
        if self.control is not None:
            inputs |= self.control.inputs
            options["control"] = self.control.options
        return Lineage(schema=schema, command="analyse", options=options, inputs=inputs)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Output:
    """An artifact that a window has, and why it is to be made; None if it is up to date."""

    path: Path
    lineage: Lineage
    reason: str | None

    @classmethod
    def of(cls, path: Path, lineage: Lineage) -> _Output:
        return cls(path=path, lineage=lineage, reason=stale_reason([path], lineage))


def analyse(
    root: Path,
    options: AnalyseOptions,
    tell: Tell,
    *,
    task: Task | None = None,
    segments: Segments | None = None,
) -> None:
    """Make the statistics and scores of a trial's windows.

    Parameters
    ----------
    root
        The trial's directory.
    options
        What bears on the numbers.
    tell
        Hears of every artifact, of what is left out, and of progress.
    task
        Which windows, and how.
    segments
        What was read before, for callers that come again.

    Raises
    ------
    ZfcalError
        The trial or its arena is wrong, the disk is full, or another analyse is
        at work on the trial. Damaged segments are left out and told instead.
    """
    task, known_segments = task or Task(), segments or Segments()

    def open_run() -> _Run:
        opened = known_segments.open(root)
        return _Run(
            opened=opened,
            options=options,
            control=ControlGroup.read(opened, options.control, known_segments, tell),
            task=task,
            tell=tell,
            segments=known_segments,
            whole=_readable_segments(opened, tell),
        )

    # First: where there is no trial no lock is to lie.
    read_trial(root)
    with at_work(root, "analyse", task):
        items = Items(open_run, tell)
        known = window_ends(items.run.opened.trial, tell, list(items.run.whole))
        _tell_oddities(items.run, known)
        ends = [end for end in known if task.wants(end)]
        for number, end in enumerate(ends, start=1):
            path = items.run.opened.trial.path("scores", end, ".parquet")
            items.make(path, partial(_make_window, end_s=end))
            tell(Progress(stage="analyse", done=number, total=len(ends)))


def _readable_segments(opened: OpenTrial, tell: Tell) -> tuple[int, ...]:
    """Return the starts of the whole segments, save those that are no files."""
    starts = {
        segment_path(opened.trial.root, start): start for start in whole_segments(opened.trial)
    }
    return tuple(starts[path] for path in readable(starts, tell))


def _tell_oddities(run: _Run, ends: list[int]) -> None:
    """Say where there is nothing to do yet, and which statistics have lost their tracks."""
    if run.task.ends_s is not None:
        return
    tracks, n = run.root / "tracks", len(run.whole)
    if not ends:
        text = f"{tracks}: {n} whole segments of 60 s, and a window needs two; nothing to analyse."
        run.tell(Note(text=text))
    found = numbered_of(run.root / "stats", ".parquet").keys()
    for end in sorted(found - set(ends)):
        path = run.root / "stats" / f"{end:06d}.parquet"
        text = (
            f"{path}: {tracks} holds no whole window to {end} s any more; remove it if it is old."
        )
        run.tell(Note(text=text, warning=True))


def _make_window(run: _Run, end_s: int) -> None:
    trial = run.opened.trial
    hashes = segment_hashes(run.root, _pooled_starts(run, end_s))
    own = {start: hashes[start] for start in starts_of(end_s)}
    stats = _Output.of(trial.path("stats", end_s, ".parquet"), run.stats_lineage(own))
    scores = _Output.of(trial.path("scores", end_s, ".parquet"), run.scores_lineage(hashes))
    if not run.task.force and stats.reason is None and scores.reason is None:
        _reason(run, stats)
        _reason(run, scores)
        return
    pooled = run.segments.pool(run.opened, hashes, run.tell) if _is_pooled(run) else None
    found = _read(run, list(own), pooled)
    gone = [Path(segment_name(start)).name for start in own if start not in found]
    if gone:
        problem = f"{stats.path}: the window that ends at {end_s} s needs tracks/{', '.join(gone)}."
        run.tell(LeftOut(path=stats.path, problem=problem))
        return
    if pooled is not None and pooled.problems:
        # A damaged segment is no input: what is pooled without it holds until it is mended.
        hashes = {s: digest for s, digest in hashes.items() if s not in pooled.problems}
        scores = _Output.of(scores.path, run.scores_lineage(hashes))
    window = Window(
        end_s=end_s,
        points=join([found[start] for start in own]),
        pool=None if pooled is None else pooled.pool,
        has_robot=trial.n_robots > 0,
        control=run.control,
        further=run.options.further,
    )
    with unless_taken(stats.path, run.tell):
        _write_stats(run, stats, window)
    with unless_taken(scores.path, run.tell):
        _write_scores(run, scores, window, next(iter(hashes)))


def _reason(run: _Run, output: _Output) -> str | None:
    return tell_reason(output.path, output.lineage, run.task, run.tell, reason=output.reason)


def _is_pooled(run: _Run) -> bool:
    """Return whether the robot is judged, over more than the window itself."""
    return run.opened.trial.n_robots > 0 and run.options.scoring == "paper"


def _pooled_starts(run: _Run, end_s: int) -> list[int]:
    """Return the segments over which the robot is judged; of a young trial the window's own."""
    own = list(starts_of(end_s))
    if not _is_pooled(run):
        return own
    first = min(POOLED_FROM_S, own[0])
    return [start for start in run.whole if first <= start < end_s]


def _read(run: _Run, starts: list[int], pooled: Pooled | None) -> dict[int, Located]:
    """Return a window's segments, save the damaged ones; what the pool has told is not told."""
    if pooled is not None:
        sound = [start for start in starts if start not in pooled.problems]
        return {start: run.segments.read(run.opened, start) for start in sound}
    found = {start: run.segments.read_or_tell(run.opened, start, run.tell) for start in starts}
    return {start: located for start, located in found.items() if located is not None}


def _write_stats(run: _Run, output: _Output, window: Window) -> None:
    path, reason = output.path, _reason(run, output)
    if not reason:
        return
    cases = window.cases
    rows = join_tables(
        [
            statistics_to_rows(counts, window_end_s=window.end_s, case=case)
            for case, counts in cases.items()
        ]
    )
    extra: dict[str, JSON] = {
        "n_settled": {case: counts.n_settled for case, counts in cases.items()},
        "n_void": {case: counts.n_void for case, counts in cases.items()},
    }
    write_table(path, make_table(STATS, rows), output.lineage, extra=extra)
    run.tell(Made(path=path, reason=reason))
    _tell_void(run, window)


def _write_scores(run: _Run, output: _Output, window: Window, pooled_from_s: int) -> None:
    path, reason = output.path, _reason(run, output)
    if not reason:
        return
    rows = scores_of(window, run.options.scoring)
    extra: dict[str, JSON] = {"robot_pooled_from_s": pooled_from_s}
    write_table(path, make_table(SCORES, rows), output.lineage, extra=extra)
    run.tell(Made(path=path, reason=reason))
    for compared, feature, value, ceiling in zip(
        *(rows[name] for name in ("compared", "feature", "value", "ceiling")), strict=True
    ):
        if feature == "S":
            value_of = {"window_end_s": window.end_s, "compared": compared}
            run.tell(Result(value={**value_of, "S": value, "ceiling": ceiling}))


def _tell_void(run: _Run, window: Window) -> None:
    share = float((window.points.zone == VOID).mean()) if len(window.points) else 0.0
    if share > _VOID_SHARE:
        run.tell(
            Note(
                text=f"{run.root}: {share:.1%} of the positions of the window that ends at "
                f"{window.end_s} s lie outside the arena and do not count.",
                warning=True,
            )
        )
