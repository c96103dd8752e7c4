"""docs/architecture.md says how to add an arena: it is done here, to the letter."""

import json
import re

import pytest

from zfcal.artifacts.tables import read_table


@pytest.fixture
def arena(repository, tmp_path):
    """Write the page's example where the commands run."""
    page = (repository / "docs" / "architecture.md").read_text(encoding="utf-8")
    section = page.partition("## Add an arena")[2].partition("\n## ")[0]
    (document,) = re.findall(r"^```json\n(.*?)^```", section, re.DOTALL | re.MULTILINE)
    place = tmp_path / "l-shape.geojson"
    place.write_text(document, encoding="utf-8")
    return json.loads(document)


@pytest.mark.slow
def test_an_arena_of_the_page_works_with_every_stage(zfcal, arena):
    """Its own zone and what it leaves are simulated in, counted and calibrated."""
    made = zfcal("init", "own", "--arena", "l-shape.geojson", "--fish", 3, "--fps", 5, "--seed", 1)
    assert made.code == 0, made.err
    model = "own/models/000000.toml"
    few = ("--generations", 0, "--population", 8, "--steps", 100)
    for words in (
        ("simulate", "own", "--model", model, "--duration", "3min"),
        ("analyse", "own"),
        ("calibrate", "own", *few),
        ("check", "own"),
    ):
        done = zfcal(*words)
        assert done.code == 0, done.err
    stats = read_table_of("own/stats/000120.parquet")
    assert set(stats["zone"]) - {None} == {"shelter", "walls", "centre"}
    assert arena["features"][1]["properties"]["zone"] == "shelter"


def test_a_zone_that_leaves_the_tank_is_refused_by_name(zfcal, arena, tmp_path):
    """The page says that check says what is wrong."""
    ring = arena["features"][1]["geometry"]["coordinates"][0]
    ring[1][0] = ring[2][0] = 0.9
    (tmp_path / "l-shape.geojson").write_text(json.dumps(arena), encoding="utf-8")
    done = zfcal("init", "own", "--arena", "l-shape.geojson", "--fish", 3, "--fps", 5)
    assert done.code != 0
    assert "shelter" in done.err


def read_table_of(path):
    """Return the columns of a trial's statistics."""
    return read_table(path, "zfcal.stats/1").to_pydict()
