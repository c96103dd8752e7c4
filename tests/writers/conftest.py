"""Three fish and a robot in 40 frames, with gaps, guesses and unknown headings."""

from dataclasses import replace

import numpy as np
import pytest

from zfcal.readers import ImportOptions, import_foreign
from zfcal.tracks import FISH, ROBOT, Tracks
from zfcal.writers import FORMATS, Image, dense, export_files

FPS = 15.0
IDS = (2, 5, 7, 11)


def swimming(jitter_s=0.0):
    """Return tracks of ids 2, 5, 7 (fish) and 11 (robot), from frame 2 to frame 39."""
    rng = np.random.default_rng(3)
    rows = [(frame, agent) for frame in range(2, 40) for agent in IDS if _seen(frame, agent)]
    frame, agent = (np.array(column) for column in zip(*rows, strict=True))
    late_s = jitter_s * rng.random(40)
    heading_rad = rng.uniform(-np.pi, np.pi, len(rows)).astype(np.float32)
    heading_rad[::7] = np.nan
    confidence = np.where(np.arange(len(rows)) % 5 == 0, 0.3, 0.9).astype(np.float32)
    return Tracks(
        time_s=frame / FPS + late_s[frame],
        frame=frame.astype(np.int64),
        agent=agent.astype(np.int32),
        kind=np.where(agent == 11, ROBOT, FISH).astype(np.int8),
        x_m=rng.uniform(0.05, 0.95, len(rows)),
        y_m=rng.uniform(0.05, 0.95, len(rows)),
        heading_rad=heading_rad,
        confidence=confidence,
    )


def _seen(frame, agent):
    # Nobody in frame 20; fish 5 is away for a while, fish 7 comes late.
    return not (frame == 20 or (agent == 5 and 10 <= frame < 15) or (agent == 7 and frame < 9))


@pytest.fixture
def tracks():
    """Return the animals, by an even clock."""
    return swimming()


@pytest.fixture
def image():
    """Return an image of 0.8 mm a pixel, in which (0, 0) m lies at (25, 1275) px."""
    return Image(m_per_px=0.0008, origin_m=(0.02, 1.02))


@pytest.fixture
def round_trip(tmp_path, image):
    """Return what exports tracks, imports them again, and gives both with the notes."""

    def go(name, tracks, *, scaled=False, **options):
        axes = FORMATS[name].axes(image, scaled=scaled)
        for file, write in export_files(name, dense(tracks, FPS), axes, image).items():
            write(tmp_path / file)
        if axes.unit == "px":
            options["m_per_px"] = axes.m_per_unit
        if axes.y_down:
            options |= {"origin": axes.origin, "flip_y": True}
        chosen = ImportOptions(fps=FPS, n_fish=3, n_robots=1, **options)
        return import_foreign(tmp_path / FORMATS[name].reads, name, chosen)

    return go


@pytest.fixture
def certain():
    """Return what makes tracks certain, with no headings: what every format can hold."""

    def plain(tracks):
        return replace(
            tracks,
            heading_rad=np.full(len(tracks), np.nan, np.float32),
            confidence=np.ones(len(tracks), np.float32),
        )

    return plain
