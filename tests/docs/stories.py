"""Which blocks of commands follow each other in one folder, and what lies there before.

A story is what a reader does: some sections of some pages, in order. What takes long is made
shorter by `changes`, nothing else. A command that no story has is in `ELSEWHERE`, with the tests
that run it, or in `NOT_RUN`, with what it needs; its form is looked at in any case
(`test_snippets.py`).
"""

import gzip
import math
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import llvmlite.binding
import numpy as np

NOT_RUN = {
    "/dev/rfcomm5": "a robot",
    "--overhead 0": "a camera",
    "/dev/video0": "a camera",
    "cats2://": "a rig of the older software",
    "tcp://host": "a cluster",
    "/data/trial": "another computer",
    " T ": "a trial of the reader's own",
    "--real-time": "half an hour",
    "--twin": "an hour",
    "--overhead below.mp4": "a film of fish from below",
    "watch trial --stages": "a recording that grows",
    "zfcal watch trial ": "a recording that grows",
    "zfcal calibrate trial --as-published": "a minute for each of 300 generations",
}
"""What a command has in it that is not run, and what it would need."""

ELSEWHERE = {
    ("README.md", "Camera images"): "tests/cli/test_readme.py",
    ("docs/cameras.md", "A rig step by step"): "tests/cli/test_camera_command.py",
    ("docs/cameras.md", "From above or from below?"): "tests/cli/test_camera_command.py",
    ("docs/commands.md", "zfcal camera"): "tests/cli/test_camera_command.py",
    ("docs/commands.md", "zfcal import SRC TRIAL"): "tests/readers/test_foreign_idtracker.py",
    ("docs/commands.md", "zfcal drive TRIAL"): "tests/cli/test_driving.py",
    ("docs/drive.md", "Driving the robot"): "tests/cli/test_driving.py",
    ("docs/commands.md", "zfcal demo [DIR]"): "tests/cli/test_closed_loop.py",
    ("docs/closed-loop.md", "The closed loop, virtually"): "tests/cli/test_closed_loop.py",
    ("docs/commands.md", "zfcal reproduce [ARCHIVE]..."): "tests/cli/test_reproduce_command.py",
    ("docs/reproduce.md", "Published scores from archived trials"): (
        "tests/cli/test_reproduce_command.py"
    ),
    ("docs/commands.md", "zfcal track TRIAL"): "tests/cli/test_track_command.py",
    ("docs/tracking.md", "Tracking"): "tests/cli/test_track_command.py",
    ("docs/commands.md", "zfcal diagnose TRIAL..."): "tests/cli/test_diagnose_command.py",
    ("docs/commands.md", "zfcal extend TRIAL..."): "tests/cli/test_extend_command.py",
    ("docs/commands.md", "zfcal watch TRIAL"): "tests/cli/test_watch_command.py",
    ("docs/real-recordings.md", "Real recordings"): "tests/benchmarks/test_bench_real.py",
}
"""Sections whose commands need more than a page tells, and the tests that run such commands."""


@dataclass(frozen=True, kw_only=True)
class Story:
    """Sections that one reader goes through in one folder.

    Parameters
    ----------
    name
        Of the test.
    parts
        Page and heading; None for the whole page.
    prepare
        Puts there what the reader has: given the folder and the repository.
    before
        What the reader has typed before, on other pages.
    changes
        What is written shorter, old and new; each must occur.
    recording
        Of `shared_data`, if it goes on one.
    made_on
        Kind of processor of the page's numbers, where on another kind they may differ by more than
        some hundredths; empty where they do not.
    """

    name: str
    parts: tuple[tuple[str, str | None], ...]
    prepare: Callable[[Path, Path], None] = lambda _folder, _repository: None
    before: str = ""
    changes: tuple[tuple[str, str], ...] = ()
    recording: str | None = None
    made_on: str = ""

    @property
    def most_apart(self) -> float:
        """By how much decimals may differ from those of the page: last digits of a search do."""
        return 0.03 if self.made_on in {"", llvmlite.binding.get_host_cpu_name()} else 0.15


def samples(folder, repository):
    """Put the samples there, and what else stands in the repository."""
    shutil.copytree(repository / "data-samples", folder / "data-samples")
    shutil.copytree(repository / "zfcal" / "arenas", folder / "zfcal" / "arenas")


def readme(folder, repository):
    """Add tracks of idtracker.ai: five fish and a robot that go round the ring."""
    samples(folder, repository)
    angle = np.linspace(0, 40, 15 * 125)[:, None] + np.arange(6) * math.pi / 3
    px = np.stack([573 + 222 * np.cos(angle), 530 - 222 * np.sin(angle)], axis=-1)
    labels = [str(n + 1) for n in range(6)]
    found = {"trajectories": px, "frames_per_second": 15, "identities_labels": labels}
    np.save(folder / "day3.npy", np.array(found, dtype=object), allow_pickle=True)


def tracked(folder, repository):
    """Put tracks of another program there, and trials of other days."""
    with gzip.open(repository / "data-samples" / "two-rooms.csv.gz") as packed:
        (folder / "tracks.csv").write_bytes(packed.read())
    copies(folder, repository, "day1", "day2", "day3")


def copies(folder, repository, *names):
    """Put copies of the sample there."""
    for name in names:
        shutil.copytree(repository / "data-samples" / "two-rooms", folder / name)


def days(folder, repository):
    """Put a trial there, and those of three days."""
    copies(folder, repository, "trial", "day1", "day2", "day3")


def two_sets(folder, repository):
    """Put the sets of trials there that are compared."""
    sides = [f"{side}{n}" for side in ("treated", "control", "a", "b") for n in (1, 2, 3, 4)]
    days = [f"{day}/{name}" for day in ("day1", "day2") for name in ("tank1", "tank2")]
    copies(folder, repository, *sides, *days, "trial")


def marks(folder, repository):
    """Put marks for the camera below there, and tracks as a rig would have made them."""
    corners = {(148, 62): (0, 0), (503, 68): (1, 0), (496, 424): (1, 1), (140, 416): (0, 1)}
    rows = [f"{u},{v},{x},{y}" for (u, v), (x, y) in corners.items()]
    (folder / "below-marks.csv").write_text("\n".join(["x_px,y_px,x_m,y_m", *rows]))
    tracked(folder, repository)


def unpack(source, folder):
    """Write the marked tracks as their authors published them: without a head."""
    with gzip.open(source, "rt", encoding="utf-8") as packed:
        packed.readline()
        text = packed.read()
    (folder / "5Zebrafish_nocover_22min.txt").write_text(text, encoding="utf-8")


def square(folder, repository):
    """Put five minutes of five fish in a square tank there, as CSV."""
    rows = ["time_s,agent,x_m,y_m"]
    for frame in range(15 * 125):
        for agent in range(5):
            angle = 0.05 * frame + agent
            x, y = 0.5 + 0.3 * math.cos(angle), 0.5 + 0.3 * math.sin(angle * 1.1)
            rows.append(f"{frame / 15:.4f},{agent},{x:.4f},{y:.4f}")
    (folder / "tracks.csv").write_text("\n".join(rows), encoding="utf-8")
    assert repository.is_dir()


SMALL = "--population 12 --steps 200"
QUICK = f"--generations 0 {SMALL}"
LESS = ("--generations 20 --seed 1", f"{QUICK} --seed 1")

STORIES = (
    Story(
        name="readme",
        parts=tuple(
            ("README.md", heading)
            for heading in (
                "Five commands on the sample",
                "What it does",
                "Your own data",
                "What the model lacks",
            )
        ),
        prepare=readme,
        changes=(
            ("--budget 20s", "--budget 1s"),
            ("zfcal diagnose trial", "zfcal diagnose trial --quick"),
            ("zfcal extend trial", "zfcal extend trial --generations 0 --population 12"),
        ),
    ),
    Story(
        name="commands",
        parts=(
            ("docs/commands.md", "Commands"),
            ("docs/commands.md", "The same everywhere"),
            ("docs/commands.md", "zfcal init TRIAL"),
            ("docs/commands.md", "zfcal analyse TRIAL..."),
            ("docs/statistics.md", "What there is"),
            ("docs/commands.md", "zfcal report TRIAL..."),
            ("docs/how-to/own-arena.md", None),
            ("docs/commands.md", "zfcal inspect FILE..."),
            ("docs/commands.md", "zfcal check TRIAL..."),
        ),
        prepare=tracked,
        before="""
            zfcal init tank --arena two-rooms --fish 4 --fps 5
            for name in alone1 alone2; do
                zfcal simulate $name --model tank/models/000000.toml --duration 3min
            done
            rm -r tank
        """,
        changes=(LESS, ("zfcal calibrate -", f"zfcal calibrate - {LESS[1]}")),
    ),
    Story(
        name="searches",
        parts=(
            ("docs/commands.md", "zfcal calibrate TRIAL..."),
            ("docs/explanation/calibration.md", "How to read a model"),
            ("docs/commands.md", "zfcal simulate TRIAL"),
        ),
        prepare=two_sets,
        before="zfcal analyse trial --features residence,curvature",
        changes=(
            LESS,
            ("trial --budget 50s", f"trial --budget 1s {SMALL}"),
            ("curvature --publish score", f"curvature --publish score {QUICK}"),
            (
                "--window 0:900 --held-out 900:1800 -o first-half.toml",
                f"--window 0:180 --held-out 180:360 {QUICK} -o first-half.toml",
            ),
            ("--duration 1800 --seed 2", "--duration 120 --seed 2"),
            (
                "--duration 2min --video --video-file filmed.avi",
                "--duration 5s --video --video-file filmed.avi",
            ),
        ),
    ),
    Story(
        name="comparison",
        parts=(
            ("docs/compare.md", None),
            ("docs/commands.md", "zfcal compare A... --against B..."),
            ("docs/how-to/figure.md", None),
        ),
        prepare=two_sets,
        before=f"zfcal analyse trial && zfcal calibrate trial {QUICK}",
    ),
    Story(
        name="print",
        parts=(("docs/figures.md", None), ("docs/statistics.md", "Where D says little")),
        prepare=days,
        before=f"zfcal analyse trial day1 day2 day3 && zfcal calibrate trial {QUICK}",
        changes=(("--publish score", f"--publish score {QUICK} --force"),),
    ),
    Story(
        name="python",
        parts=(("docs/python.md", None),),
        prepare=two_sets,
        before="""
            zfcal init tank --arena open-square --fish 5 --fps 15
            cp tank/models/000000.toml my.toml
            for name in alone1 alone2; do
                zfcal simulate $name --model my.toml --arena open-square --fish 5 --duration 2min
            done
            zfcal analyse trial
            zfcal calibrate trial --generations 0 --population 12 --steps 200
        """,
        changes=(
            ('duration="30min"', 'duration="4min"'),
            ("budget=50, seed=1)", "generations=0, population=12, steps=200, seed=1)"),
        ),
    ),
    Story(name="arena", parts=(("docs/how-to/own-arena.md", None),)),
    Story(name="effect", parts=(("docs/how-to/own-effect.md", None),)),
    Story(name="import", parts=(("docs/how-to/import.md", None),), prepare=square),
    Story(
        name="first-diagnosis",
        parts=(("docs/tutorials/first-diagnosis.md", None),),
        changes=(("--generations 5 --seed 1", "--generations 0 --seed 1"),),
    ),
    Story(
        name="real-fish",
        parts=(("docs/tutorials/real-fish.md", None),),
        recording="zebrafish5-tracks/gt_2019-10-15.csv.gz",
    ),
    Story(
        name="virtual-rig",
        parts=(("docs/tutorials/virtual-rig.md", None),),
        # The robot moves by what was found, and is found again: S was 0.870 on a znver5.
        made_on="znver3",
    ),
    Story(
        name="bright",
        parts=(("docs/how-to/bright-fish.md", None),),
        before="""
            zfcal init trial --arena two-rooms --fish 4 --fps 15
            zfcal simulate trial --model trial/models/000000.toml \\
                --duration 15s --video-file film.mp4
            rm -r trial/tracks trial/frames trial/cameras
            zfcal camera corners 27,462 463,463 466,27 28,24 --size 500x500 \\
                --trial trial --camera overhead
        """,
    ),
    Story(name="below", parts=(("docs/how-to/camera-below.md", None),), prepare=marks),
    Story(
        name="live-rig",
        parts=(("docs/how-to/live-rig.md", None),),
        prepare=marks,
        changes=(
            (
                "zfcal report trial",
                "zfcal import tracks.csv trial --format csv\nzfcal report trial",
            ),
        ),
    ),
    Story(name="samples", parts=(("data-samples/README.md", None),)),
    Story(
        name="film",
        parts=(
            ("docs/video.md", None),
            ("docs/commands.md", "zfcal export TRIAL..."),
        ),
        changes=(
            ("--duration 2min --video", "--duration 10s --video"),
            (
                "2min --video --look hard --draw noise_grey=7",
                "2s --video --look hard --draw noise_grey=7",
            ),
            ("2min --video-file plain.avi", "2s --video-file plain.avi"),
        ),
    ),
)
