"""The cameras of a run: which images, and where their pixels lie in the tank."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zfcal.arena import Arena
from zfcal.artifacts.freshness import hash_inputs
from zfcal.cameras.calibration import homography_from_corners
from zfcal.cameras.camera import Projection
from zfcal.cameras.handedness import check_corners, check_side, seen_from
from zfcal.cameras.live import ArrivalClock
from zfcal.cameras.stamps import SAME_RATE, Shot, Source, check_rate, with_rate
from zfcal.cameras.video import is_live
from zfcal.errors import InputError
from zfcal.stages.camera.cameras import read_camera, stated_side
from zfcal.stages.camera.making import usual_side
from zfcal.stages.camera.sources import files_of, source_of
from zfcal.stages.trial_context import OpenTrial

OVERHEAD, BELOW = "overhead", "below"

_SAY = {
    OVERHEAD: "say --seen-from below, if it looks up through the floor.",
    BELOW: "say --below-seen-from above, if it looks down on the tank.",
}
_UNSAY = {
    OVERHEAD: "leave --seen-from out, if it looks down on the tank.",
    BELOW: "leave --below-seen-from out, if it looks up through the floor.",
}

_LIVE_RATE = 0.1
"""Arrival times of a dozen images tell a rate no better than that."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraChoice:
    """What a person says of one camera.

    Parameters
    ----------
    source
        A file, a folder, a pattern, a camera; None for that of ``trial.toml``, or the
        images in the trial's own ``frames/``.
    file
        Its calibration; None for that of ``trial.toml``.
    corners_px
        Pixels of the arena's four corners, in place of a calibration.
    side
        From where it looks: ``above`` or ``below``; None for what its file or its name says.
    """

    source: str | None = None
    file: Path | None = None
    corners_px: tuple[tuple[float, float], ...] | None = None
    side: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """One camera of a run, its files not opened yet.

    Parameters
    ----------
    name
        ``overhead`` or ``below``.
    source
        As `zfcal.stages.camera.sources.source_of` takes it.
    file
        Its calibration; None with corners.
    corners_px
        In place of a calibration.
    side
        From where it looks, as it was stated; None for what its file or its name says.
    or_usual
        Whether what was stated may be meant of the other camera: then it may as well look from
        where its name says.
    """

    name: str
    source: str
    file: Path | None
    corners_px: tuple[tuple[float, float], ...] | None
    side: str | None = None
    or_usual: bool = False

    @property
    def is_live(self) -> bool:
        """Whether it is a camera and no recording."""
        return is_live(self.source)

    def hashes(self, root: Path) -> dict[str, str]:
        """Return the hashes of its files, as lineage states them."""
        found = files_of(root, self.source)
        if self.file is not None:
            found |= hash_inputs(root, [self.file])
        return found

    def projection(self, arena: Arena, size_px: tuple[int, int]) -> Projection:
        """Return where its pixels lie.

        Parameters
        ----------
        arena
            Whose corners the corners are.
        size_px
            Of its images.

        Raises
        ------
        InputError
            The calibration is that of images of another size, or sees the tank from the wrong
            side; or the corners make none.
        """
        if self.file is None:
            corners = np.array(self.corners_px, np.float64)
            found = homography_from_corners(corners, arena.outline.bounds, size_px)
            side = self._stated(found) or usual_side(self.name)
            check_corners(found, corners, side)
            return found
        camera = read_camera(self.file)
        if camera.size_px != size_px:
            has, got = (f"{w} x {h} px" for w, h in (camera.size_px, size_px))
            raise InputError(
                f"{self.file}: is of a camera with images of {has}, those of {self.source} are "
                f"{got}: it is the calibration of another camera, or of another setting.",
                hint=f"Calibrate it with zfcal camera, or give its file with {_option(self)}.",
            )
        check_view(camera, self.file, self.name, arena, side=self._stated(camera))
        return camera

    def _stated(self, camera: Projection) -> str | None:
        usual = usual_side(self.name)
        return usual if self.or_usual and seen_from(camera) == usual else self.side


def check_view(
    camera: Projection, file: Path, name: str, arena: Arena, *, side: str | None = None
) -> None:
    """Refuse a camera file by which the tank is mirrored and should not be, or the reverse.

    Parameters
    ----------
    camera
        What the file holds.
    file
        It, for the message and for the side that its lineage states.
    name
        ``overhead`` or ``below``.
    arena
        The tank.
    side
        From where it looks, as it was stated; None for what the file or the name says.

    Raises
    ------
    InputError
        It looks from the other side.
    """
    expected = side or stated_side(file) or usual_side(name)
    again = f"zfcal camera corners or points, --camera {name}, says what is wrong"
    other = _SAY[name] if expected == usual_side(name) else _UNSAY[name]
    x, y = arena.outline.centroid.coords[0]
    check_side(
        camera,
        expected,
        what=f"{file}, as the camera {name}",
        near_px=camera.to_pixels(np.array([x, y])),
        hint=f"Tracks would be mirror images. Calibrate it again: {again}. Or {other}",
    )


def _option(view: View) -> str:
    return "--camera" if view.name == OVERHEAD else "--below-camera"


def view_of(opened: OpenTrial, name: str, choice: CameraChoice) -> View | None:
    """Return a camera as it was asked for, or as ``trial.toml`` has it; None if neither does.

    Raises
    ------
    InputError
        There is a source and nothing that says where its pixels lie, or both a file
        and corners were given.
    """
    trial = opened.trial
    known = (trial.cameras or {}).get(name, {})
    source = (
        choice.source or _placed(trial.root, known.get("source")) or _recorded(trial.root, name)
    )
    if source is None:
        return None
    if choice.file is not None and choice.corners_px is not None:
        raise InputError("--camera and --corners both say where pixels lie: give one of them.")
    file = choice.file
    if file is None and choice.corners_px is None and known.get("file"):
        file = trial.root / known["file"]
    if file is None and choice.corners_px is None:
        raise InputError(
            f"{trial.config}: names no calibration of the {name} camera, so its pixels cannot be "
            "converted to metres.",
            hint=f"Calibrate it with zfcal camera and set [cameras.{name}] file; or give "
            f"{'--camera FILE or --corners' if name == OVERHEAD else '--below-camera FILE'}.",
        )
    return View(name=name, source=source, file=file, corners_px=choice.corners_px, side=choice.side)


def _placed(root: Path, source: str | None) -> str | None:
    """Return a source of ``trial.toml``, whose paths are relative to the trial."""
    if not source:
        return None
    return source if is_live(source) else str(root / source)


def _recorded(root: Path, name: str) -> str | None:
    """Return the folder of a trial's own camera images; None if there are none."""
    folder = root / "frames" / name
    return str(folder) if any(folder.glob("*.mcap")) else None


@dataclass(slots=True, kw_only=True)
class Feed:
    """An opened camera: its images, their size, and where their pixels lie.

    Parameters
    ----------
    source
        For its notes and problems.
    shots
        Every image, from the first.
    size_px
        Width and height of the first.
    projection
        Where pixels lie.
    """

    source: Source
    shots: Iterator[Shot]
    size_px: tuple[int, int]
    projection: Projection


def open_feed(opened: OpenTrial, view: View, clock: ArrivalClock) -> Feed:
    """Open a camera and look at its first image.

    Raises
    ------
    InputError
        There is no image, the frame rate is not the trial's, or the calibration is that
        of another camera.
    """
    fps = opened.trial.fps
    source = source_of(view.source, fps=fps, clock=clock)
    if source.rate_hz is not None:
        check_rate(source.rate_hz, fps=fps, name=source.name)
    tolerance = _LIVE_RATE if source.is_live else SAME_RATE
    shots = with_rate(source.shots(), fps=fps, name=source.name, tolerance=tolerance)
    first = next(shots, None)
    if first is None:
        raise InputError(f"{source.name}: no image can be read.", hint="See whether it plays.")
    size_px = first.image.shape[1], first.image.shape[0]
    return Feed(
        source=source,
        shots=itertools.chain([first], shots),
        size_px=size_px,
        projection=view.projection(opened.arena, size_px),
    )
