"""From track segments to statistics and scores, window by window.

Makes what is missing or stale. The offline run over all windows and the online
run on the newest one are the same code: they differ in `Task.ends_s`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import final

from zfcal.arena import VOID
from zfcal.artifacts.freshness import hash_inputs
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.reading.contents import numbered_of
from zfcal.artifacts.segments import segment_name, segment_path
from zfcal.artifacts.tables import FOLLOWING, make_table, write_table
from zfcal.behaviour.departures import FOLLOW_S
from zfcal.behaviour.features.registry import COUNTED, further, ordered
from zfcal.behaviour.following import RANGE_M
from zfcal.behaviour.influence import influence_to_rows, measure_influence
from zfcal.behaviour.located import Located, join
from zfcal.behaviour.rows import join_tables, statistics_to_rows
from zfcal.errors import InputError
from zfcal.stages.analyse.control import ControlGroup
from zfcal.stages.analyse.scoring import SCORINGS, Window, scores_of
from zfcal.stages.events import Event, LeftOut, Note, Result, Tell
from zfcal.stages.making import run
from zfcal.stages.segments import Pooled, Segments, readable, segment_hashes
from zfcal.stages.stage import Draft, Item, Output, Run, Stage
from zfcal.stages.trial_context import OpenTrial, Task
from zfcal.stages.windows import starts_of, whole_segments, window_ends

_STATS = "zfcal.stats/1"
_SCORES = "zfcal.scores/1"

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
class _Shared:
    """All that the windows of one run share."""

    run: Run
    opened: OpenTrial
    options: AnalyseOptions
    control: ControlGroup | None
    segments: Segments
    whole: tuple[int, ...]

    @property
    def root(self) -> Path:
        return self.run.root

    @property
    def is_pooled(self) -> bool:
        """Whether the robot is judged, over more than the window itself."""
        return self.opened.trial.n_robots > 0 and self.options.scoring == "paper"

    def stats_lineage(self, hashes: dict[int, str]) -> Lineage:
        # Statistics of before there were further ones stay up to date.
        names = self.options.further
        return self._lineage(_STATS, hashes, {"features": list(names)} if names else {})

    def scores_lineage(self, hashes: dict[int, str]) -> Lineage:
        return self._lineage(_SCORES, hashes, {"scoring": self.options.scoring})

    def following_lineage(self, hashes: dict[int, str]) -> Lineage:
        """Return that of what the robot does to the fish: the control bears on nothing of it."""
        inputs = {segment_name(start): digest for start, digest in hashes.items()}
        inputs |= hash_inputs(self.root, self.opened.arena_files)
        options = {**self.opened.clock_options, "range_m": RANGE_M, "follow_s": FOLLOW_S}
        return Lineage(schema=FOLLOWING, command=self.run.command, options=options, inputs=inputs)

    def _lineage(self, schema: str, hashes: dict[int, str], more: dict[str, JSON]) -> Lineage:
        inputs = {segment_name(start): digest for start, digest in hashes.items()}
        inputs |= hash_inputs(self.root, self.opened.arena_files)
        options: dict[str, JSON] = {**self.opened.clock_options, **more}
        # Without a robot there is no social case; with one the number of them does not matter.
        options["robot"] = self.opened.trial.n_robots > 0
        if self.control is not None:
            inputs |= self.control.inputs
            options["control"] = self.control.options
        return Lineage(schema=schema, command=self.run.command, options=options, inputs=inputs)


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
    run(Analyse(options=options, segments=segments or Segments()), root, tell, task=task)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Analyse(Stage[_Shared, int]):
    """Statistics and scores of each window, by the second at which it ends.

    Parameters
    ----------
    options
        What bears on the numbers.
    segments
        Reads the tracks.
    """

    name = "analyse"
    scores_tracks = True
    counted = "analyse"

    options: AnalyseOptions = field(default_factory=AnalyseOptions)
    segments: Segments = field(default_factory=Segments)

    def open(self, run: Run) -> _Shared:
        """Read the trial and its control group, and see which segments there are."""
        opened = self.segments.open(run.root)
        return _Shared(
            run=run,
            opened=opened,
            options=self.options,
            control=ControlGroup.read(opened, self.options.control, self.segments, run.tell),
            segments=self.segments,
            whole=_readable_segments(opened, run.tell),
        )

    def items(self, shared: _Shared) -> list[int]:
        """Return the ends of the windows that are asked for."""
        known = window_ends(shared.opened.trial, shared.run.tell, list(shared.whole))
        _tell_oddities(shared, known)
        return [end for end in known if shared.run.task.wants(end)]

    def place(self, shared: _Shared, key: int) -> Path:
        """Return the window's scores."""
        return shared.opened.trial.path("scores", key, ".parquet")

    def item(self, shared: _Shared, key: int) -> Item:
        """Return a window."""
        return _window(shared, key)


def _readable_segments(opened: OpenTrial, tell: Tell) -> tuple[int, ...]:
    """Return the starts of the whole segments, save those that are no files."""
    starts = {
        segment_path(opened.trial.root, start): start for start in whole_segments(opened.trial)
    }
    return tuple(starts[path] for path in readable(starts, tell))


def _tell_oddities(shared: _Shared, ends: list[int]) -> None:
    """Say where there is nothing to do yet, and which statistics have lost their tracks."""
    run = shared.run
    if run.task.ends_s is not None:
        return
    tracks, n = run.root / "tracks", len(shared.whole)
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


def _window(shared: _Shared, end_s: int) -> Item:
    hashes = segment_hashes(shared.root, _pooled_starts(shared, end_s))
    own = {start: hashes[start] for start in starts_of(end_s)}
    path_of = shared.opened.trial.path
    stats = Output(path=path_of("stats", end_s, ".parquet"), lineage=shared.stats_lineage(own))
    scores = Output(
        path=path_of("scores", end_s, ".parquet"), lineage=shared.scores_lineage(hashes)
    )

    following = Output(
        path=path_of("stats", end_s, "-following.parquet"), lineage=shared.following_lineage(own)
    )
    has_robot = shared.opened.trial.n_robots > 0

    def compute() -> Iterator[Draft]:
        tell, segments = shared.run.tell, shared.segments
        pooled = segments.pool(shared.opened, hashes, tell) if shared.is_pooled else None
        found = _read(shared, list(own), pooled)
        gone = [Path(segment_name(start)).name for start in own if start not in found]
        if gone:
            what = f"{stats.path}: the window that ends at {end_s} s"
            tell(LeftOut(path=stats.path, problem=f"{what} needs tracks/{', '.join(gone)}."))
            return
        # A damaged segment is no input: what is pooled without it holds until it is mended.
        problems = {} if pooled is None else pooled.problems
        sound = {start: digest for start, digest in hashes.items() if start not in problems}
        window = Window(
            end_s=end_s,
            points=join([found[start] for start in own]),
            pool=None if pooled is None else pooled.pool,
            has_robot=has_robot,
            control=shared.control,
            further=shared.options.further,
        )
        yield Draft(output=stats, write=partial(_write_stats, shared, window))
        if has_robot:
            yield Draft(output=following, write=partial(_write_following, window))
        yield Draft(
            output=replace(scores, lineage=shared.scores_lineage(sound)),
            write=partial(_write_scores, shared, window, pooled_from_s=next(iter(sound))),
        )

    outputs = [stats, *([following] if has_robot else []), scores]
    return Item(outputs=outputs, compute=compute, apart=True)


def _pooled_starts(shared: _Shared, end_s: int) -> list[int]:
    """Return the segments over which the robot is judged; of a young trial the window's own."""
    own = list(starts_of(end_s))
    if not shared.is_pooled:
        return own
    first = min(POOLED_FROM_S, own[0])
    return [start for start in shared.whole if first <= start < end_s]


def _read(shared: _Shared, starts: list[int], pooled: Pooled | None) -> dict[int, Located]:
    """Return a window's segments, save the damaged ones; what the pool has told is not told."""
    opened, segments = shared.opened, shared.segments
    if pooled is not None:
        sound = [start for start in starts if start not in pooled.problems]
        return {start: segments.read(opened, start) for start in sound}
    found = {start: segments.read_or_tell(opened, start, shared.run.tell) for start in starts}
    return {start: located for start, located in found.items() if located is not None}


def _write_stats(shared: _Shared, window: Window, path: Path, lineage: Lineage) -> list[Event]:
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
    write_table(path, make_table(_STATS, rows), lineage, extra=extra)
    return _void_notes(shared, window)


def _write_scores(
    shared: _Shared, window: Window, path: Path, lineage: Lineage, *, pooled_from_s: int
) -> list[Event]:
    rows = scores_of(window, shared.options.scoring)
    extra: dict[str, JSON] = {"robot_pooled_from_s": pooled_from_s}
    write_table(path, make_table(_SCORES, rows), lineage, extra=extra)
    columns = (rows[name] for name in ("compared", "feature", "value", "ceiling"))
    return [
        Result(
            value={
                "window_end_s": window.end_s,
                "compared": compared,
                "S": value,
                "ceiling": ceiling,
            }
        )
        for compared, feature, value, ceiling in zip(*columns, strict=True)
        if feature == "S"
    ]


def _write_following(window: Window, path: Path, lineage: Lineage) -> None:
    rows = influence_to_rows(measure_influence(window.points), window_end_s=window.end_s)
    write_table(path, make_table(FOLLOWING, rows), lineage)


def _void_notes(shared: _Shared, window: Window) -> list[Event]:
    share = float((window.points.zone == VOID).mean()) if len(window.points) else 0.0
    if not share > _VOID_SHARE:
        return []
    text = (
        f"{shared.root}: {share:.1%} of the positions of the window that ends at "
        f"{window.end_s} s lie outside the arena and do not count."
    )
    return [Note(text=text, warning=True)]
