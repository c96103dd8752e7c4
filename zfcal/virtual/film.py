"""Camera images of a simulated trial: its tracks as the rig's two cameras would have seen them.

The tracks are the truth of the images: each body's silhouette has its centroid at the
position of its row.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import final

import cv2

from zfcal.artifacts.atomic import check_free, write_whole
from zfcal.artifacts.cameras import SCHEMA as CAMERA
from zfcal.artifacts.frame_files import FRAMES, FrameWriter, frame_segments
from zfcal.artifacts.freshness import hash_inputs
from zfcal.artifacts.images import read_image
from zfcal.artifacts.lineage import JSON, Lineage, read_lineage
from zfcal.artifacts.reading.contents import hash_of
from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.artifacts.settings import name_camera, read_trial
from zfcal.artifacts.tables import read_tracks
from zfcal.cameras.camera import Camera, Homography
from zfcal.cameras.frames import Image
from zfcal.cameras.rig import below_camera, overhead_camera
from zfcal.errors import DamagedError, InputError
from zfcal.stages.camera.cameras import calibration_of, read_camera, write_camera
from zfcal.stages.camera.rig import BELOW, OVERHEAD
from zfcal.stages.events import Made, Note, Planned, Progress, Tell
from zfcal.stages.making import settled
from zfcal.stages.recording import remove_surplus
from zfcal.stages.segments import STEP_S
from zfcal.stages.taken import unless_taken
from zfcal.stages.trial_context import OpenTrial, Task, at_work, open_trial, reason_to_make
from zfcal.tracks import Tracks, concatenate
from zfcal.trial import second_of
from zfcal.virtual.images.look import USUAL, Look, look_of
from zfcal.virtual.images.render import OverheadPainter
from zfcal.virtual.images.render_below import BelowPainter
from zfcal.virtual.images.swimming import Moment, Swimming, swimming

_COMMAND = "simulate"

_TOLD_EVERY = 15
_QUICK_PNG = 1

_SLACK_S = 1e-6
"""A time this little before a minute's start is the start, but for rounding."""

_Painter = OverheadPainter | BelowPainter


@dataclass(frozen=True, slots=True, kw_only=True)
class FilmOptions:
    """What to draw.

    Parameters
    ----------
    look
        How things look.
    photograph
        Of the empty tank from above, instead of a drawn one.
    seed
        Of noise, patterns and postures; None for the trial's.
    video
        A plain video file to make of the images as well; see `film_export`.
    """

    look: Look = dataclasses.field(default_factory=lambda: look_of(USUAL))
    photograph: Path | None = None
    seed: int | None = None
    video: Path | None = None


def camera_names(n_robots: int) -> tuple[str, ...]:
    """Return the cameras of a trial: the one below sees nothing but robots."""
    return (OVERHEAD, BELOW) if n_robots else (OVERHEAD,)


def frames_folder(root: Path, camera: str) -> Path:
    """Return where the images of a camera lie."""
    return root / "frames" / camera


def frames_path(root: Path, camera: str, start_s: int) -> Path:
    """Return the place of the images that start at a second."""
    return frames_folder(root, camera) / f"{start_s:06d}.mcap"


def film(root: Path, options: FilmOptions, tell: Tell, *, task: Task | None = None) -> None:
    """Draw the camera images of a trial's tracks.

    Parameters
    ----------
    root
        A trial with tracks. It gets camera files if it has none.
    options
        What to draw.
    tell
        Hears of every file.
    task
        How to go about it.

    Raises
    ------
    InputError
        There are no tracks, or images of a real camera lie there.
    """
    task = task or Task()
    read_trial(root)
    if not segment_starts(root):
        raise InputError(f"{root}: has no tracks to draw.", hint="Simulate some without --dry-run.")
    with at_work(root, _COMMAND, task):
        settled(lambda: _film(root, options, tell, task), tell)


def _film(root: Path, options: FilmOptions, tell: Tell, task: Task) -> None:
    opened = open_trial(root)
    scene = _Scene(opened, options)
    for name in camera_names(opened.trial.n_robots):
        _check_drawn(root, name, task)
        camera = _camera(opened, name, tell, task)
        _film_one(scene, name, camera, tell, task)


@final
class _Scene:
    """What both cameras show."""

    def __init__(self, opened: OpenTrial, options: FilmOptions) -> None:
        self.opened, self.options = opened, options
        self.root = opened.trial.root
        self.starts = segment_starts(self.root)
        self.seed = opened.trial.seed if options.seed is None else options.seed

    @cached_property
    def swimming(self) -> Swimming:
        """Everybody's postures."""
        return swimming(self.tracks, self.options.look, fps=self.opened.trial.fps, seed=self.seed)

    @cached_property
    def tracks(self) -> Tracks:
        """All rows of the trial."""
        return concatenate([read_tracks(segment_path(self.root, start)) for start in self.starts])

    def rows(self, start_s: int) -> range:
        """Return the rows of `swimming` in the minute that starts at a second."""
        edges = self.swimming.time_s.searchsorted([start_s - _SLACK_S, start_s + STEP_S - _SLACK_S])
        return range(int(edges[0]), int(edges[1]))

    def lineage(self, name: str, camera_file: Path) -> Lineage:
        """Return where the images of a camera come from."""
        options = self.options
        said: dict[str, JSON] = {
            **self.opened.clock_options,
            "camera": name,
            "look": dataclasses.asdict(options.look),
        }
        files = [
            *(segment_path(self.root, start) for start in self.starts),
            *self.opened.arena_files,
            camera_file,
        ]
        inputs = hash_inputs(self.root, files)
        if options.photograph is not None and name == OVERHEAD:
            inputs[options.photograph.name] = hash_of(options.photograph)
        return Lineage(schema=FRAMES, command=_COMMAND, options=said, seed=self.seed, inputs=inputs)

    def painter(self, name: str, camera: Camera | Homography) -> _Painter:
        """Return what draws a camera's images."""
        arena, look = self.opened.arena, self.options.look
        if name == BELOW:
            return BelowPainter(arena, camera, look, seed=self.seed)
        photograph = photograph_of(self.options)
        return OverheadPainter(arena, camera, look, seed=self.seed, photograph=photograph)


def _film_one(scene: _Scene, name: str, camera_file: Path, tell: Tell, task: Task) -> None:
    """Draw the images of one camera that are missing or stale."""
    if task.dry_run and not camera_file.is_file():
        for start in scene.starts:
            tell(Planned(path=frames_path(scene.root, name, start), reason="missing"))
        return
    lineage = scene.lineage(name, camera_file)
    paths = {start: frames_path(scene.root, name, start) for start in scene.starts}
    reasons = {start: reason_to_make(path, lineage, task, tell) for start, path in paths.items()}
    stale = {start: reason for start, reason in reasons.items() if reason}
    if stale:
        drawer = _Drawer(scene, name, read_camera(camera_file), lineage)
        total = sum(len(scene.rows(start)) for start in stale)
        for start, reason in stale.items():
            with unless_taken(paths[start], tell):
                check_free(paths[start])
                write_whole(paths[start], drawer.writer_of(start, total, tell))
                tell(Made(path=paths[start], reason=reason))
        tell(Progress(stage=f"{name} images", done=total, total=total))
    there = frame_segments(frames_folder(scene.root, name))
    gone = [path for path in there if second_of(path, ".mcap") not in scene.starts]
    # An earlier, longer simulation left them.
    remove_surplus(gone, tell, task, of="tracks do")


def photograph_of(options: FilmOptions) -> Image | None:
    """Return the photograph of the empty tank, if there is one.

    Raises
    ------
    InputError
        It is missing, or no image.
    """
    if options.photograph is None:
        return None
    try:
        return read_image(options.photograph)
    except DamagedError as error:
        raise InputError(str(error), hint=error.hint) from error


@final
class _Drawer:
    """Draws one camera's images into files."""

    def __init__(
        self, scene: _Scene, name: str, camera: Camera | Homography, lineage: Lineage
    ) -> None:
        self._scene, self._name, self._lineage = scene, name, lineage
        self._calibration = calibration_of(camera)
        self._paint = scene.painter(name, camera).paint
        self._done = 0

    def writer_of(self, start_s: int, total: int, tell: Tell) -> Callable[[Path], None]:
        """Return what writes the file of the minute that starts at a second."""

        def write(part: Path) -> None:
            with FrameWriter(
                part, self._name, lineage=self._lineage, calibration=self._calibration
            ) as writer:
                for row in self._scene.rows(start_s):
                    moment = self._scene.swimming.at(row)
                    writer.add(moment.time_s, self._image(moment))
                    self._done += 1
                    if self._done % _TOLD_EVERY == 0:
                        stage = f"{self._name} images"
                        tell(Progress(stage=stage, done=self._done, total=total))

        return write

    def _image(self, moment: Moment) -> bytes:
        return encoded(self._paint(moment), self._scene.options.look.jpeg_quality)


def encoded(image: Image, jpeg_quality: int | None) -> bytes:
    """Return an image as a JPEG file, or a PNG file where no quality is given."""
    if jpeg_quality is None:
        done, data = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, _QUICK_PNG])
    else:
        done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, jpeg_quality])
    if not done:
        raise InputError(f"An image of shape {image.shape} cannot be encoded.")
    return data.tobytes()


def _camera(opened: OpenTrial, name: str, tell: Tell, task: Task) -> Path:
    """Return a camera's file: the one that the trial names, or the rig's, which is made."""
    root = opened.trial.root
    named = (read_trial(root).cameras or {}).get(name, {}).get("file")
    ours = f"cameras/{name}.toml"
    path = root / (named or ours)
    if path.is_file() and not _is_ours(path):
        return path
    if named not in {None, ours} and not path.is_file():
        raise InputError(
            f"{opened.trial.config}: names the {name} camera's file {named}, which is missing.",
            hint="Calibrate the camera again, or take the line out of trial.toml.",
        )
    lineage = Lineage(
        schema=CAMERA,
        command=_COMMAND,
        options={"camera": name, "arena": opened.trial.arena},
        inputs=hash_inputs(root, opened.arena_files),
    )
    reason = reason_to_make(path, lineage, task, tell)
    if reason:
        make = below_camera if name == BELOW else overhead_camera
        write_camera(path, make(opened.arena), lineage, result={"method": "drawn, hence exact"})
        tell(Made(path=path, reason=reason))
    if not task.dry_run and name_camera(root, name, path):
        tell(Note(text=f"{opened.trial.config} names {path.name} as the {name} camera."))
    return path


def _is_ours(path: Path) -> bool:
    try:
        return read_lineage(path).command == _COMMAND
    except (DamagedError, InputError):
        return False


def _check_drawn(root: Path, name: str, task: Task) -> None:
    """Refuse to replace images that a real camera has taken.

    Raises
    ------
    InputError
        A file does not come from a simulation, and the task is not forced.
    """
    for path in frame_segments(frames_folder(root, name)):
        try:
            made_by = read_lineage(path).command
        except (DamagedError, InputError):
            continue
        if made_by != _COMMAND and not task.force:
            raise InputError(
                f"{path}: was recorded by {made_by}, expected none or drawn images.",
                hint="Draw into another trial, or replace these images with --force.",
            )
