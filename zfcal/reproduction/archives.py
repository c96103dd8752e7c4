"""From an archive to a trial beside it: the archive itself is only read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from zfcal.artifacts.atomic import write_bytes_whole
from zfcal.artifacts.reading.opening import read_limited
from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.artifacts.settings import read_trial
from zfcal.errors import InputError
from zfcal.stages.events import Made, Note, Planned, Tell
from zfcal.stages.import_ import Source, import_tracks
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.trial_context import Task, open_trial
from zfcal.trial import CONFIG_NAME


@dataclass(frozen=True, slots=True, kw_only=True)
class Archives:
    """Which archives there are, and what their files do not tell.

    Parameters
    ----------
    paths
        Trial directories, and files or folders of other programs.
    new
        The trials that are made of other programs' files; None where there are none. The seed of
        the k-th archive is k more than its own.
    format
        A key of `zfcal.readers.FORMATS`; None to go by each file's looks.
    options
        Of the import.
    """

    paths: tuple[Path, ...]
    new: NewTrial | None = None
    format: str | None = None
    options: dict[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        names = [name_of(path) for path in self.paths]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise InputError(
                f"Two archives are called {twice[0]!r}, which would be one trial.",
                hint="Rename one of them: each gets a directory of its name.",
            )


def name_of(path: Path) -> str:
    """Return what the trial of an archive is called: the directory, or the file without endings."""
    place = path.absolute()
    return place.name if place.is_dir() else place.name.split(".", 1)[0]


def bring_in(archives: Archives, folder: Path, tell: Tell, *, task: Task) -> list[Path]:
    """Return the trials of all archives, made where they are missing or changed.

    Parameters
    ----------
    archives
        What there is.
    folder
        Gets a directory for each.
    tell
        Hears of every file.
    task
        How.

    Raises
    ------
    InputError
        A path is neither, or what its import needs is not said.
    """
    return [_trial_of(archives, k, folder, tell, task) for k in range(len(archives.paths))]


def _trial_of(archives: Archives, k: int, folder: Path, tell: Tell, task: Task) -> Path:
    path = archives.paths[k]
    root = folder / name_of(path)
    if not path.exists():
        raise InputError(f"{path}: no such archive.", hint="Check the path, and where you stand.")
    if root.absolute().is_relative_to(path.absolute()):
        raise InputError(
            f"{root}: lies in the archive {path}, which is only read.",
            hint="Say where the trials go with -o DIR.",
        )
    if (path / CONFIG_NAME).is_file():
        copy_trial(path, root, tell, task=task)
        return root
    if archives.new is None:
        raise InputError(
            f"{path}: is not a trial, and its tank is not known.",
            hint="Say --arena, --fish, --robots and --fps for the tracks of another program.",
        )
    new = replace(archives.new, seed=archives.new.seed + k, source=path.name)
    create_trial(root, new, tell, task=task)
    if task.dry_run and not (root / CONFIG_NAME).exists():
        tell(Note(text=f"{path}: is imported into {root / 'tracks'} after that."))
        return root
    source = Source(path=path, format=archives.format, options=archives.options)
    import_tracks(root, source, tell, task=task)
    return root


def copy_trial(
    source: Path,
    root: Path,
    tell: Tell,
    *,
    model: Path | None = None,
    task: Task | None = None,
) -> None:
    """Copy what a trial begins with: settings, arena, starting model and tracks.

    What is there with the same content stays, so that what was made of it is up to date.

    Parameters
    ----------
    source, root
        From and to.
    tell
        Hears of each file that is written.
    model
        Another starting model than the trial's own.
    task
        How; whatever is asked for, the same content is not written again.

    Raises
    ------
    InputError
        The trial is wrong, or has no tracks.
    """
    opened, trial = open_trial(source), read_trial(source)
    tracks = [segment_path(source, start) for start in segment_starts(source)]
    if not tracks:
        raise InputError(
            f"{source}: holds no tracks.", hint=f"First: zfcal track {source}, or zfcal import"
        )
    parts: Sequence[tuple[Path, Path]] = [
        *((path, root / path.relative_to(source)) for path in opened.arena_files),
        (model or source / trial.model, root / trial.model),
        *((path, root / path.relative_to(source)) for path in tracks),
        # Last, since a directory is a trial from here on.
        (trial.config, root / CONFIG_NAME),
    ]
    for origin, place in parts:
        content = read_limited(origin)
        if place.is_file() and read_limited(place) == content:
            continue
        if task is not None and task.dry_run:
            reason = "differs from the archive" if place.exists() else "missing"
            tell(Planned(path=place, reason=reason))
            continue
        write_bytes_whole(place, content)
        tell(Made(path=place, reason="copied from the archive"))
