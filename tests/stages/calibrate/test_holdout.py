"""One pooled window: a model learnt on one half of a recording and judged on the other."""

import dataclasses

import numpy as np
import pytest

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.models import read_model, read_result
from zfcal.behaviour.located import locate
from zfcal.behaviour.statistics import measure
from zfcal.errors import InputError
from zfcal.parameters import n_genes
from zfcal.sampling import sample
from zfcal.stages.calibrate.holdout import (
    FixedModel,
    Span,
    calibrate_span,
    evaluate_model,
    pooled_fish,
    tracked_in,
)
from zfcal.stages.events import Made, Note, UpToDate, say_nothing
from zfcal.stages.segments import Segments
from zfcal.stages.simulate import SimulateOptions, simulate
from zfcal.stages.trial_context import open_trial
from zfcal.tracks import FISH


def span_of(tmp_path, train=(0, 120), held_out=(120, 240)):
    """Return a span whose model goes beside the trial."""
    return Span(train_s=train, held_out_s=held_out, output=tmp_path / "first.toml")


def test_a_stretch_is_pooled_whatever_its_segments(make_trial, wandering):
    """From 30 to 170 s, fish alone, as in the uncut tracks."""
    root = make_trial(seconds=240, n_robots=1)
    segments = Segments()
    opened = segments.open(root)
    found, starts = pooled_fish(opened, segments, (30, 170))
    tracks = wandering(240, n_robots=1)
    samples = sample(tracks, fps=5.0, dt_s=0.2, start_s=30, end_s=170).of_kind(FISH)
    points = locate(samples, opened.arena)
    wanted = measure(points, points.arena)
    assert starts == [0, 60, 120]
    assert np.array_equal(found.transition, wanted.transition)
    assert np.array_equal(found.distance, wanted.distance)


@pytest.mark.slow
def test_a_model_reaches_its_ceiling_on_its_own_fish(tmp_path, make_trial):
    """On 10 minutes of itself S is within the interval of 200 of its own stretches.

    Another model, which turns at random and shuns the walls, scores far below.
    """
    home = make_trial("home", seconds=1)
    model = home / "models" / "000000.toml"
    root = tmp_path / "own"
    simulate(root, SimulateOptions(model=model, duration_s=600.0, seed=3), say_nothing)
    parameters = read_model(model)
    found = evaluate_model(root, parameters, (0, 600))
    mean, low, high = found.ceiling.of("S")
    assert low - 0.02 <= found.scores.S <= high + 0.02
    assert mean > 0.9
    zones = tuple(
        dataclasses.replace(zone, kappa_0=0.0, alpha=0.0, gamma={"walls": 0.05, "centre": 1.0})
        for zone in parameters.zones
    )
    other = evaluate_model(root, dataclasses.replace(parameters, zones=zones), (0, 600))
    assert low - 0.05 > other.scores.S


def test_a_fixed_model_does_not_mind_the_genes(make_trial):
    """It is what is judged, speeds and all."""
    opened = open_trial(make_trial())
    model = read_model(opened.trial.root / "models" / "000000.toml")
    group = FixedModel(arena=opened.arena, template=model, n_agents=3, n_fish=3)
    genes = np.random.default_rng(0).random((2, n_genes(2)))
    seeds = np.array([1], dtype=np.uint64)
    counts = group.with_template(model).simulate(genes, n_counted=3, n_steps=50, seeds=seeds)
    assert np.array_equal(counts.wall[0], counts.wall[1])


def test_a_span_makes_one_model_with_both_scores(tmp_path, make_trial, quick, heard, read_all):
    """On the held-out half before and after, each with its ceiling; no round of the trial."""
    root = make_trial()
    before = read_all(root)
    span = span_of(tmp_path)
    calibrate_span(root, span, quick, heard.append)
    result = read_result(span.output)
    assert result["held_out"]["window"] == "120:240"
    for name in ("before", "after"):
        assert 0 < result["held_out"][name]["S"] <= 1
        assert 0 < result["held_out"][name]["ceiling"] <= 1
    said = [event.text for event in heard if isinstance(event, Note)]
    after = result["held_out"]["after"]
    assert f"S {result['S']:.3f}, ceiling {result['ceiling']:.3f} (" in said[-3]
    assert said[-3].startswith("Window 0:120 s: ")
    assert said[-1].startswith(
        f"Held-out 120:240 s, after calibration: S {after['S']:.3f}, ceiling"
    )
    assert read_all(root) == before
    heard.clear()
    calibrate_span(root, span, quick, heard.append)
    assert [type(event) for event in heard] == [UpToDate]


def test_another_stretch_makes_it_stale(tmp_path, make_trial, quick, heard):
    """The reason says which option changed."""
    root = make_trial()
    calibrate_span(root, span_of(tmp_path, held_out=None), quick, heard.append)
    heard.clear()
    calibrate_span(root, span_of(tmp_path, train=(0, 180), held_out=None), quick, heard.append)
    reasons = [event.reason for event in heard if isinstance(event, Made)]
    assert reasons == ["input tracks/000120.parquet is new"]


def test_what_is_held_out_must_not_be_learnt_from(tmp_path):
    """Stretches that touch do not overlap."""
    span_of(tmp_path, train=(120, 240), held_out=(0, 120))
    with pytest.raises(InputError, match="overlap"):
        span_of(tmp_path, train=(0, 130), held_out=(120, 240))


def test_a_stretch_without_tracks_is_refused(tmp_path, make_trial, quick, heard):
    """The trial ends at 240 s."""
    with pytest.raises(InputError, match="no tracks from 600 s"):
        calibrate_span(make_trial(), span_of(tmp_path, train=(600, 900)), quick, heard.append)


def made_by(span, root, quick):
    """Return what a calibration says, and the model's result and lineage, fresh from its file."""
    heard = []
    calibrate_span(root, span, quick, heard.append)
    said = [event.text for event in heard if isinstance(event, Note)]
    return said, read_result(span.output), read_lineage(span.output).options


def test_a_window_is_cut_to_its_tracks(tmp_path, make_trial, quick):
    """The trial ends at 150 s: of a window to 600 s comes, by the byte, the model of 0:150."""
    root = make_trial(seconds=150)
    said, _, options = made_by(span_of(tmp_path, (0, 150), None), root, quick)
    whole = (tmp_path / "first.toml").read_bytes()
    assert [text.split(":")[0] for text in said] == ["Window 0"]
    assert (options["window"], options["window_s"]) == ("0:150", 150.0)
    (tmp_path / "first.toml").unlink()
    said, _, _ = made_by(span_of(tmp_path, (0, 600), None), root, quick)
    assert said[0].startswith("Window 0:600 s: there are tracks from 0 s to 150 s alone")
    assert said[1].startswith("Window 0:150 s: S ")
    assert (tmp_path / "first.toml").read_bytes() == whole
    assert made_by(span_of(tmp_path, (0, 150), None), root, quick)[0] == []


def test_a_held_out_stretch_is_cut_to_its_tracks(tmp_path, make_trial, quick):
    """What is judged to 600 s is what is judged to 150 s, where the trial ends."""
    root = make_trial(seconds=150)
    _, whole, _ = made_by(span_of(tmp_path, (0, 60), (60, 150)), root, quick)
    (tmp_path / "first.toml").unlink()
    said, cut, options = made_by(span_of(tmp_path, (0, 60), (60, 600)), root, quick)
    assert said[0].startswith("Held-out 60:600 s: there are tracks from 60 s to 150 s alone")
    assert cut["held_out"] == whole["held_out"]
    assert options["held_out"] == "60:150"


def test_a_ceiling_is_of_as_many_seconds_as_were_tracked(tmp_path, make_trial, quick):
    """Without the second minute, 0:150 has 90 s of tracks, and says so."""
    root = make_trial(seconds=150)
    (root / "tracks" / "000060.parquet").unlink()
    said, _, options = made_by(span_of(tmp_path, (0, 150), None), root, quick)
    assert said[0] == "Window 0:150 s: 60 s in between have no tracks; 90 s count."
    assert (options["window"], options["window_s"]) == ("0:150", 90.0)
    assert tracked_in(open_trial(root), (0, 150)).seconds == 90.0


def test_a_model_that_stated_another_length_of_its_window_stays(tmp_path, make_trial, quick):
    """Models of old state 120 s, whatever their window; where tracks cover it they are right."""
    root = make_trial(seconds=150)
    span = span_of(tmp_path, (0, 150), None)
    made_by(span, root, quick)
    text = span.output.read_text()
    assert "window_s = 150.0" in text
    span.output.write_text(text.replace("window_s = 150.0", "window_s = 120.0"))
    assert made_by(span, root, quick)[0] == []
