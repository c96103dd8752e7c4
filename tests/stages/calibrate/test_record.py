"""The record of the publishing rules as a file."""

import json
import math

import numpy as np
import pytest

from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.tables import RULES, read_extra, read_table, write_table
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.rules import KEEP, SCORE, Candidate, Forward, Record
from zfcal.errors import DamagedError
from zfcal.stages.calibrate.record import read_record, write_record

ZONES = ("one", "other")
NAMES = ("one.kappa_0", "one.alpha", "other.kappa_0")
LINEAGE = Lineage(schema=RULES, command="calibrate")


def statistics(seed):
    """Return any counts."""
    rng = np.random.default_rng(seed)
    shapes = {"distance": (2, 10), "wall": (2, 10), "occupation": (2,), "transition": (2, 2)}
    counts = {name: rng.integers(0, 10**12, size=shape) for name, shape in shapes.items()}
    return Statistics(zone_names=ZONES, speed=rng.integers(0, 9, size=(2, 10)), **counts)


def model(rule, made_at_s, seed):
    """Return a model of genes that no short decimal number says."""
    genes = np.random.default_rng(seed).random(3)
    return Candidate(
        rule=rule, made_at_s=made_at_s, of_s=made_at_s, genes=genes, long_run=statistics(seed)
    )


@pytest.fixture
def record():
    """Return a record of one judged window; one score has no number."""
    rows = tuple(
        Forward(window_end_s=240, rule=rule, made_at_s=120, S=s, low=low, high=high, n=1200)
        for rule, s, low, high in (
            (SCORE, 0.1 + 0.2, 0.2, 0.4),
            (KEEP, math.nan, math.nan, math.nan),
        )
    )
    models = (model(SCORE, 180, 1), model(KEEP, 180, 2))
    return Record(
        rows=rows, models=models, n_rounds=3, in_use=model(SCORE, 120, 3), in_charge=SCORE
    )


def write(path, record):
    """Write a record with the names of its genes."""
    write_record(path, record, LINEAGE, gene_names=NAMES)


def test_a_record_comes_back_to_the_byte(tmp_path, record):
    """What was read is written as it was, models with all their digits."""
    first, second = tmp_path / "first.parquet", tmp_path / "second.parquet"
    write(first, record)
    found = read_record(first, ZONES)
    write(second, found)
    assert first.read_bytes() == second.read_bytes()
    assert (found.n_rounds, len(found.rows), len(found.models)) == (3, 2, 2)
    assert (found.models[0].genes == record.models[0].genes).all()
    assert found.in_charge == SCORE
    assert (found.in_use.long_run.transition == record.in_use.long_run.transition).all()
    assert found.rows[0] == record.rows[0]
    assert math.isnan(found.rows[1].S)


def test_an_empty_record_comes_back(tmp_path):
    """As the first round leaves it, but for its models."""
    path = tmp_path / "rules.parquet"
    write(path, Record(n_rounds=1))
    found = read_record(path, ZONES)
    assert (found.rows, found.models, found.in_use, found.n_rounds) == ((), (), None, 1)


def test_the_table_is_what_the_schema_says(tmp_path, record):
    """A row per rule and window; an unknown score is null."""
    path = tmp_path / "rules.parquet"
    write(path, record)
    table = read_table(path, RULES)
    assert table.column_names == ["window_end_s", "rule", "made_at_s", "S", "low", "high", "n"]
    assert table.column("S").to_pylist() == [0.1 + 0.2, None]
    assert table.column("rule").to_pylist() == ["score", "keep"]
    assert read_extra(path)["gene_names"] == list(NAMES)


@pytest.mark.parametrize(
    "harm",
    [
        {"models": None},
        {"models": 7},
        {"models": [{}]},
        {"models": ["score"]},
        {"in_use": "score"},
        {"in_charge": "the best"},
        {"in_charge": None},
        {"in_use": {"rule": "score", "made_at_s": "soon", "of_s": 1, "genes": [0, 0, 0]}},
        {"n_rounds": "many"},
        {"n_rounds": None},
        {"gene_names": None},
        {"gene_names": ["one.kappa_0"]},
    ],
    ids=repr,
)
def test_a_record_that_lacks_its_models_is_damaged(tmp_path, record, harm):
    """Whatever the extra metadata hold instead: named, with what to do."""
    path = tmp_path / "rules.parquet"
    write(path, record)
    extra = {key: value for key, value in (read_extra(path) | harm).items() if value is not None}
    write_table(path, read_table(path, RULES), LINEAGE, extra=extra)
    with pytest.raises(DamagedError, match="does not say which models") as caught:
        read_record(path, ZONES)
    assert str(path) in str(caught.value)
    assert caught.value.hint == "Make it again: zfcal calibrate TRIAL --force"
    assert caught.value.exit_code == 3


@pytest.mark.parametrize(
    "harm",
    [
        {"genes": [0.5, 0.5]},
        {"genes": [0.5, 0.5, None]},
        {"genes": "abc"},
        {"rule": "luck"},
        {"counts": {}},
        {"counts": []},
    ],
    ids=repr,
)
def test_a_model_that_is_none_is_damaged(tmp_path, record, harm):
    """It could be handed to the robot otherwise."""
    path = tmp_path / "rules.parquet"
    write(path, record)
    extra = read_extra(path)
    extra["models"][1] |= harm
    write_table(path, read_table(path, RULES), LINEAGE, extra=extra)
    with pytest.raises(DamagedError, match="does not say which models"):
        read_record(path, ZONES)


@pytest.mark.parametrize("count", [-1, 2**63])
def test_counts_that_are_none_are_damaged(tmp_path, record, count):
    """Fewer than nothing, or more than there can be."""
    path = tmp_path / "rules.parquet"
    write(path, record)
    extra = json.loads(json.dumps(read_extra(path)))
    extra["in_use"]["counts"]["O"][0] = count
    write_table(path, read_table(path, RULES), LINEAGE, extra=extra)
    with pytest.raises(DamagedError, match="does not say which models"):
        read_record(path, ZONES)


def test_a_record_of_other_zones_is_damaged(tmp_path, record):
    """Its counts are of two."""
    path = tmp_path / "rules.parquet"
    write(path, record)
    with pytest.raises(DamagedError):
        read_record(path, ("one", "other", "third"))
