"""From track segments to statistics and scores, window by window.

Makes what is missing or stale. The offline run over all windows and the online
run on the newest one are the same code: they differ in `Task.ends_s`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from zfcal.arena import VOID
from zfcal.artifacts.freshness import hash_inputs, stale_reason
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.tables import make_table, write_table
from zfcal.behaviour.located import Located, join
from zfcal.behaviour.rows import join_tables, statistics_to_rows
from zfcal.errors import InputError
from zfcal.online.control import ControlGroup
from zfcal.online.events import LeftOut, Made, Note, Progress, Result, Tell
from zfcal.online.opening import OpenTrial, Task, at_work, reason_to_make
from zfcal.online.scoring import SCORINGS, Window, scores_of
from zfcal.online.segments import Segments, segment_path
from zfcal.online.windows import starts_of, whole_segments, window_ends
from zfcal.trial import second_of

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
    """

    scoring: str = "paper"
    control: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        if self.scoring not in SCORINGS:
            raise InputError(
                f"No scoring is called {self.scoring!r}, expected one of {', '.join(SCORINGS)}."
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Run:
    """All that the windows of one run share."""

    opened: OpenTrial
    options: AnalyseOptions
    control: ControlGroup | None
    task: Task
    tell: Tell
    segments: Segments

    @property
    def root(self) -> Path:
        return self.opened.trial.root

    def stats_lineage(self, starts: list[int]) -> Lineage:
        return self._lineage(STATS, starts, {})

    def scores_lineage(self, starts: list[int]) -> Lineage:
        return self._lineage(SCORES, starts, {"scoring": self.options.scoring})

    def _lineage(self, schema: str, starts: list[int], more: dict[str, JSON]) -> Lineage:
        files = [*(segment_path(self.root, start) for start in starts), *self.opened.arena_files]
        options: dict[str, JSON] = {**self.opened.clock_options, **more}
        # Without a robot there is no social case; with one the number of them does not matter.
        options["robot"] = self.opened.trial.n_robots > 0
        if self.control is not None:
            files += self.control.files
            options["control"] = self.control.options
        inputs = hash_inputs(self.root, files)
        return Lineage(schema=schema, command="analyse", options=options, inputs=inputs)


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
    task, segments = task or Task(), segments or Segments()
    opened = segments.open(root)
    with at_work(root, "analyse", task):
        control = ControlGroup.read(opened, options.control, segments, tell)
        run = _Run(
            opened=opened,
            options=options,
            control=control,
            task=task,
            tell=tell,
            segments=segments,
        )
        known = window_ends(opened.trial, tell)
        _tell_oddities(run, known)
        ends = [end for end in known if task.wants(end)]
        for number, end in enumerate(ends, start=1):
            _make_window(run, end)
            tell(Progress(stage="analyse", done=number, total=len(ends)))


def _tell_oddities(run: _Run, ends: list[int]) -> None:
    """Say where there is nothing to do yet, and which statistics have lost their tracks."""
    if run.task.ends_s is not None:
        return
    tracks, n = run.root / "tracks", len(whole_segments(run.opened.trial))
    if not ends:
        text = f"{tracks}: {n} whole segments of 60 s, and a window needs two; nothing to analyse."
        run.tell(Note(text=text))
    found = {second_of(path) for path in (run.root / "stats").glob("*.parquet")}
    for end in sorted(found.difference(ends, {None}), key=str):
        path = run.root / "stats" / f"{end:06d}.parquet"
        text = (
            f"{path}: {tracks} holds no whole window to {end} s any more; remove it if it is old."
        )
        run.tell(Note(text=text, warning=True))


def _make_window(run: _Run, end_s: int) -> None:
    trial = run.opened.trial
    stats, scores = (trial.path(folder, end_s, ".parquet") for folder in ("stats", "scores"))
    own, pooled = list(starts_of(end_s)), _pooled_starts(run, end_s)
    if not run.task.force and not _is_stale(run, (stats, own), (scores, pooled)):
        reason_to_make(stats, run.stats_lineage(own), run.task, run.tell)
        reason_to_make(scores, run.scores_lineage(pooled), run.task, run.tell)
        return
    found = _read(run, sorted({*own, *pooled}))
    gone = [segment_path(run.root, start).name for start in own if start not in found]
    if gone:
        problem = f"{stats}: the window that ends at {end_s} s needs tracks/{', '.join(gone)}."
        run.tell(LeftOut(path=stats, problem=problem))
        return
    window = Window(
        end_s=end_s,
        points=join([found[start] for start in own]),
        # A damaged segment is no input: what is pooled without it holds until it is mended.
        pool=join([found[start] for start in pooled if start in found]),
        has_robot=trial.n_robots > 0,
        control=run.control,
    )
    _write_stats(run, stats, window, own)
    _write_scores(run, scores, window, [start for start in pooled if start in found])


def _is_stale(run: _Run, stats: tuple[Path, list[int]], scores: tuple[Path, list[int]]) -> bool:
    made = ((stats, run.stats_lineage), (scores, run.scores_lineage))
    return any(stale_reason([path], lineage(starts)) for (path, starts), lineage in made)


def _pooled_starts(run: _Run, end_s: int) -> list[int]:
    """Return the segments over which the robot is judged; of a young trial the window's own."""
    own = list(starts_of(end_s))
    if not run.opened.trial.n_robots or run.options.scoring != "paper":
        return own
    first = min(POOLED_FROM_S, own[0])
    return [start for start in whole_segments(run.opened.trial) if first <= start < end_s]


def _read(run: _Run, starts: list[int]) -> dict[int, Located]:
    found = {start: run.segments.read_or_tell(run.opened, start, run.tell) for start in starts}
    return {start: located for start, located in found.items() if located is not None}


def _write_stats(run: _Run, path: Path, window: Window, starts: list[int]) -> None:
    lineage = run.stats_lineage(starts)
    reason = reason_to_make(path, lineage, run.task, run.tell)
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
    write_table(path, make_table(STATS, rows), lineage, extra=extra)
    run.tell(Made(path=path, reason=reason))
    _tell_void(run, window)


def _write_scores(run: _Run, path: Path, window: Window, starts: list[int]) -> None:
    lineage = run.scores_lineage(starts)
    reason = reason_to_make(path, lineage, run.task, run.tell)
    if not reason:
        return
    rows = scores_of(window, run.options.scoring)
    extra: dict[str, JSON] = {"robot_pooled_from_s": starts[0]}
    write_table(path, make_table(SCORES, rows), lineage, extra=extra)
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
