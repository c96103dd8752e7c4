"""Whether every artifact of a trial is whole, valid and what its lineage says.

The computer that it lies on is looked at in `machine`.
"""

from __future__ import annotations

import os
import re
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from zfcal.arena import Arena
from zfcal.artifacts.agreement import disagreements
from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.atomic import is_orphan, is_part
from zfcal.artifacts.cameras import read_camera_file
from zfcal.artifacts.findings import ERROR, NOTE, OK, WARNING, Finding
from zfcal.artifacts.lineage import Lineage, package_version, read_lineage
from zfcal.artifacts.machine import check_computer
from zfcal.artifacts.mcap_files import FRESH_S, has_footer, overview
from zfcal.artifacts.models import read_model, read_model_for
from zfcal.artifacts.reading.contents import hash_of, numbered_of
from zfcal.artifacts.reading.opening import open_regular, unreadable
from zfcal.artifacts.reading.places import check_inside, is_regular
from zfcal.artifacts.settings import read_trial
from zfcal.artifacts.tables import (
    FOLLOWING,
    POPULATION,
    RULES,
    SCORES,
    STATS,
    read_table,
    read_tracks,
)
from zfcal.artifacts.validation import check, read_json
from zfcal.errors import DamagedError, InputError, ZfcalError
from zfcal.trial import CONFIG_NAME, LOOP_NAME, NUMBER, Trial, second_of
from zfcal.units import SEGMENT_S

_CLOCK_SLACK_S = 2.0
"""Two computers that share a trial may differ by so much without a warning."""

_CLOSING_S = 1.0
"""A tracker closes a minute once the first frame of the next is written, and sooner than this."""

_NOT_CLOSED = "not closed"
"""So begins what is said of a file that is neither whole nor known to be damaged."""

_FORGOTTEN_S = 3600.0
"""No copy and no write takes so long: a dot-file of that age was left behind."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """What the check of one file needs to know; None for what could not be read.

    `hashes` holds those of the inputs that were looked at, by their path relative to
    the trial; None for one that is no file. The scores of a day name a million.
    """

    root: Path
    now_s: float
    trial: Trial | None
    arena: Arena | None
    hashes: dict[str, str | None] = field(default_factory=dict)

    def hash_of(self, source: str) -> str | None:
        if source not in self.hashes:
            origin = self.root / source
            self.hashes[source] = hash_of(origin) if is_regular(origin) else None
        return self.hashes[source]


def check_trial(root: Path, *, now_s: float | None = None) -> list[Finding]:
    """Check a trial: its settings, every artifact, their lineage, and the computer.

    Parameters
    ----------
    root
        The trial's directory.
    now_s
        Seconds since 1970 to take as now; None for the clock's.

    Returns
    -------
    list of Finding
        The trial is sound if none is of level ``error``.

    Raises
    ------
    InputError
        There is no such folder.
    """
    if not root.is_dir():
        raise InputError(f"{root}: is no folder.", hint="Give the folder of a trial.")
    now_s = time.time() if now_s is None else now_s
    place, findings = _settings(root, now_s)
    counts: Counter[str] = Counter()
    for path in _files(root):
        found = list(_file_findings(place, path))
        findings += found
        if _checker_of(root, path) and not any(map(_is_part, found)):
            counts[path.relative_to(root).parts[0]] += 1
    findings += [
        Finding(level=OK, where=folder, says=f"{count} whole and valid")
        for folder, count in sorted(counts.items())
    ]
    return findings + list(check_computer(root, now_s))


def _is_part(finding: Finding) -> bool:
    """Return whether a finding says that its file is not whole and valid."""
    return finding.level == ERROR or finding.says.startswith(_NOT_CLOSED)


def _settings(root: Path, now_s: float) -> tuple[_Place, list[Finding]]:
    findings: list[Finding] = []
    trial = arena = None
    try:
        trial = read_trial(root)
        arena = load_arena(trial.arena, root)
        findings.append(Finding(level=OK, where=CONFIG_NAME, says=f"arena {arena.name}"))
    except ZfcalError as error:
        where = CONFIG_NAME if trial is None else trial.arena
        findings.append(_mistake(where, root, error))
    if trial is not None:
        findings += [_mistake(CONFIG_NAME, root, problem) for problem in disagreements(trial)]
    if trial is not None and not (root / trial.model).is_file():
        findings.append(
            Finding(
                level=ERROR,
                where=trial.model,
                says="the starting model that trial.toml names is missing",
                hint="Make it with zfcal init, or set model in trial.toml to another one.",
            )
        )
    return _Place(root=root, now_s=now_s, trial=trial, arena=arena), findings


def _mistake(where: str, root: Path, error: ZfcalError) -> Finding:
    says = str(error).removeprefix(f"{root / where}: ").rstrip(".")
    return Finding(level=ERROR, where=where, says=says, hint=error.hint)


def _files(root: Path) -> Iterator[Path]:
    """Yield all files of a trial, sorted by path; a folder whose name starts with a dot is left.

    What is no file, or a folder that cannot be gone through, is yielded as well: to be named.
    """
    for path in sorted(root.iterdir()):
        if not os.path.isdir(path):  # noqa: PTH112 - Path's own raises where one may not look
            yield path
        elif not path.name.startswith("."):
            is_named_as_file = path.suffix in {".parquet", ".mcap", ".toml", ".json"}
            is_folder = _can_be_listed(path) and not is_named_as_file
            yield from _files(path) if is_folder else [path]


def _can_be_listed(folder: Path) -> bool:
    """Return whether a folder lies in the trial, does not lead back, and can be looked into."""
    try:
        check_inside(folder)
        os.listdir(folder)  # noqa: PTH208 - only whether it can be
    except OSError:
        return False
    return folder.resolve() not in map(Path.resolve, folder.parents)


def _file_findings(place: _Place, path: Path) -> Iterator[Finding]:
    name = path.relative_to(place.root).as_posix()
    try:
        open_regular(path).close()
    except OSError as error:
        mistake = unreadable(path, error)
        if not path.name.startswith("."):
            yield _mistake(name, place.root, mistake)
        return
    if path.name.startswith("."):
        yield from _dot_file(place, path, name)
        return
    checker = _checker_of(place.root, path)
    if checker is None:
        yield from _unknown(place, name)
        return
    yield from _clock(place, path, name)
    try:
        yield from checker(place, path)
        yield from _lineage(place, path, name)
    except ZfcalError as error:
        yield _mistake(name, place.root, error)


def _dot_file(place: _Place, path: Path, name: str) -> Iterator[Finding]:
    if path.name.startswith(".lock-"):
        return
    age_s = place.now_s - path.stat().st_mtime
    if is_part(path.name) and (is_orphan(path) or age_s > _FORGOTTEN_S):
        yield Finding(
            level=NOTE,
            where=name,
            says="was left by a command that was killed; nothing reads it",
            hint=f"Remove it: rm '{path}'",
        )
    elif age_s > _FORGOTTEN_S and path.suffix == ".checkpoint":
        says = "a round that was not finished; calibrate goes on from there"
        yield Finding(level=NOTE, where=name, says=says)
    elif age_s > _FORGOTTEN_S:
        yield Finding(level=NOTE, where=name, says="a dot-file that no command of zfcal reads")


def _unknown(place: _Place, name: str) -> Iterator[Finding]:
    folder = name.partition("/")[0]
    named = {CONFIG_NAME, LOOP_NAME}
    if place.trial:
        named |= {place.trial.arena, place.trial.model}
    if place.trial and place.trial.cameras:
        named |= {path for camera in place.trial.cameras.values() for path in camera.values()}
    is_figure = folder == "cameras" and name.endswith(".png")
    if name in named or is_figure or folder in {"diagnosis", "report", "export"}:
        return
    says = "is no artifact of a trial, and no command reads it"
    if re.fullmatch(r"\d{1,5}\D.*", name.rpartition("/")[2]):
        says = "is not read: names have at least six digits"
    yield Finding(level=NOTE, where=name, says=says)


def _clock(place: _Place, path: Path, name: str) -> Iterator[Finding]:
    ahead_s = path.stat().st_mtime - place.now_s
    if not ahead_s <= _CLOCK_SLACK_S:
        yield Finding(
            level=WARNING,
            where=name,
            says=f"was changed {ahead_s:.0f} s in the future",
            hint="The clocks of the computers that share the trial differ: set them by NTP.",
        )


def _form(lineage: Lineage) -> str:
    """Return the option that says which form is exported; empty for other commands."""
    name = lineage.options.get("format")
    if lineage.command != "export":
        return ""
    return " --layout" if name == "layout" else f" --to {name}"


def _lineage(place: _Place, path: Path, name: str) -> Iterator[Finding]:
    """Compare the hashes of the inputs that an artifact states with what lies there."""
    if path.suffix == ".mcap" or path.name == CONFIG_NAME:
        return
    try:
        lineage = read_lineage(path)
    except DamagedError as error:
        # A model may be written by hand.
        level = NOTE if path.suffix == ".toml" else ERROR
        yield Finding(level=level, where=name, says=str(error).removeprefix(f"{path}: "))
        return
    again = f"Make it again with: zfcal {lineage.command} {place.root}{_form(lineage)}"
    for source, sha256 in lineage.inputs.items():
        found = place.hash_of(source)
        if found is None and "/" not in source:
            # What lay outside the trial is known by its bare name, wherever it is now.
            continue
        if found is None:
            yield Finding(level=NOTE, where=name, says=f"its input {source} is gone")
        elif found != sha256:
            says = f"is out of date: its input {source} has changed"
            yield Finding(level=WARNING, where=name, says=says, hint=again)
    if lineage.version != package_version():
        says = f"was made by zfcal {lineage.version}, this is {package_version()}"
        yield Finding(level=NOTE, where=name, says=says)


def _check_tracks(place: _Place, path: Path) -> Iterator[Finding]:
    tracks = read_tracks(path)
    name = path.relative_to(place.root).as_posix()
    start_s = second_of(path) or 0
    outside = (tracks.time_s < start_s - 1e-6) | (tracks.time_s >= start_s + SEGMENT_S - 1e-6)
    if outside.any():
        says = (
            f"holds {np.count_nonzero(outside)} rows outside {start_s} s to "
            f"{start_s + SEGMENT_S:.0f} s, such as {tracks.time_s[np.argmax(outside)]:.3f} s"
        )
        yield Finding(level=WARNING, where=name, says=says, hint="Import or track it again.")
    if len(tracks) == 0:
        yield Finding(level=NOTE, where=name, says="no animal was seen in this segment")
    if place.arena is None or len(tracks) == 0:
        return
    xy_m, _ = place.arena.settle(np.stack([tracks.x_m, tracks.y_m], axis=-1))
    share = np.mean(place.arena.zone_of(xy_m) == 0)
    if share > 0.05:
        yield Finding(
            level=WARNING,
            where=name,
            says=f"{share:.0%} of the positions lie outside arena {place.arena.name}",
            hint="Check the arena in trial.toml, and units, origin and y in the import.",
        )


def _check_model(place: _Place, path: Path) -> Iterator[Finding]:
    if place.trial is None or place.arena is None:
        read_model(path)
    else:
        read_model_for(path, place.arena, dt_s=place.trial.dt_s)
    yield from ()


def _check_mcap(place: _Place, path: Path) -> Iterator[Finding]:
    name = path.relative_to(place.root).as_posix()
    is_fresh = place.now_s - path.stat().st_mtime < FRESH_S
    found = overview(path)
    if found.whole:
        return
    is_closed, n_later = has_footer(path), _n_later(path)
    if is_fresh:
        # It may have been closed while it was read, or is just before that.
        if not is_closed and n_later == 1:
            time.sleep(_CLOSING_S)
        found = overview(path)
    if found.whole:
        return
    if is_closed or n_later or not found.is_cut:
        says = "was cut short" if found.is_cut else f"is damaged: {found.problem}"
        hint = "Copy it again from where it was recorded. Commands read what lies before."
        yield Finding(level=ERROR, where=name, says=f"{says}; {found.loss}", hint=hint)
    elif is_fresh:
        says = f"{_NOT_CLOSED}: still grows, or its writer was stopped"
        yield Finding(level=NOTE, where=name, says=says)
    else:
        says = f"{_NOT_CLOSED}: it was cut short, or its writer was stopped; {found.loss}"
        yield Finding(level=WARNING, where=name, says=says, hint="Commands read what is whole.")


def _n_later(path: Path) -> int:
    """Return how many segments of the same folder follow one."""
    start_s = second_of(path, ".mcap") or 0
    return sum(second > start_s for second in numbered_of(path.parent, ".mcap"))


def _check_camera(_: _Place, path: Path) -> Iterator[Finding]:
    read_camera_file(path)
    yield from ()


def _json_checker(schema: str) -> Callable[[_Place, Path], Iterator[Finding]]:
    def check_document(_: _Place, path: Path) -> Iterator[Finding]:
        check(read_json(path), schema, path)
        yield from ()

    return check_document


def _table_checker(schema: str) -> Callable[[_Place, Path], Iterator[Finding]]:
    def check_table(_: _Place, path: Path) -> Iterator[Finding]:
        read_table(path, schema)
        yield from ()

    return check_table


_CHECKERS: dict[str, Callable[[_Place, Path], Iterator[Finding]]] = {
    rf"tracks/{NUMBER}\.parquet": _check_tracks,
    rf"stats/{NUMBER}-following\.parquet": _table_checker(FOLLOWING),
    rf"stats/{NUMBER}(-[a-z-]+)?\.parquet": _table_checker(STATS),
    rf"scores/{NUMBER}-rules\.parquet": _table_checker(RULES),
    rf"scores/{NUMBER}(-[a-z-]+)?\.parquet": _table_checker(SCORES),
    rf"models/{NUMBER}\.parquet": _table_checker(POPULATION),
    r"models/[^/]+\.toml": _check_model,
    rf"(poses|drive|frames/(overhead|below))/{NUMBER}\.mcap": _check_mcap,
    r"cameras/[^/]+\.toml": _check_camera,
    rf"models/{NUMBER}\.skipped\.json": _json_checker("skipped"),
    r"diagnosis/([^/]+/)?findings\.json": _json_checker("findings"),
    r"export/[a-z]+/export-[a-z]+\.json": _json_checker("export"),
}


def _checker_of(root: Path, path: Path) -> Callable[[_Place, Path], Iterator[Finding]] | None:
    name = path.relative_to(root).as_posix()
    return next((c for pattern, c in _CHECKERS.items() if re.fullmatch(pattern, name)), None)
