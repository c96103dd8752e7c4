"""One page and its pictures: what a trial, or several, have shown.

The page holds its figures, so that it can be sent by itself. The same inputs
give the same bytes: nothing of the day or the machine is in it.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from urllib.parse import quote

from zfcal.artifacts.atomic import storage_error, write_bytes_whole, write_text_whole, write_whole
from zfcal.artifacts.freshness import hash_inputs, stale_reason
from zfcal.artifacts.lineage import JSON, Lineage, read_lineage
from zfcal.artifacts.reading.contents import sha256_of
from zfcal.artifacts.validation import check, read_json
from zfcal.errors import DamagedError, InputError
from zfcal.report.figures.panels import Picture
from zfcal.report.figures.printing import write_printed
from zfcal.report.gather import Damage, gather, input_files
from zfcal.report.integration import SCHEMA, integration_document
from zfcal.report.intervals import intervals_csv
from zfcal.report.labels import labels_of
from zfcal.report.options import (
    AS_USUAL,
    FILMS,
    FORMATS,
    Printing,
    ReportOptions,
    report_options_of,
)
from zfcal.report.pictures import pictures_of_trial, pictures_of_trials
from zfcal.report.render import render_page
from zfcal.report.seen import Seen
from zfcal.report.views import Round, TrialView

_FOLDER = "report"
PAGE = "index.html"
_NUMBERS = "integration.json"
_TABLE = "intervals.csv"
_ENDINGS = (".csv", *(f".{kind}" for kind in (*FORMATS, *FILMS)))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """Where a report goes, and the folder to which its lineage's paths are relative."""

    folder: Path
    base: Path


def write_report(
    roots: Sequence[Path],
    out_dir: Path | None = None,
    *,
    how: ReportOptions = AS_USUAL,
    on_damage: Damage | None = None,
) -> list[Path]:
    """Write the report of a trial, or one over several trials.

    Parameters
    ----------
    roots
        The trials' directories.
    out_dir
        Where the report goes; None for ``report/`` in the trial. Several
        trials need one.
    how
        What it shows, and in which form.
    on_damage
        Hears of each file that is damaged and left out.

    Returns
    -------
    list of Path
        The page, the pictures, of several trials the table of their intervals, and the
        numbers of integration, which come last:
        whoever finds these finds the others too.

    Raises
    ------
    InputError
        One is no trial, or there are several and ``out_dir`` is missing.
    StorageError
        The disk is full, or the place cannot be written.
    """
    place = _place(roots, out_dir)
    lineage = _lineage(roots, place, how)
    views, pictures = _shown(roots, how, on_damage)
    to_film = None if how.film is None else _to_film(views)
    written = []
    for picture in pictures:
        for kind in how.printing.formats:
            path = place.folder / f"{picture.name}.{kind}"
            write_whole(path, partial(_draw, picture, kind, how.printing))
            written.append(path)
    if to_film is not None:
        film = place.folder / f"film.{how.film}"
        write_bytes_whole(film, _film(*to_film, str(how.film)))
        written.append(film)
    if len(views) > 1:
        write_text_whole(place.folder / _TABLE, intervals_csv(views))
        written.append(place.folder / _TABLE)
    page = place.folder / PAGE
    links = _links(roots, place.folder) if len(views) > 1 else []
    write_text_whole(page, render_page(views, pictures, lineage, how.printing.formats, links))
    written.append(page)
    numbers = place.folder / _NUMBERS
    _remove_outdated(place.folder, {path.name for path in written})
    document = integration_document(views, lineage, _hashes(written))
    check(document, "integration", numbers)
    write_text_whole(numbers, json.dumps(document, indent=2, ensure_ascii=False) + "\n")
    return [page, *written[:-1], numbers]


def report_plan(
    roots: Sequence[Path],
    out_dir: Path | None = None,
    *,
    how: ReportOptions = AS_USUAL,
    on_damage: Damage | None = None,
) -> list[Path]:
    """Return the files that `write_report` would return; nothing is written.

    Parameters
    ----------
    roots, out_dir, how, on_damage
        As for `write_report`.

    Raises
    ------
    InputError
        As `write_report`.
    """
    folder = _place(roots, out_dir).folder
    views, pictures = _shown(roots, how, on_damage)
    names = [f"{each.name}.{kind}" for each in pictures for kind in how.printing.formats]
    if how.film is not None:
        _to_film(views)
        names.append(f"film.{how.film}")
    table = [_TABLE] if len(views) > 1 else []
    return [folder / name for name in (PAGE, *names, *table, _NUMBERS)]


def _shown(
    roots: Sequence[Path], how: ReportOptions, on_damage: Damage | None
) -> tuple[list[TrialView], list[Picture]]:
    """Return what is known of the trials, and the pictures of it."""
    views = [
        replace(
            gather(root, on_damage or _ignore, alone=len(roots) == 1),
            label=label,
            published=how.published,
        )
        for root, label in zip(roots, labels_of(roots), strict=True)
    ]
    _check_one_arena(views)
    return views, pictures_of_trial(views[0]) if len(views) == 1 else pictures_of_trials(views)


def report_reason(
    roots: Sequence[Path], out_dir: Path | None = None, how: ReportOptions = AS_USUAL
) -> str | None:
    """Return why a report must be made; None if it is up to date.

    Parameters
    ----------
    roots, out_dir, how
        As for `write_report`.

    Returns
    -------
    str or None
        One line, such as ``missing`` or ``input scores/000180.parquet is new``.
    """
    place = _place(roots, out_dir)
    numbers = place.folder / _NUMBERS
    reason = stale_reason([numbers], _lineage(roots, place, how))
    if reason is not None:
        return reason
    for name, digest in read_json(numbers)["files"].items():
        path = place.folder / name
        if not path.is_file():
            return f"{name} is missing"
        if sha256_of(path) != digest:
            return f"{name} was changed"
    return None


def report_options(root: Path) -> ReportOptions | None:
    """Return how the report of a trial was made; None if there is none, or it is damaged."""
    try:
        return report_options_of(read_lineage(root / _FOLDER / _NUMBERS).options)
    except (DamagedError, InputError):
        return None


def report_files(roots: Sequence[Path], out_dir: Path | None = None) -> list[Path]:
    """Return the files of a report that is up to date, the page first."""
    place = _place(roots, out_dir)
    names = list(read_json(place.folder / _NUMBERS)["files"])
    ordered = [PAGE, *(name for name in names if name != PAGE), _NUMBERS]
    return [place.folder / name for name in ordered]


def report_left_out(roots: Sequence[Path], out_dir: Path | None = None) -> list[str]:
    """Return what a report that is up to date leaves out since it is damaged, a line each."""
    trials = read_json(_place(roots, out_dir).folder / _NUMBERS)["trials"]
    return [
        f"{root}: {line}"
        for root, trial in zip(roots, trials, strict=True)
        for line in trial.get("left_out", [])
    ]


def _place(roots: Sequence[Path], out_dir: Path | None) -> _Place:
    if not roots:
        raise InputError("A report needs at least one trial.")
    if len(roots) == 1:
        folder = out_dir if out_dir is not None else roots[0] / _FOLDER
        return _Place(folder=folder, base=roots[0])
    if out_dir is None:
        raise InputError(
            f"A report over {len(roots)} trials belongs to no single one: it needs a folder.",
            hint="Say where it goes: zfcal report TRIAL... --out FOLDER",
        )
    if len({root.resolve() for root in roots}) < len(roots):
        raise InputError("The same trial is named twice: it would count twice in every mean.")
    return _Place(folder=out_dir, base=out_dir)


def _links(roots: Sequence[Path], folder: Path) -> list[str]:
    """Return where each trial's own page is, as a page in a folder names it."""
    pages = [root.resolve() / _FOLDER / PAGE for root in roots]
    try:
        ways = [os.path.relpath(page, folder.resolve()) for page in pages]
    except ValueError:
        # On another drive, where a system has drives.
        return []
    return [quote(Path(way).as_posix()) for way in ways]


def _lineage(roots: Sequence[Path], place: _Place, how: ReportOptions) -> Lineage:
    files = [path for root in roots for path in input_files(root)]
    # The order of the trials bears on the order of the tables.
    names: list[JSON] = [*labels_of(roots)]
    return Lineage(
        schema=SCHEMA,
        command="report",
        options={"trials": names, **how.as_lineage()},
        inputs=hash_inputs(place.base, files),
    )


def _check_one_arena(views: Sequence[TrialView]) -> None:
    for view in views[1:]:
        if view.arena.zone_names != views[0].arena.zone_names:
            raise InputError(
                f"{view.root} has the zones {', '.join(view.arena.zone_names)}, {views[0].root} "
                f"has {', '.join(views[0].arena.zone_names)}.",
                hint="Only trials in the same arena make one figure; report them apart.",
            )


def _film(view: TrialView, calibrated: Round, seen: Seen, kind: str) -> bytes:
    # OpenCV, and the compiler, are for films alone.
    from zfcal.report.figures import theme
    from zfcal.report.film import Side, film_of
    from zfcal.report.simulated import window_run

    model = window_run(calibrated, view.trial, view.arena)
    measured = Side(title="Measured, last window", colour=theme.FISH, located=seen.last)
    return film_of(
        (measured, Side(title="Model, simulated", colour=theme.MODEL, located=model)), kind
    )


def _to_film(views: Sequence[TrialView]) -> tuple[TrialView, Round, Seen]:
    """Return the trial that is to be filmed, its model and its tracks."""
    view, calibrated = views[0], views[0].calibrated
    if len(views) > 1:
        raise InputError(
            f"A film is of one trial, got {len(views)}.",
            hint="Make a report of each, with its film.",
        )
    if calibrated is None or view.seen is None or not view.seen.n_points:
        raise InputError(
            f"{view.root}: a film shows the tracks beside the calibrated model, and there is none.",
            hint=f"Make them first: zfcal calibrate {view.name}",
        )
    return view, calibrated, view.seen


def _draw(picture: Picture, kind: str, printing: Printing, path: Path) -> None:
    write_printed(picture, kind, path, printing)


def _remove_outdated(folder: Path, made: set[str]) -> None:
    """Remove pictures of the last report that this one has not: they would pass for current."""
    try:
        before = read_json(folder / _NUMBERS).get("files", {})
    except (DamagedError, InputError):
        return
    for name in set(before) - made:
        if Path(name).name == name and name.endswith(_ENDINGS):
            try:
                (folder / name).unlink(missing_ok=True)
            except OSError as error:
                raise storage_error(folder / name, error) from error


def _hashes(paths: Sequence[Path]) -> dict[str, str]:
    return {path.name: sha256_of(path) for path in sorted(paths)}


def _ignore(_: DamagedError) -> None:
    """Leave it to the page to name what is damaged."""
