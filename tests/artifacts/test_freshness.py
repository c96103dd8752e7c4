"""An artifact is made again when something changed that bears on it, and only then."""

import dataclasses
import os
import time

import pytest

from zfcal.artifacts.freshness import hash_inputs, relative_to, stale_reason, version_change
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.reading import contents as reading
from zfcal.artifacts.tables import STATS, TRACKS, write_tracks
from zfcal.errors import InputError

ABC = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"


@pytest.fixture
def expected():
    """Return what a run would write as lineage now."""
    return Lineage(
        schema=TRACKS,
        command="analyse",
        options={"runs": 1, "control": ["a", "b"], "legacy": False, "limit": 0.5},
        seed=7,
        inputs={"tracks/000000.parquet": "0" * 64, "trial.toml": "1" * 64},
    )


@pytest.fixture
def output(tmp_path, tracks, expected):
    """Return a file that was made with just that lineage."""
    path = tmp_path / "000000.parquet"
    write_tracks(path, tracks, expected)
    return path


def changed(lineage, **changes):
    """Return a lineage with some options of other values; None takes one away."""
    return dataclasses.replace(lineage, options={**lineage.options, **changes})


def with_inputs(lineage, **inputs):
    """Return a lineage with other inputs."""
    return dataclasses.replace(lineage, inputs=inputs)


def test_what_was_made_from_the_same_is_up_to_date(output, expected):
    """Nothing to do."""
    assert stale_reason([output], expected) is None


def test_no_outputs_are_up_to_date(expected):
    """There is nothing that could be missing."""
    assert stale_reason([], expected) is None


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"runs": 2}, "option runs: 1 -> 2"),
        ({"runs": None}, "option runs: 1 -> none"),
        ({"budget_s": 50.0}, "option budget_s: none -> 50.0"),
        ({"legacy": True}, "option legacy: false -> true"),
        ({"legacy": 0}, "option legacy: false -> 0"),
        ({"control": ["b", "a"]}, 'option control: ["a", "b"] -> ["b", "a"]'),
        ({"limit": 0.25}, "option limit: 0.5 -> 0.25"),
        ({"runs": 1.0}, None),
    ],
)
def test_an_option_that_changed_is_named(output, expected, change, reason):
    """With the old and the new value; 1 and 1.0 are one number, 0 and false are not."""
    assert stale_reason([output], changed(expected, **change)) == reason


def test_an_option_that_does_not_matter_is_not_looked_at(output, expected):
    """Such as one that only other windows depend on."""
    planned = changed(expected, runs=2)

    assert stale_reason([output], planned, ignore_options=["runs"]) is None


@pytest.mark.parametrize(
    ("inputs", "reason"),
    [
        ({"tracks/000000.parquet": "2" * 64, "trial.toml": "1" * 64},
         "input tracks/000000.parquet changed"),
        ({"trial.toml": "1" * 64}, "input tracks/000000.parquet is gone"),
        ({"tracks/000000.parquet": "0" * 64, "trial.toml": "1" * 64, "x": "3" * 64},
         "input x is new"),
    ],
)  # fmt: skip
def test_an_input_that_changed_is_named(output, expected, inputs, reason):
    """By its path relative to the trial."""
    assert stale_reason([output], with_inputs(expected, **inputs)) == reason


def test_an_input_that_is_there_and_not_asked_any_more_is_not_gone(output, expected, tmp_path):
    """It lies in the trial, whether that is told or found above the output."""
    fewer = with_inputs(expected, **{"trial.toml": "1" * 64})
    (tmp_path / "tracks").mkdir()
    (tmp_path / "tracks" / "000000.parquet").touch()

    reason = "tracks/000000.parquet is no longer an input"
    assert stale_reason([output], fewer) == reason
    assert stale_reason([output], fewer, root=tmp_path) == reason
    elsewhere = tmp_path / "elsewhere"
    assert stale_reason([output], fewer, root=elsewhere) == "input tracks/000000.parquet is gone"


def test_another_seed_command_or_version_of_the_schema_is_named(output, expected):
    """Each bears on the numbers."""
    seed = dataclasses.replace(expected, seed=8)
    none = dataclasses.replace(expected, seed=None)
    command = dataclasses.replace(expected, command="import")
    schema = dataclasses.replace(expected, schema="zfcal.tracks/2")

    assert stale_reason([output], seed) == "seed: 7 -> 8"
    assert stale_reason([output], none) == "seed: 7 -> None"
    assert stale_reason([output], command) == "made by analyse, not by import"
    assert stale_reason([output], schema) == "schema: zfcal.tracks/1 -> zfcal.tracks/2"


def test_outputs_of_two_schemas_may_have_one_run(output, expected):
    """One run of analyse writes stats and scores from the same inputs."""
    assert stale_reason([output], dataclasses.replace(expected, schema=STATS)) is None


def test_a_new_package_version_warns_and_does_not_recompute(output, expected):
    """The numbers stay until somebody asks for new ones."""
    later = dataclasses.replace(expected, version="9.9")

    assert stale_reason([output], later) is None
    assert version_change([output], later) == f"made by {expected.version}, this is 9.9"
    assert version_change([output], expected) is None


def test_a_missing_or_damaged_output_is_named(output, expected, tmp_path):
    """The first one that is found wanting."""
    assert stale_reason([output, tmp_path / "x.parquet"], expected) == "missing"

    output.write_bytes(output.read_bytes()[:-5])
    reason = stale_reason([output], expected)
    assert reason.startswith("damaged: ")
    assert str(output) not in reason
    assert "\n" not in reason
    assert version_change([output], expected) is None


def test_an_output_without_lineage_is_damaged(tmp_path, expected):
    """A model that was written by hand, in the place of a calibrated one."""
    path = tmp_path / "000120.toml"
    path.write_text("schema = 'zfcal.model/1'\n")

    assert stale_reason([path], expected) == "damaged: carries no lineage"


def test_hashes_are_named_by_path_relative_to_the_trial(tmp_path):
    """Sorted, with forward slashes; control trials lie beside this one."""
    for name in ("trial/b", "trial/a/c", "other/d"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True, parents=True)
        path.write_text("abc")
    root = tmp_path / "trial"

    found = hash_inputs(root, [root / "b", tmp_path / "other" / "d", root / "a" / "c"])

    assert found == {"../other/d": ABC, "a/c": ABC, "b": ABC}
    assert list(found) == ["../other/d", "a/c", "b"]


def test_a_path_relative_to_where_one_stands_is_the_same(tmp_path, monkeypatch):
    """Whether the trial is named by a long or by a short path."""
    (tmp_path / "trial").mkdir()
    monkeypatch.chdir(tmp_path)
    here = tmp_path.__class__("trial")

    assert relative_to(here, here / "x") == "x"
    assert relative_to(tmp_path / "trial", here / "x") == "x"
    assert relative_to(here, tmp_path / "trial" / "x") == "x"


def test_a_file_is_read_once_until_it_changes(tmp_path, monkeypatch):
    """A half-hour trial has each segment in two windows."""
    path = tmp_path / "x"
    path.write_text("abc")
    # Left alone for longer than the clock of files takes from one tick to the next.
    time.sleep(0.1)
    read = []
    real = reading.sha256_of
    monkeypatch.setattr(reading, "sha256_of", lambda p: read.append(p) or real(p))

    first = hash_inputs(tmp_path, [path])
    assert hash_inputs(tmp_path, [path]) == first
    assert len(read) == 1

    path.write_text("abd")
    os.utime(path, ns=(1, 1))
    assert hash_inputs(tmp_path, [path]) != first
    assert len(read) == 2


def test_a_file_that_was_replaced_is_read_again(tmp_path):
    """Of the same size and time, as rsync makes it: the inode tells."""
    path, other = tmp_path / "x", tmp_path / "y"
    path.write_text("abc")
    other.write_text("abd")
    for each in (path, other):
        os.utime(each, ns=(10**18, 10**18))
    before = hash_inputs(tmp_path, [path])
    other.replace(path)

    assert hash_inputs(tmp_path, [path]) != before


def test_a_missing_input_is_an_error(tmp_path):
    """It is named."""
    with pytest.raises(InputError, match="no such file"):
        hash_inputs(tmp_path, [tmp_path / "x"])
