"""zfcal inspect: what a file is, where it comes from, what it holds."""

import json

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from zfcal.artifacts.inspecting import as_lines, describe
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.tables import SCORES, write_table, write_tracks
from zfcal.errors import DamagedError, InputError


def test_tracks_are_described(tracks_file, lineage):
    """Rows, time span, agents by kind, columns with their meaning, head, lineage."""
    found = describe(tracks_file)

    assert found["schema"] == "zfcal.tracks/1"
    assert found["problem"] is None
    assert found["lineage"] == lineage.as_dict()
    contents = found["contents"]
    assert contents["rows"] == 135
    assert contents["from_s"] == 0.0
    assert contents["to_s"] == pytest.approx(44 / 15)
    assert contents["agents"] == {"fish": 2, "robot": 1}
    assert contents["columns"][0]["name"] == "time_s"
    assert contents["columns"][0]["says"].startswith("Seconds since the start of the trial")
    assert len(contents["head"]) == 5
    assert contents["head"][0]["heading_rad"] is None
    assert contents["head"][2]["kind"] == "robot"


def test_scores_are_described(tmp_path, scores):
    """The span is that of the windows, empty places are counted."""
    path = tmp_path / "000120.parquet"
    write_table(path, scores, Lineage(schema=SCORES, command="analyse", seed=7))
    contents = describe(path)["contents"]

    assert (contents["from_s"], contents["to_s"]) == (120, 120)
    assert {c["name"]: c["nulls"] for c in contents["columns"]}["ceiling"] == 1


@pytest.mark.parametrize("kind", ["tracks", "trial", "model", "mcap", "arena", "json"])
def test_every_description_is_json_and_text(tmp_path, trial, write_mcap, repository, kind):
    """Without NaN, and without an error for any kind of file."""
    mcap, findings = tmp_path / "x.mcap", tmp_path / "x.json"
    write_mcap(mcap, metadata={"zfcal.lineage": Lineage(schema="s", command="c").as_text()})
    findings.write_text('{"schema": "zfcal.findings/1", "verdict": "no-effect"}')
    path = {
        "tracks": trial.path("tracks", 0, ".parquet"),
        "trial": trial.config,
        "model": trial.root / trial.model,
        "mcap": mcap,
        "arena": repository / "zfcal" / "arenas" / "ring.geojson",
        "json": findings,
    }[kind]

    found = describe(path)
    lines = list(as_lines(found))

    assert found["problem"] is None
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert lines[0] == f"file: {path}"
    assert not any("\n" in line for line in lines)
    assert any(line.startswith("schema: ") for line in lines)


def test_a_description_as_text_lines_up(tracks_file):
    """Tables stand in columns, values that are not known as a dash."""
    lines = list(as_lines(describe(tracks_file)))
    head = lines.index("  head:")

    assert "  rows: 135" in lines
    assert "  agents:" in lines
    assert "    fish: 2" in lines
    assert lines[head + 1].split()[:4] == ["time_s", "frame", "agent", "kind"]
    assert lines[head + 2].split()[6] == "-"
    start = lines[head + 1].index("kind")
    assert lines[head + 2][start:].startswith("fish")
    assert lines[head + 4][start:].startswith("robot")


def test_a_truncated_mcap_is_described_with_what_is_lost(tmp_path, write_mcap):
    """How many messages can be read, and how many bytes cannot."""
    path = tmp_path / "000000.mcap"
    size = write_mcap(path, finish=False)
    path.write_bytes(path.read_bytes()[: size - 40])

    found = describe(path)

    assert found["contents"]["messages"] == 19
    assert found["contents"]["lost_bytes"] > 0
    assert f"of {size - 40} bytes are lost, 19 messages can be read" in found["problem"]


def test_a_valid_table_of_wrong_content_is_described_with_the_problem(tmp_path, tracks, lineage):
    """It can be read, so it is shown."""
    path = tmp_path / "t.parquet"
    write_tracks(path, tracks, lineage)
    table = pq.read_table(path)
    pq.write_table(table.drop_columns(["x_m"]).replace_schema_metadata(table.schema.metadata), path)

    found = describe(path)

    assert found["problem"].startswith("column 'x_m' is missing")
    assert found["contents"]["rows"] == 135


def test_a_foreign_table_is_described_as_such(tmp_path):
    """Without schema and lineage, but with its columns."""
    path = tmp_path / "t.parquet"
    pq.write_table(pa.table({"a": [1, 2], "b": [None, float("nan")]}), path)

    found = describe(path)

    assert found["schema"] is None
    assert found["lineage"] is None
    assert found["problem"] == "schema is none: it carries no lineage"
    assert found["contents"]["head"] == [{"a": 1, "b": None}, {"a": 2, "b": None}]
    assert list(as_lines(found))


def test_an_arena_is_described(repository):
    """Zones by id, sizes, bins."""
    contents = describe(repository / "zfcal" / "arenas" / "two-rooms.geojson")["contents"]

    assert [zone["zone"] for zone in contents["zones"]] == ["corridor", "walls", "centre"]
    assert [zone["id"] for zone in contents["zones"]] == [1, 2, 3]
    assert contents["area_m2"] == pytest.approx(0.278157)
    assert contents["bins"]["D"] == [0.0, 0.22]


def test_a_wrong_arena_model_or_trial_is_described_with_the_problem(tmp_path, trial):
    """What is wrong, without the path again."""
    arena = tmp_path / "x.geojson"
    arena.write_text('{"type": "FeatureCollection", "features": []}')
    model = trial.root / trial.model
    model.write_text(model.read_text().replace("alpha", "alfa", 1))
    trial.config.write_text(trial.config.read_text().replace("n_fish = 2", "n_fish = -2"))
    other = tmp_path / "other.toml"
    other.write_text("schema = 'x/1'\n")

    assert describe(arena)["problem"].startswith("features must be a list of at least 1")
    assert describe(model)["problem"].startswith("unknown key 'alfa' in zones.corridor")
    assert describe(trial.config)["problem"].startswith("n_fish must be at least 0")
    assert describe(other)["problem"].startswith("its schema is 'x/1', none of")


@pytest.mark.parametrize(
    ("name", "content", "error", "says"),
    [
        ("x.png", b"x", InputError, "is of no kind that a trial holds"),
        ("x.parquet", b"PAR1 and no more", DamagedError, "was cut short"),
        ("x.parquet", b"", DamagedError, "the file is empty"),
        ("x.mcap", b"", DamagedError, "the file is empty"),
        ("x.toml", b"= 1", DamagedError, "not valid TOML"),
        ("x.json", b"{", DamagedError, "not valid JSON"),
    ],
)
def test_what_cannot_be_read_at_all_is_an_error(tmp_path, name, content, error, says):
    """Named, with a hint, never a traceback."""
    path = tmp_path / name
    path.write_bytes(content)

    with pytest.raises(error, match=says) as caught:
        describe(path)
    assert str(path) in str(caught.value)
    assert caught.value.hint


@pytest.mark.parametrize("ending", ["parquet", "mcap", "toml", "json", "geojson"])
def test_a_missing_file_is_an_error(tmp_path, ending):
    """Of whatever kind."""
    with pytest.raises(InputError, match="no such file"):
        describe(tmp_path / f"x.{ending}")
