"""A trial in the forms of other programs: `zfcal export`."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

from zfcal.artifacts.reading.contents import numbered_of
from zfcal.errors import InputError
from zfcal.stages.events import Tell
from zfcal.stages.export.manifest import SCHEMA, Content, Place, exported
from zfcal.stages.export.options import ExportOptions
from zfcal.stages.export.tables import tables_item
from zfcal.stages.export.tracks import tracks_item
from zfcal.stages.making import run
from zfcal.stages.stage import Item, OneThing, Run
from zfcal.stages.trial_context import Task, open_trial
from zfcal.writers import FORMATS, TABLES
from zfcal.writers.layout import Topics, foxglove_layout

_COMMAND = "export"
_LAYOUT = "layout"


def export(
    root: Path, options: ExportOptions, tell: Tell, *, task: Task | None = None
) -> list[Path]:
    """Write a trial's tracks, and what was made of them, in other forms.

    Parameters
    ----------
    root
        The trial's directory.
    options
        Which forms, and where they go.
    tell
        Hears of every file, of what a form has no place for, and how it is read back.
    task
        How to go about it.

    Returns
    -------
    list of Path
        The files that are there.

    Raises
    ------
    InputError
        There is nothing to export, a format is unknown, or a package that it needs is missing.
    StorageError
        A file cannot be written.
    """
    made = []
    for name in options.formats:
        if name not in {*TABLES, *FORMATS}:
            known = ", ".join((*TABLES, *FORMATS))
            raise InputError(f"Format {name!r} is unknown, expected one of {known}.")
        item = tables_item if name in TABLES else tracks_item
        stage = OneThing(name=_COMMAND, item=partial(item, name=name, options=options))
        made += run(stage, root, tell, task=task)
    if options.layout:
        stage = OneThing(name=_COMMAND, item=partial(_layout_item, options=options))
        made += run(stage, root, tell, task=task)
    return made


def _layout_item(run: Run, options: ExportOptions) -> Item:
    opened = open_trial(run.root)
    topics = _topics(run.root)
    if not topics:
        raise InputError(
            f"{run.root}: has no MCAP files that a layout could show, in frames, poses or drive.",
            hint=f"zfcal track {run.root} writes poses, zfcal drive {run.root} what the robot did.",
        )
    lineage = run.lineage(
        SCHEMA,
        opened.arena_files,
        options={
            "format": _LAYOUT,
            "arena": opened.trial.arena,
            "cameras": list(topics.cameras),
            "poses": topics.has_poses,
            "drive": topics.has_drive,
        },
    )
    x0, y0, x1, y1 = map(float, opened.arena.outline.bounds)
    text = json.dumps(foxglove_layout(topics, (x0, y0, x1, y1)), indent=2) + "\n"
    place = Place(root=run.root, name=_LAYOUT, folder=options.folder)
    files = {"foxglove-layout.json": lambda path, _: path.write_bytes(text.encode())}
    return exported(run, place, lineage, lambda: Content(files=files))


def _topics(root: Path) -> Topics:
    frames = root / "frames"
    folders = sorted(frames.iterdir()) if frames.is_dir() else []
    return Topics(
        cameras=tuple(folder.name for folder in folders if _has_files(folder)),
        has_poses=_has_files(root / "poses"),
        has_drive=_has_files(root / "drive"),
    )


def _has_files(folder: Path) -> bool:
    return folder.is_dir() and bool(numbered_of(folder, ".mcap"))
