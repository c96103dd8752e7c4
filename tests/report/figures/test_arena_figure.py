"""The tank as a picture, for every shape of tank."""

import struct
import zlib
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
import shapely

from zfcal.report.figures import theme
from zfcal.report.figures.arena import (
    arena_picture,
    contour_step_m,
    draw_arena,
    zone_areas,
    zone_entries,
)
from zfcal.report.figures.panels import compose

NAMES = ("two-rooms", "open-square", "circular", "ring", "own", "narrow")


def chunks(path):
    """Return the names of a PNG's chunks, having checked their sums."""
    data, at, names = Path(path).read_bytes(), 8, []
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        body = data[at + 4 : at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length : at + 12 + length])[0] == zlib.crc32(body)
        names.append(body[:4].decode())
        at += 12 + length
    return names


def test_zone_areas_by_hand(arenas):
    """A square of 1 m with walls of 0.07 m: the centre has a side of 0.86 m."""
    areas = zone_areas(arenas["open-square"])

    assert areas["centre"].area == pytest.approx(0.86**2)
    assert areas["walls"].area == pytest.approx(1 - 0.86**2)


@pytest.mark.parametrize("name", NAMES)
def test_zone_areas_fill_the_tank_without_overlap(arenas, name):
    """What is coloured is what the statistics take for the zone."""
    arena = arenas[name]
    areas = zone_areas(arena)
    rng = np.random.default_rng(1)
    x0, y0, x1, y1 = arena.outline.bounds
    points = rng.uniform((x0, y0), (x1, y1), (2000, 2))
    found = np.zeros(len(points), dtype=int)
    for number, area in enumerate(areas.values(), start=1):
        found[shapely.contains_xy(area, *points.T)] = number
    ids = arena.zone_of(points)

    assert tuple(areas) == arena.zone_names
    assert sum(area.area for area in areas.values()) == pytest.approx(arena.outline.area, rel=1e-4)
    # A rounded corner of the wall zone is a polygon here and a circle there.
    assert (found != ids).mean() < 0.002


@pytest.mark.parametrize(
    ("name", "step_m"), [("open-square", 0.1), ("ring", 0.01), ("two-rooms", 0.05)]
)
def test_contours_have_a_round_step(arenas, name, step_m):
    """The square is 0.5 m deep, the ring 0.05 m, a room 0.175 m: at most five contours."""
    assert contour_step_m(arenas[name]) == step_m


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_no_text_covers_another_and_all_zones_are_in_the_key(arenas, covered_texts, name):
    """Names that have no room in the tank are left to the key."""
    arena = arenas[name]
    entries = zone_entries(arena)

    assert covered_texts(arena_picture(arena)) == []
    assert covered_texts(arena_picture(arena, width_in=4.2)) == []
    assert [entry.label.split(":")[0] for entry in entries] == list(arena.zone_names)


def test_the_key_tells_share_and_walls(arenas):
    """26 % of the square is near the wall, and fish follow the wall there."""
    labels = [entry.label for entry in zone_entries(arenas["open-square"])]

    assert labels == ["walls: 26 % of the area, follows walls", "centre: 74 % of the area"]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_png_is_whole_and_the_same_every_time(arenas, tmp_path, name):
    """No chunk tells the program, the day or the machine."""
    for file in ("a.png", "b"):
        draw_arena(arenas[name], tmp_path / file)

    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b").read_bytes()
    assert set(chunks(tmp_path / "a.png")) <= {"IHDR", "pHYs", "IDAT", "IEND"}


@pytest.mark.slow
def test_walls_and_zones_are_where_they_are_in_the_tank(arenas, tmp_path):
    """The wall is dark, the centre has the zone's tint, a hole has none."""
    arena = arenas["ring"]
    with theme.style():
        figure = compose(arena_picture(arena))
        figure.canvas.draw()
        pixels = np.asarray(figure.canvas.buffer_rgba())[::-1, :, :3] / 255
        where = figure.axes[0].transData.transform
        hole, middle, wall = (
            pixels[int(y), int(x)] for x, y in where([(0, 0), (0, -0.24), (0.29, 0)])
        )

    assert hole == pytest.approx([1, 1, 1])
    tint = np.array([int(theme.zone_colours(arena.zone_names)["middle"][i : i + 2], 16)
                     for i in (1, 3, 5)]) / 255  # fmt: skip
    assert middle == pytest.approx(1 - 0.35 * (1 - tint), abs=0.06)
    assert wall.max() < 0.5
    path = tmp_path / "ring.png"
    draw_arena(arena, path)
    assert matplotlib.image.imread(path).shape[1] == pytest.approx(5.4 * theme.PNG_DPI, abs=1)


def test_metre_axes_have_equal_scales(arenas):
    """A circle is a circle."""
    figure = compose(arena_picture(arenas["circular"]))
    figure.canvas.draw()
    axes = figure.axes[0]
    (x0, y0), (x1, y1) = axes.transData.transform([(0, 0), (0.1, 0.1)])

    assert x1 - x0 == pytest.approx(y1 - y0)
    assert axes.get_xlabel() == "x (m)"
