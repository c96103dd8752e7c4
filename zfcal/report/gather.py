"""Read a trial's artifacts into what the report draws from.

A file that is damaged is left out and named; the rest is still shown.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import starmap
from pathlib import Path
from typing import Any

import numpy as np

from zfcal.arena import Arena
from zfcal.artifacts.agreement import check_agreement
from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.freshness import hash_inputs, relative_to
from zfcal.artifacts.lineage import Lineage, read_lineage
from zfcal.artifacts.models import read_model_for, read_result
from zfcal.artifacts.reading.contents import numbered_of
from zfcal.artifacts.reading.opening import open_regular
from zfcal.artifacts.segments import read_segment, segment_path, segment_starts
from zfcal.artifacts.settings import read_trial
from zfcal.artifacts.tables import FOLLOWING, RULES, SCORES, STATS, read_extra, read_table
from zfcal.behaviour.features.registry import statistics
from zfcal.behaviour.located import Located, locate
from zfcal.behaviour.rows import statistics_from_rows
from zfcal.behaviour.statistics import Statistics
from zfcal.errors import DamagedError, InputError
from zfcal.parameters import Parameters
from zfcal.report.driven import closed_drives, driven_of
from zfcal.report.followed import Followed, followed_from
from zfcal.report.integration import measure_integration
from zfcal.report.seen import Seen, Visits, see
from zfcal.report.views import (
    Course,
    CourseKey,
    Mark,
    Published,
    Round,
    RuleScore,
    Source,
    TrialView,
)
from zfcal.tracks import FISH
from zfcal.trial import Trial

Damage = Callable[[DamagedError], None]
Watch = Callable[[Located], None]

_POOLED_KEY = "robot_pooled_from_s"
"""Extra metadata of the scores: from when on the robot is judged."""

_KEY_COLUMNS = ("compared", "feature", "zone")
_NUMBER_COLUMNS = ("window_end_s", "value", "low", "high", "ceiling", "n_windows")
_ENDINGS = (
    ("tracks", ".parquet"),
    ("stats", ".parquet"),
    ("stats", "-following.parquet"),
    ("scores", ".parquet"),
    ("scores", "-model.parquet"),
    ("scores", "-rules.parquet"),
    ("models", ".toml"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Reader:
    """Reads the files of one trial and notes those that cannot be read."""

    trial: Trial
    arena: Arena
    on_damage: Damage
    damaged: dict[Path, str] = field(default_factory=dict)

    def attempt(self, path: Path, read: Callable[[Path], Any]) -> Any:
        """Return what a reader returns; None, and a note, where the file is damaged."""
        if path in self.damaged:
            return None
        try:
            return read(path)
        except (DamagedError, InputError) as error:
            # The same text wherever the trial lies.
            self.damaged[path] = str(error).replace(f"{self.trial.root}/", "")
            self.on_damage(DamagedError(str(error), hint=error.hint))
            return None

    def files(self, folder: str, ending: str) -> list[tuple[int, Path]]:
        """Return the artifacts of a folder by their second, in order."""
        return list(numbered_of(self.trial.root / folder, ending).items())


def input_files(root: Path) -> list[Path]:
    """Return the files of a trial that bear on its report: settings, arena and artifacts.

    Parameters
    ----------
    root
        The trial's directory.

    Raises
    ------
    InputError
        It is no trial.
    """
    trial = read_trial(root)
    reader = _Reader(trial=trial, arena=load_arena(trial.arena, root), on_damage=_ignore)
    own_arena = root / trial.arena
    files = [trial.config, *([own_arena] if own_arena.is_file() else [])]
    for folder, ending in _ENDINGS:
        # What is no file is no input: it is named where it is read.
        files += [path for _, path in reader.files(folder, ending) if _can_be_opened(path)]
    return [*files, *closed_drives(root).values()]


def _can_be_opened(path: Path) -> bool:
    try:
        open_regular(path).close()
    except OSError:
        return False
    return True


def gather(
    root: Path, on_damage: Damage, *, alone: bool = True, watch: Watch | None = None
) -> TrialView:
    """Read all that the report shows of a trial.

    Parameters
    ----------
    root
        The trial's directory.
    on_damage
        Hears of each file that is left out.
    alone
        Whether the report is of this trial alone; one of several shows nothing of
        what the models do, which is then not simulated.
    watch
        Is shown where everybody was, segment by segment, so that tracks are read once.

    Raises
    ------
    InputError
        It is no trial, its settings or arena are wrong, or its tracks are of other agents than it
        states.
    """
    trial = read_trial(root)
    check_agreement(trial)
    arena = load_arena(trial.arena, root)
    reader = _Reader(trial=trial, arena=arena, on_damage=on_damage)
    courses, scored = _courses(reader)
    rounds = [
        r for second, path in reader.files("models", ".toml") if (r := _round(reader, second, path))
    ]
    calibrated = next((r for r in reversed(rounds) if r.second > 0), None)
    seen = see(_stretches(reader, watch))
    start_s = _pooled_from(reader)
    counted = _statistics(reader, None if calibrated is None else calibrated.second)
    return TrialView(
        root=root,
        trial=trial,
        arena=arena,
        courses=courses,
        statistics=counted,
        rounds=rounds,
        model_statistics=_simulated(calibrated, trial, arena, counted) if alone else None,
        model_visits=_model_visits(calibrated, trial, arena, seen) if alone else None,
        seen=seen,
        integration=measure_integration(
            courses, seen, has_robot=trial.n_robots > 0, start_s=start_s
        ),
        following=_followed(reader, start_s),
        sources=list(_sources(reader)),
        rule_scores=_rule_scores(reader),
        driven=tuple(filter(None, starmap(driven_of, closed_drives(root).items()))),
        left_out=list(reader.damaged.values()),
        scoring=str(scored.get("scoring", "paper")),
        has_control_trials="control" in scored,
    )


def _simulated(
    calibrated: Round | None,
    trial: Trial,
    arena: Arena,
    counted: Mapping[tuple[int, str], Statistics],
) -> Statistics | None:
    if calibrated is None:
        return None
    # It brings the compiler along, which takes longer than the simulation.
    from zfcal.report.simulated import long_run

    # What the fish's window holds and is known here, so that both can be laid over each other.
    fish = counted.get((calibrated.second, "control"))
    names = () if fish is None else [name for name in fish.further if name in statistics()]
    return long_run(calibrated, trial, arena, further=names)


def _model_visits(
    calibrated: Round | None, trial: Trial, arena: Arena, seen: Seen | None
) -> Visits | None:
    if calibrated is None or seen is None or FISH not in seen.visits:
        return None
    from zfcal.report.simulated import long_visits

    return long_visits(calibrated, trial, arena)


def _courses(reader: _Reader) -> tuple[dict[CourseKey, Course], dict[str, Any]]:
    """Return the scores over time, and the options of the newest scores of analyse."""
    rows: dict[CourseKey, list[tuple[Any, ...]]] = {}
    options: dict[str, Any] = {}
    for ending in (".parquet", "-model.parquet"):
        for _, path in reader.files("scores", ending):
            table = reader.attempt(path, lambda p: read_table(p, SCORES))
            if table is None:
                continue
            if ending == ".parquet":
                options = dict(read_lineage(path).options)
            names = _KEY_COLUMNS + _NUMBER_COLUMNS
            for compared, feature, zone, *numbers in zip(
                *(table.column(name).to_pylist() for name in names), strict=True
            ):
                rows.setdefault((compared, feature, zone), []).append(tuple(numbers))
    return {key: _course(found) for key, found in rows.items()}, options


def _course(rows: list[tuple[Any, ...]]) -> Course:
    ordered = sorted(rows, key=lambda row: int(row[0]))
    end_s = np.array([row[0] for row in ordered], dtype=np.int64)
    value, low, high, ceiling = (
        np.array([np.nan if row[i] is None else row[i] for row in ordered], dtype=np.float64)
        for i in range(1, 5)
    )
    n = np.array([row[5] or 0 for row in ordered], dtype=np.int64)
    return Course(end_s=end_s, value=value, low=low, high=high, ceiling=ceiling, n=n)


def _statistics(reader: _Reader, second: int | None) -> dict[tuple[int, str], Statistics]:
    """Return the statistics of one window by case; of the last that can be read without it."""
    files = reader.files("stats", ".parquet")
    for _, path in sorted(files, key=lambda file: (file[0] == second, file[0]), reverse=True):
        found = reader.attempt(
            path, lambda p: statistics_from_rows(read_table(p, STATS).to_pydict())
        )
        if found is not None:
            names = reader.arena.zone_names
            return {key: counts for key, counts in found.items() if counts.zone_names == names}
    return {}


def _round(reader: _Reader, second: int, path: Path) -> Round | None:
    arena, dt_s = reader.arena, reader.trial.dt_s
    model = reader.attempt(path, lambda p: read_model_for(p, arena, dt_s=dt_s))
    return None if model is None else round_of(second, model, read_result(path))


def round_of(second: int, model: Parameters, result: Mapping[str, Any]) -> Round:
    """Return the round that made a model.

    Parameters
    ----------
    second
        Second at which its window ends; 0 for the starting model.
    model
        The model.
    result
        What its file says of the calibration; may be empty.
    """
    said = result.get("intervals", {}).get("parameters", {})
    score, names = _named(result.get("score"))
    known = {name: row for name, row in said.items() if {"low", "high", "identified"} <= row.keys()}
    return Round(
        second=second,
        parameters=model,
        intervals={name: (float(row["low"]), float(row["high"])) for name, row in known.items()},
        unidentified=frozenset(name for name, row in known.items() if not row["identified"]),
        intervals_by=str(result.get("intervals", {}).get("by", "score")),
        published=_published(result.get("published")),
        score=score,
        score_of=names,
        hypervolume=_numbers(result.get("hypervolume")),
    )


def _numbers(said: Any) -> tuple[float, ...]:
    """Return a list of finite numbers as it is; nothing where it is another thing."""
    if not isinstance(said, list) or not all(isinstance(each, int | float) for each in said):
        return ()
    found = tuple(map(float, said))
    return found if all(map(math.isfinite, found)) else ()


def _published(said: Any) -> Published | None:
    """Return why a model was published; None where its file does not say."""
    if not isinstance(said, dict) or "rule" not in said:
        return None
    of_s = said.get("of_window_end_s")
    return Published(
        rule=str(said["rule"]),
        because=str(said.get("because", "")),
        of_s=of_s if isinstance(of_s, int) else None,
    )


def _rule_scores(reader: _Reader) -> tuple[RuleScore, ...]:
    """Return the forward scores of all rules: the newest record that can be read has them all."""
    for _, path in reversed(reader.files("scores", "-rules.parquet")):
        table = reader.attempt(path, lambda p: read_table(p, RULES))
        if table is not None:
            return tuple(map(_rule_score, table.to_pylist()))
    return ()


def _rule_score(row: Mapping[str, Any]) -> RuleScore:
    value, low, high = (
        float("nan") if row[key] is None else float(row[key]) for key in ("S", "low", "high")
    )
    return RuleScore(
        rule=row["rule"],
        end_s=row["window_end_s"],
        made_at_s=row["made_at_s"],
        score=Mark(value=value, low=low, high=high),
    )


def _followed(reader: _Reader, start_s: int) -> Followed | None:
    """Return whether fish follow the robot, over the windows whose file can be read."""
    rows: list[Mapping[str, Any]] = []
    for _, path in reader.files("stats", "-following.parquet"):
        table = reader.attempt(path, lambda p: read_table(p, FOLLOWING))
        rows += [] if table is None else table.to_pylist()
    return followed_from(rows, start_s=start_s)


def _named(said: Any) -> tuple[Mark | None, tuple[str, ...]]:
    """Return the score of named statistics that a model's result holds, and their names."""
    if not isinstance(said, dict) or "value" not in said:
        return None, ()
    value, low, high, ceiling = (
        float("nan") if said.get(key) is None else float(said[key])
        for key in ("value", "ceiling_low", "ceiling_high", "ceiling")
    )
    return Mark(value=value, low=low, high=high, ceiling=ceiling), tuple(said.get("of", ()))


def _stretches(reader: _Reader, watch: Watch | None) -> Iterator[Located]:
    """Yield where everybody was, for each segment that can be read."""
    trial = reader.trial
    for start_s in segment_starts(trial.root):
        path = segment_path(trial.root, start_s)
        read = reader.attempt(path, lambda p: read_segment(trial, int(p.stem)))
        if read is not None:
            located = locate(read[1], reader.arena)
            if watch is not None:
                watch(located)
            yield located


def _pooled_from(reader: _Reader) -> int:
    """Return from when on the newest scores judge the robot; 0 where they do not say."""
    for _, path in reversed(reader.files("scores", ".parquet")):
        extra = reader.attempt(path, read_extra)
        if extra is not None:
            value = extra.get(_POOLED_KEY)
            return value if isinstance(value, int) else 0
    return 0


def _sources(reader: _Reader) -> Iterator[Source]:
    root = reader.trial.root
    files = [path for folder, ending in _ENDINGS for _, path in reader.files(folder, ending)]
    for path in [*files, *closed_drives(root).values()]:
        lineage = reader.attempt(path, read_lineage)
        if isinstance(lineage, Lineage):
            (digest,) = hash_inputs(root, [path]).values()
            # Of a day's recording the inputs of all scores would be a million.
            yield Source(
                path=relative_to(root, path),
                sha256=digest,
                lineage=replace(lineage, inputs={}),
                n_inputs=len(lineage.inputs),
            )


def _ignore(_: DamagedError) -> None:
    """Leave it to `gather`, which reads the files, to say what is damaged."""
