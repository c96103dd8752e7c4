"""The schemas themselves: sound, and those of the contract."""

import copy
import json
from importlib.resources import files

import pyarrow as pa
import pytest
from jsonschema import Draft202012Validator

from zfcal.artifacts.columns import TABLE_SCHEMAS, form_of
from zfcal.artifacts.validation import check
from zfcal.errors import InputError

FOLDER = files("zfcal.schemas")
JSON_SCHEMAS = sorted(f.name for f in FOLDER.iterdir() if f.name.endswith(".schema.json"))
TABLES = sorted(f.name for f in FOLDER.iterdir() if f.name.endswith(".arrow.json"))

FINDINGS = {
    "schema": "zfcal.findings/1",
    "verdict": "named",
    "where": [
        {
            "statistic": "alignment",
            "zone": None,
            "time_s": [0, 120],
            "agents": [1, 2],
            "observed": 0.4,
            "expected": 0.1,
            "z": 9.1,
            "q": 0.001,
        }
    ],
    "effects": [
        {
            "name": "alignment",
            "says": "Fish turn toward their neighbours' headings.",
            "strength": {"kappa": 1.5},
            "interval": {"kappa": [1.0, 2.0]},
            "gain_nats_per_step": 0.02,
            "p": 0.001,
            "ties": ["group-cohesion"],
        }
    ],
    "screened": [{"name": "fatigue", "z": None, "p": None, "minutes_needed": 40}],
    "gap": [
        {
            "measure": "S_over_ceiling",
            "before": 0.8,
            "after": 0.95,
            "floor": 1.0,
            "closed": 0.75,
            "interval": [0.5, 0.9],
            "placebo": 0.02,
        }
    ],
}
POSES = {
    "time_s": 0.2,
    "frame": 3,
    "agents": [
        {"agent": 0, "kind": "fish", "x_m": 0.1, "y_m": 0.2, "heading_rad": None, "confidence": 1}
    ],
}
SCORES = {
    "schema": "zfcal.scores-json/1",
    "scores": [
        {
            "window_end_s": 120,
            "compared": "model-vs-control",
            "feature": "S",
            "zone": None,
            "value": 0.8,
            "low": 0.7,
            "high": 0.9,
            "ceiling": 0.85,
            "n_windows": 200,
            "n_features": 4,
        }
    ],
}
TARGET = {"what": "target", "time_s": 1.0, "x_m": 0.1, "y_m": 0.2, "heading_rad": 0.0}
COMMAND = {"what": "command", "time_s": 1.0, "left_m_s": 0.1, "right_m_s": 0.12}
FAULT = {"what": "fault", "time_s": 1.0, "fault": "stale-pose", "says": "No pose for 0.5 s."}


def read(name):
    """Return a schema file's content."""
    return json.loads((FOLDER / name).read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", JSON_SCHEMAS)
def test_every_json_schema_is_one_of_draft_2020_12(name):
    """By the draft's own schema, and with an id of its own."""
    document = read(name)

    Draft202012Validator.check_schema(document)
    assert document["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert document["$id"] == f"urn:zfcal:{name.removesuffix('.schema.json')}:1"


@pytest.mark.parametrize("name", JSON_SCHEMAS)
def test_every_object_of_a_schema_says_what_else_it_may_hold(name):
    """A key that nobody knows is an error, unless free keys are meant: then of a known kind."""
    free = {"options", "result"}

    def look(node, key):
        if isinstance(node, dict):
            if node.get("type") == "object" and key not in free:
                said = {"additionalProperties", "unevaluatedProperties"} & set(node)
                assert said, f"{name}: {key}"
            for item_key, item in node.items():
                look(item, item_key)
        elif isinstance(node, list):
            for item in node:
                look(item, key)

    look(read(name), name)


@pytest.mark.parametrize("name", TABLES)
def test_every_description_of_a_table_fits_its_own_schema(name):
    """And gives an Arrow schema."""
    document = read(name)

    check(document, "table", name)
    assert isinstance(form_of(document["schema"]).arrow(), pa.Schema)


def test_there_is_a_description_for_every_table():
    """The four of the contract."""
    assert {read(name)["schema"] for name in TABLES} == set(TABLE_SCHEMAS)


def test_columns_of_stats_and_scores_are_those_of_the_contract():
    """By name and in order; text is plain text."""
    assert form_of("zfcal.stats/1").names == (
        "window_end_s", "case", "feature", "zone", "to_zone", "bin", "count", "frequency",
    )  # fmt: skip
    assert form_of("zfcal.scores/1").names == (
        "window_end_s", "compared", "feature", "zone", "value", "low", "high", "ceiling",
        "n_windows", "n_features",
    )  # fmt: skip
    assert form_of("zfcal.stats/1").arrow().field("case").type == pa.string()


def test_values_that_a_score_may_compare_are_those_of_the_contract():
    """They are what people filter by."""
    columns = {column.name: column.values for column in form_of("zfcal.scores/1").columns}

    assert columns["compared"] == ("social-vs-control", "robot-vs-fish", "model-vs-control")
    assert columns["feature"] == ("D", "W", "O", "T", "S")


@pytest.mark.parametrize(
    ("schema", "document"),
    [
        ("findings", FINDINGS),
        ("findings", {**FINDINGS, "verdict": "no-effect", "effects": [], "where": []}),
        ("poses", POSES),
        ("poses", {"time_s": 0, "frame": 0, "agents": []}),
        ("scores-json", SCORES),
        ("drive", TARGET),
        ("drive", COMMAND),
        ("drive", FAULT),
    ],
)
def test_a_document_of_the_contract_fits_its_schema(schema, document):
    """Each kind of JSON that the commands write."""
    check(document, schema, "x.json")


@pytest.mark.parametrize(
    ("schema", "document", "place", "value", "says"),
    [
        ("findings", FINDINGS, ["verdict"], "maybe", 'verdict must be one of "named", "tie"'),
        ("findings", FINDINGS, ["where", 0, "time_s"], [0], "where[0].time_s must be a list of at"),
        ("findings", FINDINGS, ["effects", 0, "says"], None, "effects[0].says must be text"),
        ("findings", FINDINGS, ["gap", 0, "measure"], "X", "gap[0].measure must be one of"),
        ("poses", POSES, ["agents", 0, "kind"], "duck", "agents[0].kind must be one of"),
        ("poses", POSES, ["agents", 0, "z_m"], 1, "unknown key 'z_m' in agents[0]"),
        ("poses", POSES, ["frame"], -1, "frame must be at least 0, got -1"),
        ("scores-json", SCORES, ["scores", 0, "value"], 1.5, "scores[0].value must be at most 1"),
        ("drive", COMMAND, ["what"], "target", "'x_m' is missing"),
        ("drive", FAULT, ["fault"], "bored", "fault must be one of"),
    ],
)
def test_a_document_that_breaks_the_contract_is_named(schema, document, place, value, says):
    """With the dotted path to what is wrong."""
    broken = copy.deepcopy(document)
    target = broken
    for step in place[:-1]:
        target = target[step]
    target[place[-1]] = value

    with pytest.raises(InputError) as caught:
        check(broken, schema, "x.json")
    assert says in str(caught.value)
