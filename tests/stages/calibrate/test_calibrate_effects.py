"""Calibration of a model with effects: its estimate, its rounds, and the model that is named."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest

from zfcal.artifacts.lineage import Lineage, read_lineage
from zfcal.artifacts.models import read_model, read_model_for, read_result, write_model
from zfcal.artifacts.tables import read_extra, read_tracks, write_tracks
from zfcal.errors import InputError
from zfcal.model.effects.genome import genome_names
from zfcal.model.simulate import simulate_tracks
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.calibrate.holdout import Span, calibrate_span
from zfcal.stages.calibrate.likelihood import estimate, memory_span, remembered
from zfcal.stages.events import Made, Planned, UpToDate, say_nothing
from zfcal.stages.trial_context import Task, open_trial

pytestmark = pytest.mark.slow

TRUTH = {"turning-bias": {"strength": 1.0}, "burst-and-coast": {"exponent": 0.4}}
START = {"turning-bias": {"strength": 0.3}, "burst-and-coast": {"exponent": 0.2}}


@pytest.fixture(scope="module")
def swum(made_once, tmp_path_factory):
    """Return a trial of 4 minutes of fish that turn to the left, and swim in bursts."""
    root = tmp_path_factory.mktemp("swum") / "trial"
    shutil.copytree(made_once(240, 3, 0, 1), root)
    opened = open_trial(root)
    truth = replace(start_of(root), effects=TRUTH)
    xy, _ = simulate_tracks(truth, opened.arena, n_agents=3, n_steps=1200, seed=5)
    for start in range(0, 240, 60):
        path = root / "tracks" / f"{start:06d}.parquet"
        rows = read_tracks(path)
        part = xy[start * 5 : (start + 60) * 5].reshape(-1, 2)
        moved = replace(rows, x_m=part[:, 0].copy(), y_m=part[:, 1].copy())
        write_tracks(path, moved, read_lineage(path))
    analyse(root, AnalyseOptions(), say_nothing)
    return root


@pytest.fixture
def trial(swum, tmp_path):
    """Return a copy of that trial with an extended model, too weak."""
    copy = shutil.copytree(swum, tmp_path / "trial")
    extend(copy, START)
    return copy


def start_of(root):
    """Return a trial's starting model."""
    opened = open_trial(root)
    return read_model_for(root / opened.trial.model, opened.arena, dt_s=opened.trial.dt_s)


def extend(root, effects):
    """Write the starting model with effects; return where it is."""
    path = root / "models" / "extended.toml"
    model = replace(start_of(root), effects=effects)
    write_model(path, model, Lineage(schema="zfcal.model/1", command="extend"))
    return path


def of(options, trial, **settings):
    """Return options that calibrate the extended model."""
    return replace(
        options,
        model=trial / "models" / "extended.toml",
        settings=replace(options.settings, **settings),
    )


def made_of(events):
    """Return the names of the files that were made."""
    return [event.path.name for event in events if isinstance(event, Made)]


def test_the_estimate_of_a_window_has_the_strengths(trial):
    """Of a tilt and of an effect on speed: within their intervals, which the table has."""
    model = read_model(trial / "models" / "extended.toml")

    found = estimate(open_trial(trial), model, (0, 240), say_nothing)

    table = found.table["parameters"]
    for pair, truth, wide in (
        ("turning-bias.strength", 1.0, 0.5),
        ("burst-and-coast.exponent", 0.4, 0.2),
    ):
        part = table[pair]
        assert part["low"] <= truth <= part["high"]
        assert part["low"] < part["value"] < part["high"]
        assert part["high"] - part["low"] < wide
        assert part["identified"]
    assert set(table) == set(genome_names(model))
    assert found.genes.shape == (1, len(genome_names(model)))
    assert found.genes[0, -1] == pytest.approx(
        (table["burst-and-coast.exponent"]["value"] + 1.5) / 3
    )


def test_a_strength_that_stops_fish_is_estimated(trial):
    """Freezing is a chain of two states: its rate moves, the mean length of a rest stays."""
    model = replace(start_of(trial), effects={"freezing": {"rate_per_s": 0.1, "duration_s": 2.0}})

    found = estimate(open_trial(trial), model, (0, 240), say_nothing)

    own = found.found.parameters.effects["freezing"]
    assert own["duration_s"] == 2.0
    assert own["rate_per_s"] < 0.02
    low, high = found.found.interval["freezing.rate_per_s"]
    assert 0.0 <= low <= own["rate_per_s"] <= high


def test_the_estimate_over_all_minutes_has_the_strengths_too(trial):
    """That of an effect on speed as well, which no heading shows."""
    model = read_model(trial / "models" / "extended.toml")

    genes = remembered(open_trial(trial), model, 240, memory_span(240))

    bias, exponent = -4.0 + 8.0 * genes[-2], -1.5 + 3.0 * genes[-1]
    assert bias == pytest.approx(1.0, abs=0.25)
    assert exponent == pytest.approx(0.4, abs=0.1)


@pytest.mark.parametrize("champion", ["score", "likely", "forward"])
def test_numbered_models_carry_the_effects(trial, in_full, champion):
    """Each of them, with strengths of its own; populations name their genes."""
    calibrate(trial, of(in_full, trial, champion=champion), say_nothing)

    strengths = []
    for end in ("000120", "000180", "000240"):
        effects = read_model(trial / "models" / f"{end}.toml").effects
        assert list(effects) == ["turning-bias", "burst-and-coast"]
        assert effects["burst-and-coast"].get("usual_m_s", 0.07) == 0.07
        strengths.append(effects["turning-bias"]["strength"])
        names = read_extra(trial / "models" / f"{end}.parquet")["gene_names"]
        assert names[-2:] == ["turning-bias.strength", "burst-and-coast.exponent"]
        told = read_result(trial / "models" / f"{end}.toml")["likelihood"]["parameters"]
        assert told["turning-bias.strength"]["identified"]
    assert START["turning-bias"]["strength"] not in strengths


def test_the_likely_model_has_the_likely_strengths(trial, in_full):
    """Where the estimate is handed on, its strengths drive."""
    calibrate(trial, of(in_full, trial, champion="likely", n_windows=40), say_nothing)

    model = trial / "models" / "000120.toml"
    result, effects = read_result(model), read_model(model).effects
    if result["champion"] != "likely":
        pytest.fail(f"the estimate was not handed on: S is {result['S']}")
    told = result["likelihood"]["parameters"]
    for name, key in (("turning-bias", "strength"), ("burst-and-coast", "exponent")):
        assert effects[name][key] == pytest.approx(told[f"{name}.{key}"]["value"])


def test_the_models_that_calibrate_makes_can_be_calibrated_and_driven(trial, quick):
    """A numbered model with effects is a model like any other."""
    calibrate(trial, of(quick, trial), say_nothing)
    numbered = trial / "models" / "000240.toml"
    again = replace(quick, model=numbered)

    calibrate(trial, again, say_nothing, task=Task(ends_s=frozenset({120})))

    assert "models/000240.toml" in read_lineage(trial / "models" / "000120.toml").inputs


def test_the_named_model_is_an_input_and_a_changed_one_makes_rounds_stale(trial, quick, heard):
    """In place of the trial's own; run again there is nothing to do."""
    options = of(quick, trial)
    calibrate(trial, options, say_nothing)
    inputs = read_lineage(trial / "models" / "000120.toml").inputs
    assert "models/extended.toml" in inputs
    assert "models/000000.toml" not in inputs

    calibrate(trial, options, heard.append)
    assert not made_of(heard)
    assert len([event for event in heard if isinstance(event, UpToDate)]) == 9

    heard.clear()
    extend(trial, {**START, "turning-bias": {"strength": 0.31}})
    calibrate(trial, options, heard.append, task=Task(dry_run=True))
    planned = [event for event in heard if isinstance(event, Planned)]
    assert "models/extended.toml" in planned[0].reason
    assert len(planned) == 9

    heard.clear()
    calibrate(trial, options, heard.append)
    assert made_of(heard)[2::3] == ["000120.toml", "000180.toml", "000240.toml"]


def test_the_trials_own_model_is_calibrated_without_it(trial, quick, heard):
    """The extended one in the same folder says nothing; naming it makes the rounds anew."""
    calibrate(trial, quick, say_nothing)
    assert read_model(trial / "models" / "000240.toml").effects == {}
    calibrate(trial, of(quick, trial), heard.append)
    assert len(made_of(heard)) == 9
    assert list(read_model(trial / "models" / "000240.toml").effects) == list(START)


@pytest.mark.parametrize("champion", ["score", "forward"])
@pytest.mark.parametrize(
    "effects",
    [{}, {"alignment": {}, "burst-and-coast": {}}, {"burst-and-coast": {}}],
    ids=["none", "others", "fewer"],
)
def test_what_rounds_of_other_effects_left_is_not_taken_over(trial, in_full, champion, effects):
    """Neither their population nor the models of their rules: genes would mean something else."""
    extend(trial, effects)
    task = Task(ends_s=frozenset({120}))
    calibrate(trial, of(in_full, trial, champion=champion), say_nothing, task=task)
    extend(trial, START)
    later = Task(ends_s=frozenset({180}))

    calibrate(trial, of(in_full, trial, champion=champion), say_nothing, task=later)

    result = read_result(trial / "models" / "000180.toml")
    assert list(read_model(trial / "models" / "000180.toml").effects) == list(START)
    assert read_extra(trial / "models" / "000180.parquet")["gene_names"][-2:] == [
        "turning-bias.strength",
        "burst-and-coast.exponent",
    ]
    if champion == "forward":
        extra = read_extra(trial / "scores" / "000180-rules.parquet")
        assert extra["n_rounds"] == 1
        assert {len(model["genes"]) for model in extra["models"]} == {12}
        assert result["published"]["because"] == "no window has followed a model yet"


@pytest.mark.parametrize(("strength", "n_rounds"), [(None, 2), (0.31, 1)])
def test_the_record_goes_on_where_the_model_is_the_same(trial, in_full, strength, n_rounds):
    """One whose file has changed swims otherwise than those that were judged."""
    forward = of(in_full, trial, champion="forward")
    calibrate(trial, forward, say_nothing, task=Task(ends_s=frozenset({120})))
    if strength is not None:
        extend(trial, {**START, "turning-bias": {"strength": strength}})
    calibrate(trial, forward, say_nothing, task=Task(ends_s=frozenset({180})))
    assert read_extra(trial / "scores" / "000180-rules.parquet")["n_rounds"] == n_rounds
    population = read_lineage(trial / "models" / "000180.parquet")
    assert "models/000120.parquet" in population.inputs


def test_a_pooled_stretch_is_calibrated_with_the_named_model(trial, quick, tmp_path):
    """The model before is the named one."""
    out = tmp_path / "half.toml"
    span = Span(train_s=(0, 120), held_out_s=(120, 240), output=out)
    calibrate_span(trial, span, of(quick, trial), say_nothing)
    assert list(read_model(out).effects) == list(START)
    assert any("extended.toml" in name for name in read_lineage(out).inputs)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("turning-bias", "turning-bia"), "extended.toml: There is no effect 'turning-bia'"),
        (("strength = 0.3", "strength = 9.0"), "extended.toml: Effect 'turning-bias': strength"),
        (("dt_s = 0.2", "dt_s = 0.1"), "extended.toml: the model holds for dt_s = 0.1 s"),
    ],
)
def test_a_named_model_that_is_none_is_refused_at_once(trial, in_full, change, says):
    """By its name, before anything is made."""
    path = trial / "models" / "extended.toml"
    text = path.read_text()
    assert change[0] in text
    path.write_text(text.replace(*change))
    with pytest.raises(InputError, match=says.replace("(", "\\(")):
        calibrate(trial, of(in_full, trial), say_nothing)
    assert not list((trial / "scores").glob("*-model.parquet"))


def test_workers_do_not_change_a_model_with_effects(trial, copy_trial, in_full, read_all):
    """The same bytes from one and from two."""
    other = copy_trial(trial, "other")
    task = Task(ends_s=frozenset({120}))
    for root, n_workers in ((trial, 1), (other, 2)):
        calibrate(root, replace(of(in_full, root), n_workers=n_workers), say_nothing, task=task)
    assert read_all(trial) == read_all(other)
    assert np.isfinite(read_result(trial / "models" / "000120.toml")["S"])
