"""A diagnosis as a document, and back."""

import dataclasses
import json
import math

import numpy as np
import pytest
import shapely

from zfcal.arena import make_arena
from zfcal.artifacts.validation import check
from zfcal.diagnose.document import findings_document, gap_document, read_document
from zfcal.diagnose.findings import FeatureCurve, Gap, Trace
from zfcal.diagnose.pictured import MOST_AGENTS, picture_of
from zfcal.diagnose.question import Question
from zfcal.errors import InputError
from zfcal.parameters import natural
from zfcal.tracks import Samples

CONTRACT = {
    "where": {"statistic", "zone", "time_s", "agents", "observed", "expected", "z", "q"},
    "effects": {"name", "says", "strength", "interval", "gain_nats_per_step", "p", "ties"},
    "screened": {"name", "z", "p", "minutes_needed"},
    "gap": {"measure", "before", "after", "floor", "closed", "interval", "placebo"},
}


@pytest.fixture(scope="module")
def tank():
    """A tank of 1.2 by 0.6 m."""
    return make_arena(name="tank", outline=shapely.box(0, 0, 1.2, 0.6))


@pytest.fixture(scope="module")
def model(tank):
    """A model for it."""
    return natural(tuple((z.name, z.follows_walls) for z in tank.zones), dt_s=0.2)


def trace_of(x_m, y_m, *, time_s=None, track=None, before=None):
    """Return a trace with steps at these places; its other columns do not matter."""
    n = len(x_m)
    zeros = np.zeros(n)
    return Trace(
        time_s=zeros if time_s is None else np.array(time_s, dtype=float),
        x_m=np.array(x_m, dtype=float),
        y_m=np.array(y_m, dtype=float),
        track=np.zeros(n, dtype=np.int32) if track is None else np.array(track, dtype=np.int32),
        before=np.ones(n) if before is None else np.array(before, dtype=float),
        after=zeros,
        cue=np.zeros(1),
        observed=np.zeros(1),
        expected_before=np.zeros(1),
        expected_after=np.zeros(1),
        cue_name="cue",
        response_name="response",
    )


def test_a_document_has_the_keys_of_the_contract_and_passes_its_schema(tank, model, make_diagnosis):
    """To the letter, also after a way through JSON text; NaN is null."""
    document = json.loads(json.dumps(findings_document(make_diagnosis(tank, model), tank)))
    check(document, "findings", "findings.json")
    for part in ("where", "effects", "screened"):
        assert all(set(entry) == CONTRACT[part] for entry in document[part])
    assert document["schema"] == "zfcal.findings/1"
    assert document["screened"][3]["z"] is None
    assert document["effects"][0]["interval"]["kappa"] == [3.0, None]


def test_what_is_read_back_is_what_was_found(tank, model, make_diagnosis):
    """Verdict, effects, places and the numbers of the pictures."""
    diagnosis = make_diagnosis(tank, model)
    found = read_document(json.loads(json.dumps(findings_document(diagnosis, tank))))
    assert found.verdict is diagnosis.verdict
    assert found.where == diagnosis.where
    assert found.effects[0].says == diagnosis.effects[0].says
    assert found.effects[0].gain_se == pytest.approx(0.002)
    assert math.isnan(found.effects[0].interval["kappa"][1])
    assert found.screened[4].lacks == "a robot"
    assert (found.minutes, found.n_steps) == (10.0, 4000)
    pictured = picture_of(diagnosis.effects[0].trace, tank)
    assert np.array_equal(found.pictured[0].place_n, pictured.place_n)
    assert found.pictured[0].place == pytest.approx(pictured.place, rel=1e-5, nan_ok=True)
    assert found.pictured[0].minutes.after == pytest.approx(pictured.minutes.after, rel=1e-5)


def test_curves_of_features_are_read_back(tank, model, make_diagnosis):
    """Those of an effect on headings; an end of an interval that is not known is null."""
    curve = FeatureCurve(
        label="leaning", nats=84.0, form_nats=76.25, cue="distance (m)", strength_name="nats",
        at=np.array([0.0, 0.1]), strength=np.array([0.2, 0.05]), low=np.array([0.1, np.nan]),
        high=np.array([0.3, 0.1]), form=np.array([0.15, 0.06]), besides={"x": (0.1, 0.05, 0.15)},
    )  # fmt: skip
    diagnosis = make_diagnosis(tank, model)
    first = dataclasses.replace(diagnosis.effects[0], by_features=curve)
    diagnosis = dataclasses.replace(diagnosis, effects=(first, *diagnosis.effects[1:]))
    document = json.loads(json.dumps(findings_document(diagnosis, tank)))
    check(document, "findings", "findings.json")
    assert document["details"]["effects"][0]["by_features"]["low"] == [0.1, None]
    found = read_document(document).effects[0].by_features
    assert (found.label, found.nats, found.form_nats) == ("leaning", 84.0, 76.25)
    assert (found.cue, found.strength_name, found.besides) == (curve.cue, "nats", curve.besides)
    for key in ("at", "strength", "low", "high", "form"):
        assert getattr(found, key) == pytest.approx(getattr(curve, key), nan_ok=True)


def test_a_document_of_the_contract_alone_can_be_read(tank, model, make_diagnosis):
    """Without notes, details and gap there are no pictures."""
    document = findings_document(make_diagnosis(tank, model), tank)
    del document["notes"], document["details"]
    found = read_document(document)
    assert (found.notes, found.pictured, found.gap) == ((), (None,), ())
    assert math.isnan(found.minutes)


def test_a_gap_without_an_interval_has_null(tank, model, make_diagnosis):
    """And comes back as NaN."""
    numbers = {"before": 1.0, "after": 0.4, "floor": 0.2, "closed": 0.75, "placebo": math.nan}
    gap = [
        Gap(measure="D", interval=(0.5, 1.0), **numbers),
        Gap(measure="effect", interval=(math.nan, math.nan), **numbers),
    ]
    document = findings_document(make_diagnosis(tank, model), tank) | {"gap": gap_document(gap)}
    check(document, "findings", "findings.json")
    assert set(document["gap"][0]) == CONTRACT["gap"]
    assert [entry["interval"] for entry in document["gap"]] == [[0.5, 1.0], None]
    assert read_document(document).gap[0] == Gap(
        **{**numbers, "placebo": read_document(document).gap[0].placebo},
        measure="D",
        interval=(0.5, 1.0),
    )


def test_a_map_by_hand(tank):
    """Squares of 1.2 / 24 m = 5 cm; three steps in the first one, one in the last corner.

    Scores 1, 1, 4 and 2 have the root mean square sqrt(22 / 4) = 2.345.
    """
    trace = trace_of([0.01, 0.02, 0.04, 1.2], [0.01, 0.04, 0.02, 0.6], before=[1.0, 1.0, 4.0, 2.0])
    pictured = picture_of(trace, tank)
    assert pictured.place.shape == (12, 24)
    assert pictured.cell_m == pytest.approx(0.05)
    assert pictured.place_n[0, 0] == 3
    assert pictured.place[0, 0] == pytest.approx(2.0 / math.sqrt(22 / 4))
    assert pictured.place_n[-1, -1] == 1
    assert pictured.place_n.sum() == 4
    assert np.isnan(pictured.place[0, 1])


def test_minutes_count_from_the_trial_start(tank):
    """Steps in minutes 2 and 4; minute 3 is empty, not missing."""
    trace = trace_of([0.1] * 3, [0.1] * 3, time_s=[125.0, 179.9, 240.0])
    minutes = picture_of(trace, tank).minutes
    assert minutes.label.tolist() == [2, 3, 4]
    assert minutes.n.tolist() == [2, 0, 1]
    assert np.isnan(minutes.before[1])
    assert minutes.half_width[0] == pytest.approx(1.96 / math.sqrt(2))


def test_the_tracks_with_the_most_steps_are_kept(tank):
    """Of 30 track ids the twelve longest, in the order of their ids."""
    track = np.repeat(np.arange(30), np.arange(1, 31))
    agents = picture_of(trace_of([0.1] * len(track), [0.1] * len(track), track=track), tank).agents
    assert agents.label.tolist() == list(range(30 - MOST_AGENTS, 30))
    assert agents.n.tolist() == list(range(31 - MOST_AGENTS, 31))


def test_a_trace_without_a_step_has_empty_pictures(tank):
    """Nothing is divided by zero."""
    pictured = picture_of(trace_of([], []), tank)
    assert pictured.place_n.sum() == 0
    assert len(pictured.minutes.n) == len(pictured.agents.n) == 0


def samples_of(dt_s=0.2):
    """Return samples of nobody."""
    return Samples(
        dt_s=dt_s,
        k=np.arange(3),
        agent=np.zeros(0, dtype=np.int32),
        kind=np.zeros(0, dtype=np.int8),
        xy_m=np.zeros((3, 0, 2)),
        confidence=np.zeros((3, 0), dtype=np.float32),
    )


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"samples": samples_of(dt_s=0.1)}, "sampled every 0.1 s, expected the model's step"),
        ({"noise_m": math.nan}, "noise must be a length"),
        ({"n_null": 0}, "n_null must be at least 1"),
        ({"seed": -1}, "seed must be at least 0"),
        ({"n_workers": 0}, "n_workers must be at least 1"),
    ],
)
def test_a_question_that_makes_no_sense_is_refused(tank, model, change, match):
    """Each with what was expected."""
    known = {
        "samples": samples_of(),
        "arena": tank,
        "model": model,
        "noise_m": None,
        "noise_source": "unknown",
        "n_null": 39,
        "quick": False,
        "seed": 0,
        "n_workers": 1,
    }
    Question(**known)
    with pytest.raises(InputError, match=match):
        Question(**{**known, **change})


def test_a_model_of_other_zones_is_refused(tank, model):
    """The message names both."""
    ring = make_arena(name="hall", outline=shapely.box(0, 0, 5, 5))
    other = natural((("corridor", False),), dt_s=0.2)
    with pytest.raises(InputError, match="zones are corridor"):
        Question(
            samples=samples_of(),
            arena=ring,
            model=other,
            noise_m=None,
            noise_source="unknown",
            n_null=1,
            quick=False,
            seed=0,
            n_workers=1,
        )
