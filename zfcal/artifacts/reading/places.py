"""Where the files of a trial may lie: inside it, whatever symbolic links say.

A link below the trial's root that leads outside is neither read nor written through.
The root itself may be reached by a link, and what a person names may lie anywhere.
What files hold is the business of others; nothing is opened here.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from shlex import quote

from zfcal.trial import CONFIG_NAME, second_of

_FOLDERS = {
    *("tracks", "stats", "scores", "models", "poses", "cameras"),
    *("drive", "diagnosis", "report"),
}
"""Folders of a trial whose files are found by their place; the others' are named by people."""

KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a named pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}
"""What may stand where a regular file is expected."""


def check_inside(path: Path | str) -> None:
    """Refuse a path that a symbolic link leads out of the trial in which it lies.

    Parameters
    ----------
    path
        A file or a folder, which need not be there. One that lies in no trial is not
        refused. Of trials within trials each holds what lies below it.

    Raises
    ------
    OSError
        It leads outside, and by which link.
    """
    out = _way_out(path)
    if out is not None:
        root, link, real = out
        is_itself = link == os.path.abspath(path)  # noqa: PTH100 - as a text, beside others
        named = "" if is_itself else f" by the link {os.path.relpath(link, root)}"
        text = f"it leads outside the trial{named}, to {real}"
        raise OSError(errno.EXDEV, text, str(path))


def way_back(path: Path) -> str:
    """Return what to do about a path that a link leads outside, with the commands for it."""
    out = _way_out(path)
    if out is None:
        return "Put the file itself there."
    root, link, real = out
    target, place = quote(os.path.realpath(link)), quote(link)
    if not os.path.exists(link):  # noqa: PTH110 - as above
        return f"Nothing lies there, maybe its disk is not mounted; remove the link: rm {place}."
    if os.path.isdir(link):  # noqa: PTH112 - as above
        mount = f"rm {place}; mkdir {place}; mount --bind {target} {place}"
        ways = f"put the files there, or mount their folder: {mount}."
    else:
        ways = f"put the file itself there: cp --remove-destination {target} {place}."
    inside = Path(os.path.abspath(path)).relative_to(root)  # noqa: PTH100 - as above
    named = _named(inside, Path(real), Path(root))
    return f"{named} Or {ways}" if named else ways[0].upper() + ways[1:]


def _named(inside: Path, real: Path, root: Path) -> str:
    """Return how to name what may lie anywhere; empty for what must lie in the trial."""
    folder = inside.parts[0]
    if folder == "frames":
        camera = inside.parts[1] if len(inside.parts) > 1 else "overhead"
        source = real.parent if real.is_file() else real
        source = source / camera if inside.name == folder else source
        words = f"zfcal track {quote(str(root))} --{camera} {quote(str(source))}"
        return f"Name the images where they lie: {words}."
    is_own = folder in _FOLDERS or inside.suffix in {".toml", ".geojson"}
    return "" if is_own else f"Name it where it lies: {quote(str(real))}."


def _way_out(path: Path | str) -> tuple[str, str, str] | None:
    """Return the trial that a path leads out of, the link that does it, and where to."""
    place, real = os.path.abspath(path), os.path.realpath(path)  # noqa: PTH100 - asked so often
    if real == place:
        return None
    for root in _trials_above(place):
        within = os.path.realpath(root)
        if real != within and not real.startswith(within.rstrip(os.sep) + os.sep):
            return root, _first_link(root, place), real
    return None


def is_regular(path: Path) -> bool:
    """Return whether a regular file can be looked at there; no name and no link is an error."""
    try:
        return stat.S_ISREG(path.stat().st_mode)
    except (OSError, ValueError):
        return False


def numbered(folder: Path, ending: str) -> dict[int, Path]:
    """Return the artifacts of a folder by their number, in order, whatever they turn out to be.

    Parameters
    ----------
    folder
        One of a trial. One that is not there, or no folder, holds none.
    ending
        What follows the number, such as ``.parquet``.

    Raises
    ------
    OSError
        The folder leads outside its trial, or cannot be listed.
    """
    check_inside(folder)
    try:
        names = os.listdir(folder)  # noqa: PTH208 - asked so often that a Path each would cost
    except (FileNotFoundError, NotADirectoryError):
        return {}
    found = ((second_of(path, ending), path) for path in (folder / name for name in names))
    return dict(sorted((second, path) for second, path in found if second is not None))


def _trials_above(place: str) -> list[str]:
    """Return the folders with settings, from the path itself upwards."""
    folders = [place, *map(str, Path(place).parents)]
    return [each for each in folders if os.path.lexists(os.path.join(each, CONFIG_NAME))]  # noqa: PTH118 - as above


def _first_link(root: str, place: str) -> str:
    """Return the first symbolic link on the way from a trial's root to a path."""
    way = root
    for part in Path(os.path.relpath(place, root)).parts:
        way = os.path.join(way, part)  # noqa: PTH118 - as above
        if os.path.islink(way):  # noqa: PTH114 - as above
            return way
    return place
