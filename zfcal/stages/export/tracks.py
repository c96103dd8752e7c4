"""The tracks of a trial in the format of another program."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from zfcal.artifacts.lineage import JSON, Lineage, read_lineage
from zfcal.errors import DamagedError, InputError
from zfcal.stages.events import Event, LeftOut
from zfcal.stages.export.manifest import SCHEMA, Content, Place, exported
from zfcal.stages.export.options import ExportOptions
from zfcal.stages.segments import readable, segment_files
from zfcal.stages.stage import Item, Run
from zfcal.stages.track_window import read_stretch
from zfcal.stages.trial_context import OpenTrial, open_trial
from zfcal.writers import FORMATS, Axes, Image, dense, export_files, image_of_import, lost
from zfcal.writers.losses import lost_noise, noise_option
from zfcal.writers.source import Write


def tracks_item(run: Run, name: str, options: ExportOptions) -> Item:
    """Return the export of a trial's tracks.

    Parameters
    ----------
    run
        On which trial.
    name
        A key of `zfcal.writers.FORMATS`.
    options
        Where it goes, and the scale.

    Raises
    ------
    InputError
        There are no tracks.
    """
    opened = open_trial(run.root)
    files = readable(segment_files(run.root, None), run.tell)
    image = _image(opened, files, options)
    chosen = FORMATS[name]
    axes = chosen.axes(image, scaled=options.is_scaled)
    place = Place(root=run.root, name=name, folder=options.folder, reads=chosen.reads)
    told: dict[str, JSON] = {
        "format": name,
        "fps": opened.trial.fps,
        "unit": axes.unit,
        "m_per_unit": axes.m_per_unit,
        "origin": list(axes.origin),
        "flip_y": axes.y_down,
        "m_per_px": image.axes("px").m_per_unit if name == "trex" else None,
    }
    lineage = run.lineage(SCHEMA, files, options=told)
    return exported(run, place, lineage, lambda: _content(opened, name, axes, image))


def _content(opened: OpenTrial, name: str, axes: Axes, image: Image) -> Content:
    left_out: list[str] = []

    def hear(event: Event) -> None:
        if isinstance(event, LeftOut):
            left_out.append(event.problem)

    stretch = read_stretch(opened, None, hear)
    found = dense(stretch.tracks, opened.trial.fps)
    files = export_files(name, found, axes, image)
    noise = noise_option(stretch.noise_m)
    return Content(
        files={file: partial(_alone, write) for file, write in files.items()},
        lost=(*lost(found, FORMATS[name].holds), *lost_noise(stretch.noise_m)),
        read_back=("--format", name, *axes.as_options(), *noise),
        left_out=tuple(left_out),
    )


def _alone(write: Write, path: Path, _: Lineage) -> None:
    """Write a file of a form that has no place for lineage."""
    write(path)


def _image(opened: OpenTrial, files: list[Path], options: ExportOptions) -> Image:
    """Return how the tank lies in an image: as asked for, as it was imported, or by its walls.

    Without any word on it the upper left corner of the tank's outline is that of the image.
    """
    x0, _, _, y1 = opened.arena.outline.bounds
    known = _imported(files) or Image(origin_m=(-float(x0), float(y1)))
    m_per_px = options.m_per_px or known.m_per_px
    if options.origin_px is None:
        return Image(m_per_px=m_per_px, origin_m=known.origin_m, y_down=known.y_down)
    scale = Image(m_per_px=m_per_px, origin_m=(0.0, 0.0)).axes("px").m_per_unit
    x, y = options.origin_px
    return Image(m_per_px=m_per_px, origin_m=(x * scale, y * scale))


def _imported(files: list[Path]) -> Image | None:
    for path in files:
        try:
            found = read_lineage(path)
        except (DamagedError, InputError):
            continue
        return image_of_import(found.options) if found.command == "import" else None
    return None
