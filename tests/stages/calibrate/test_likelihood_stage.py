"""The likelihood estimate of a window: from its tracks into the round and the model file."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.models import read_model, read_model_for, read_result
from zfcal.artifacts.tables import read_tracks, write_tracks
from zfcal.calibrate.intervals import Interval, Intervals
from zfcal.diagnose.case import open_case
from zfcal.diagnose.question import Question
from zfcal.model.simulate import simulate_tracks
from zfcal.parameters import to_genes
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.calibrate.likelihood import Estimate, estimate
from zfcal.stages.calibrate.result import _intervals_table
from zfcal.stages.events import LeftOut, Note, say_nothing
from zfcal.stages.track_window import read_stretch
from zfcal.stages.trial_context import open_trial


def swim(root, seed=5):
    """Put fish that its own starting model drives in place of a trial's tracks."""
    opened = open_trial(root)
    trial = opened.trial
    model = read_model_for(root / trial.model, opened.arena, dt_s=trial.dt_s)
    xy, _ = simulate_tracks(model, opened.arena, n_agents=3, n_steps=1200, seed=seed)
    for start in range(0, 240, 60):
        path = root / "tracks" / f"{start:06d}.parquet"
        rows = read_tracks(path)
        part = xy[start * 5 : (start + 60) * 5].reshape(-1, 2)
        moved = replace(rows, x_m=part[:, 0].copy(), y_m=part[:, 1].copy())
        write_tracks(path, moved, read_lineage(path))
    return opened, model


def test_the_estimate_of_a_window_is_near_the_truth(make_trial):
    """Four minutes of three fish: concentrations of the centre within a fifth."""
    opened, model = swim(make_trial())

    found = estimate(opened, model, (0, 240), say_nothing)

    truth, centre = model.zones[-1], found.found.parameters.zones[-1]
    assert centre.kappa_0 == pytest.approx(truth.kappa_0, rel=0.2)
    assert centre.kappa_f == pytest.approx(truth.kappa_f, rel=0.2)
    assert found.genes.shape == (1, len(to_genes(model)))
    part = found.table["parameters"]["centre.kappa_0"]
    assert part["low"] < part["value"] < part["high"]
    assert part["identified"]


def test_what_joins_the_search_has_no_last_digits(make_trial):
    """Compiled code of two machines differs by some 1e-14: a search makes much of that."""
    opened, model = swim(make_trial())
    here = estimate(opened, model, (0, 240), say_nothing)

    zones = tuple(
        replace(zone, kappa_0=zone.kappa_0 * (1 + 1e-14), alpha=zone.alpha * (1 - 1e-14))
        for zone in here.found.parameters.zones
    )
    moved = replace(here.found, parameters=replace(here.found.parameters, zones=zones))
    there = Estimate(found=moved)

    assert (to_genes(moved.parameters) != to_genes(here.found.parameters)).any()
    assert np.array_equal(there.genes, here.genes)
    assert there.table["parameters"] == here.table["parameters"]


def test_a_published_gamma_has_the_interval_of_the_estimate_in_its_own_scale():
    """The centre is out of reach and has the largest published value: 0.5 of it is all of the row.

    The estimate says 0.4 to 0.8 of the largest that it knows, which is 0.2 to 0.4 beside 0.5.
    """
    parts = [
        Interval(name=name, value=value, low=0.0, high=1.0, identified=False)
        for name, value in (("a.kappa_0", 9.0), ("a.gamma.a", 0.5), ("a.gamma.b", 0.1),
                            ("a.gamma.c", 1.0))
    ]  # fmt: skip
    own = Intervals(parameters=tuple(parts), threshold=0.5, n_compatible=3, within_ceiling=True)
    found = {
        "a.kappa_0": {"low": 2.0, "high": 4.0, "identified": True},
        "a.gamma.a": {"low": 1.0, "high": 1.0, "identified": True},
        "a.gamma.b": {"low": 0.4, "high": 0.8, "identified": True},
        "a.gamma.c": {"low": 0.0, "high": 1.0, "identified": False},
    }
    result = SimpleNamespace(intervals=own)
    table = _intervals_table(result, {"parameters": found})
    assert table["by"] == "likelihood"
    assert {name: list(row.values()) for name, row in table["parameters"].items()} == {
        "a.kappa_0": [9.0, 2.0, 4.0, True],
        "a.gamma.a": [0.5, 0.5, 0.5, True],
        "a.gamma.b": [0.1, 0.2, 0.4, True],
        "a.gamma.c": [1.0, 0.0, 1.0, False],
    }
    without = _intervals_table(result, None)
    assert without["by"] == "score"
    assert list(without["parameters"]["a.kappa_0"].values()) == [9.0, 0.0, 1.0, False]


@pytest.mark.slow
def test_the_estimate_is_the_base_of_a_diagnosis_of_the_same_minutes(make_trial):
    """Where the base lies within a genome, the same numbers to a tenth of an interval."""
    opened, model = swim(make_trial())
    question = Question(
        samples=read_stretch(opened, (0, 240), say_nothing).samples,
        arena=opened.arena,
        model=model,
        noise_m=None,
        noise_source="",
        n_null=1,
        quick=True,
        seed=1,
        n_workers=1,
    )

    found = estimate(opened, model, (0, 240), say_nothing).found
    base = open_case(question).screen.fitted

    assert found.n_steps == base.used.sum()
    compared = 0
    for ours, theirs, x in zip(found.parameters.zones, base.parameters.zones, base.x, strict=True):
        if not (x[:3] < 1).all() or ours.name not in found.lapse:
            continue
        compared += 1
        assert found.lapse[ours.name] == pytest.approx(x[-1], abs=2e-3)
        for key in ("kappa_0", "kappa_f", "alpha"):
            low, high = found.interval[f"{ours.name}.{key}"]
            assert getattr(ours, key) == pytest.approx(getattr(theirs, key), abs=(high - low) / 10)
    assert compared > 0


def test_uncertain_positions_make_no_steps(make_trial):
    """A third of the rows thrown anywhere, with a confidence that says so: the same estimate."""
    root = make_trial()
    opened, model = swim(root)
    rng = np.random.default_rng(0)
    clean = estimate(opened, model, (0, 240), say_nothing).found
    for path in (root / "tracks").glob("*.parquet"):
        rows = read_tracks(path)
        bad = rng.random(len(rows)) < 0.1
        thrown = replace(
            rows,
            x_m=np.where(bad, rng.uniform(0.1, 0.9, len(rows)), rows.x_m),
            confidence=np.where(bad, 0.2, 1.0).astype(np.float32),
        )
        write_tracks(path, thrown, read_lineage(path))

    found = estimate(opened, model, (0, 240), say_nothing).found

    # Each lost position takes the three steps that touch it.
    assert 0.6 < found.n_steps / clean.n_steps < 0.8
    low, high = clean.interval["centre.kappa_0"]
    wide = high - low
    assert low - wide / 2 < found.parameters.zones[-1].kappa_0 < high + wide / 2


def test_the_robot_is_a_neighbour_but_not_a_sample(make_trial):
    """With a robot in the tank the fish alone make steps."""
    root = make_trial(n_fish=2, n_robots=1)
    opened = open_trial(root)
    model = read_model_for(root / opened.trial.model, opened.arena, dt_s=opened.trial.dt_s)

    found = estimate(opened, model, (0, 120), say_nothing)

    assert found.found.n_steps <= 2 * 600


@pytest.mark.slow
def test_calibrate_writes_the_estimate_and_reads_the_tracks(make_trial, in_full):
    """[result.likelihood] is there, and the window's segments are inputs."""
    root = make_trial()
    swim(root)
    analyse(root, AnalyseOptions(), say_nothing)

    calibrate(root, in_full, say_nothing)

    model = root / "models" / "000180.toml"
    assert read_result(model)["likelihood"]["n_steps"] > 500
    inputs = read_lineage(model).inputs
    assert {"tracks/000060.parquet", "tracks/000120.parquet"} <= set(inputs)
    assert "tracks/000000.parquet" not in inputs
    assert "guesses" not in read_lineage(model).options


@pytest.mark.slow
def test_the_estimate_itself_is_handed_on_where_that_is_asked_for(make_trial, in_full):
    """The model file has its parameters, says so, and is made anew for it."""
    root = make_trial()
    swim(root)
    analyse(root, AnalyseOptions(), say_nothing)
    settings = replace(in_full.settings, champion="likely", n_windows=40)
    likely = replace(in_full, settings=settings)

    calibrate(root, likely, say_nothing)

    model = root / "models" / "000180.toml"
    result = read_result(model)
    assert result["champion"] == "likely"
    told = result["likelihood"]["parameters"]
    for zone in read_model(model).zones:
        assert zone.kappa_0 == pytest.approx(told[f"{zone.name}.kappa_0"]["value"])
        assert zone.alpha == pytest.approx(told[f"{zone.name}.alpha"]["value"])
    assert read_lineage(model).options["champion"] == "likely"

    calibrate(root, replace(in_full, settings=replace(settings, champion="score")), say_nothing)

    assert read_result(model)["champion"] == "score"
    assert "champion" not in read_lineage(model).options


def test_the_papers_way_reads_no_tracks(make_trial, quick):
    """Without the estimate: no table, no segments among the inputs, another lineage."""
    root = make_trial()
    analyse(root, AnalyseOptions(), say_nothing)

    calibrate(root, quick, say_nothing)

    model = root / "models" / "000120.toml"
    assert "likelihood" not in read_result(model)
    assert not any("tracks" in name for name in read_lineage(model).inputs)
    assert read_lineage(model).options["seed_likelihood"] is False


def test_without_tracks_the_round_goes_on_and_says_so(make_trial, in_full, heard):
    """Another computer may have the statistics alone."""
    root = make_trial()
    analyse(root, AnalyseOptions(), say_nothing)
    for path in (root / "tracks").glob("*.parquet"):
        path.unlink()

    calibrate(root, in_full, heard.append)

    assert (root / "models" / "000240.toml").exists()
    notes = [event.text for event in heard if isinstance(event, Note)]
    assert any("no tracks, so no likelihood estimate" in text for text in notes)


def test_a_damaged_segment_costs_the_estimate_alone(make_trial, in_full, heard):
    """The statistics were whole: the round is made, without the estimate, and exit code 3 tells."""
    root = make_trial()
    analyse(root, AnalyseOptions(), say_nothing)
    path = root / "tracks" / "000060.parquet"
    path.write_bytes(path.read_bytes()[:1000])

    calibrate(root, in_full, heard.append)

    left_out = [event.problem for event in heard if isinstance(event, LeftOut)]
    assert any("000060.parquet" in text and "no likelihood estimate" in text for text in left_out)
    assert (root / "models" / "000120.toml").exists()
