"""From statistics to models, round by round."""

import dataclasses
import json
import shutil
import tomllib

import numpy as np
import pytest

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.lock import lock
from zfcal.artifacts.models import read_model, read_result, write_model
from zfcal.artifacts.tables import read_extra, read_table, write_table
from zfcal.behaviour.rows import scores_from_rows
from zfcal.errors import InputError, LockedError, StorageError
from zfcal.parameters import to_genes
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.calibrate.rounds import RoundPlaces, read_control, read_previous
from zfcal.stages.calibrate.searching import CalibrateOptions
from zfcal.stages.events import (
    LeftOut,
    Made,
    Note,
    Planned,
    Progress,
    Result,
    UpToDate,
    say_nothing,
)
from zfcal.stages.trial_context import Task


class Killed(BaseException):
    """What a test throws into a round, as a power cut would."""


@pytest.fixture(scope="module")
def analysed(analyse_once):
    """Return a trial of 4 minutes with its statistics, which nobody changes."""
    return analyse_once(240)


@pytest.fixture
def trial(analysed, tmp_path):
    """Return a copy of that trial."""
    return shutil.copytree(analysed, tmp_path / "trial")


def made_of(events):
    """Return the names of the files that were made."""
    return [event.path.name for event in events if isinstance(event, Made)]


def with_settings(options, **changes):
    """Return the options with other settings of a round."""
    settings = dataclasses.replace(options.settings, **changes)
    return dataclasses.replace(options, settings=settings)


def with_budget(options, budget_s):
    """Return the options with a budget instead of generations."""
    settings = dataclasses.replace(options.settings, generations=None)
    return dataclasses.replace(options, settings=settings, budget_s=budget_s)


def test_every_window_gets_a_model_a_population_and_scores(trial, quick, heard):
    """The model is last, so that whoever finds it finds the others."""
    calibrate(trial, quick, heard.append)
    per_window = [["{0}.parquet", "{0}-model.parquet", "{0}.toml"]] * 3
    wanted = [
        name.format(end)
        for end, names in zip(("000120", "000180", "000240"), per_window, strict=True)
        for name in names
    ]
    assert made_of(heard) == wanted
    assert read_model(trial / "models" / "000240.toml").zone_names == ("walls", "centre")


def test_the_score_of_a_model_stands_with_its_ceiling(trial, quick, heard):
    """In the scores and in the model file, the same numbers."""
    calibrate(trial, quick, heard.append)
    table = read_table(trial / "scores" / "000120-model.parquet", "zfcal.scores/1").to_pydict()
    (scores, ceiling) = scores_from_rows(table)[120, "model-vs-control"]
    result = read_result(trial / "models" / "000120.toml")
    assert result["S"] == pytest.approx(scores.S)
    assert result["ceiling"] == pytest.approx(ceiling.of("S")[0])
    assert result["against_ceiling"] == pytest.approx(scores.S / ceiling.of("S")[0])
    assert (result["n_windows"], result["generations"]) == (4, 3)
    told = [event.value for event in heard if isinstance(event, Result)]
    assert told[0]["S"] == pytest.approx(scores.S)


def test_the_model_draws_the_speeds_that_were_measured(trial, quick, heard):
    """Speeds are measured, not calibrated."""
    calibrate(trial, quick, heard.append)
    counts = read_control(trial / "stats" / "000120.parquet", ("walls", "centre")).speed
    zones = read_model(trial / "models" / "000120.toml").zones
    for zone, own in zip(zones, counts, strict=True):
        assert zone.speed_frequency == pytest.approx(own / own.sum())


@pytest.mark.slow
def test_each_round_starts_from_the_one_before(trial, in_full, heard):
    """Its population is an input of the next, and comes back from the file as it was."""
    calibrate(trial, in_full, heard.append)
    first, second = (read_lineage(trial / "models" / f"{end}.toml") for end in ("000120", "000180"))
    assert set(first.inputs) == {
        "models/000000.toml",
        "stats/000120.parquet",
        "arena.geojson",
        "tracks/000000.parquet",
        "tracks/000060.parquet",
    }
    assert set(second.inputs) - set(first.inputs) == {
        "models/000120.parquet",
        "stats/000180.parquet",
        "tracks/000120.parquet",
    }
    path = trial / "models" / "000120.parquet"
    previous = read_previous(path)
    table = read_table(path, "zfcal.population/1").to_pydict()
    assert previous.genes.tolist() == table["genes"]
    assert previous.scores.tolist() == table["S"]
    champion = to_genes(read_model(trial / "models" / "000120.toml"))
    assert previous.champion[:6] == pytest.approx(champion[:6])
    assert len(read_extra(path)["gene_names"]) == previous.genes.shape[1] == 10


def test_the_second_run_does_nothing(trial, quick, heard, read_all):
    """Whatever the number of workers."""
    calibrate(trial, quick, heard.append)
    before = read_all(trial)
    heard.clear()
    calibrate(trial, dataclasses.replace(quick, n_workers=1), heard.append)
    assert made_of(heard) == []
    assert sum(isinstance(event, UpToDate) for event in heard) == 9
    assert read_all(trial) == before


@pytest.mark.parametrize("workers", [1, 3])
def test_the_bytes_do_not_depend_on_the_workers(trial, copy_trial, quick, read_all, workers):
    """The same seed, the same numbers."""
    other = copy_trial(trial, "other")
    calibrate(trial, quick, say_nothing)
    calibrate(other, dataclasses.replace(quick, n_workers=workers), say_nothing)
    assert read_all(other) == read_all(trial)


def test_another_seed_gives_other_models(trial, quick, heard):
    """The trial's own seed is 1; asking for it changes nothing."""
    calibrate(trial, quick, heard.append)
    heard.clear()
    calibrate(trial, dataclasses.replace(quick, seed=1), heard.append)
    assert made_of(heard) == []
    before = read_model(trial / "models" / "000120.toml")
    calibrate(trial, dataclasses.replace(quick, seed=2), heard.append)
    assert heard[-2].value["seed"] == 2
    assert read_model(trial / "models" / "000120.toml") != before


def test_changed_statistics_make_their_round_and_all_later_ones_stale(trial, quick, heard):
    """A round that was warm-started from other numbers is another round."""
    calibrate(trial, quick, heard.append)
    other = trial / "stats" / "000240.parquet"
    # Of another window, but whole.
    (trial / "stats" / "000180.parquet").write_bytes(other.read_bytes())
    heard.clear()
    calibrate(trial, quick, heard.append)
    reasons = {event.path.name: event.reason for event in heard if isinstance(event, Made)}
    assert reasons["000180.toml"] == "input stats/000180.parquet changed"
    assert reasons["000240.toml"] == "input models/000180.parquet changed"
    assert "000120.toml" not in reasons


def test_a_dry_run_knows_that_later_rounds_follow(trial, quick, heard):
    """One round is planned, so those that start from it are."""
    calibrate(trial, quick, heard.append)
    (trial / "models" / "000180.toml").unlink()
    heard.clear()
    calibrate(trial, quick, heard.append, task=Task(dry_run=True))
    planned = {event.path.name: event.reason for event in heard if isinstance(event, Planned)}
    assert planned["000180.toml"] == "missing"
    assert planned["000240.toml"] == "the round before it is made again"
    assert "000120.toml" not in planned


def test_more_generations_make_it_stale_and_a_budget_does_not(trial, quick, heard):
    """The artifact records the generations that were run, not the budget."""
    calibrate(trial, quick, heard.append)
    heard.clear()
    calibrate(trial, with_budget(quick, 60.0), heard.append)
    assert made_of(heard) == []
    calibrate(trial, with_settings(quick, generations=4), heard.append)
    reasons = [event.reason for event in heard if isinstance(event, Made)]
    assert reasons[0] == "option generations: 3 -> 4"
    assert len(reasons) == 9


@pytest.mark.slow
def test_a_round_with_a_budget_repeats_with_its_generations(
    trial, copy_trial, quick, heard, read_all
):
    """Bit by bit, with --generations as the artifact says."""
    other = copy_trial(trial, "other")
    for root in (trial, other):
        for name in ("000180.parquet", "000240.parquet"):
            (root / "stats" / name).unlink()
    calibrate(trial, with_budget(quick, 1.0), heard.append)
    n = read_result(trial / "models" / "000120.toml")["generations"]
    calibrate(other, with_settings(quick, generations=n), heard.append)
    assert read_all(other) == read_all(trial)


@pytest.mark.parametrize("generation", [0, 2])
def test_a_killed_round_goes_on_and_ends_in_the_same_bytes(
    trial, copy_trial, quick, heard, read_all, generation
):
    """Killed after a generation, it does not breed that one again."""
    whole = copy_trial(trial, "whole")
    calibrate(whole, quick, say_nothing)

    def kill(event):
        if isinstance(event, Progress) and event.stage != "rounds" and event.done == generation:
            raise Killed

    with pytest.raises(Killed):
        calibrate(trial, quick, kill)
    assert (trial / "models" / ".000120.checkpoint").exists()
    calibrate(trial, quick, heard.append)
    bred = [e.done for e in heard if isinstance(e, Progress) and e.stage == "window to 120 s"]
    assert bred == list(range(generation + 1, 4))
    assert read_all(trial) == read_all(whole)
    assert not list((trial / "models").glob(".*checkpoint"))


def test_a_round_killed_while_it_wrote_ends_in_the_same_bytes(
    trial, copy_trial, quick, heard, read_all
):
    """Half a generation at the checkpoint's end is bred again."""
    whole = copy_trial(trial, "whole")
    calibrate(whole, quick, say_nothing)

    def kill(event):
        if isinstance(event, Progress) and event.stage != "rounds" and event.done == 2:
            raise Killed

    with pytest.raises(Killed):
        calibrate(trial, quick, kill)
    checkpoint = trial / "models" / ".000120.checkpoint"
    checkpoint.write_bytes(checkpoint.read_bytes()[:-1000])
    calibrate(trial, quick, heard.append)
    bred = [e.done for e in heard if isinstance(e, Progress) and e.stage == "window to 120 s"]
    assert bred == [2, 3]
    assert read_all(trial) == read_all(whole)


def test_a_checkpoint_of_another_round_is_not_taken(trial, copy_trial, quick, read_all):
    """Nor one that is damaged, or farther than is asked for."""

    def kill(event):
        if isinstance(event, Progress) and event.done == 2 and event.stage != "rounds":
            raise Killed

    with pytest.raises(Killed):
        calibrate(trial, quick, kill)
    for number, options in enumerate(
        (dataclasses.replace(quick, seed=5), with_settings(quick, generations=1))
    ):
        root, fresh = copy_trial(trial, f"root{number}"), copy_trial(trial, f"fresh{number}")
        (fresh / "models" / ".000120.checkpoint").write_bytes(b"cut")
        calibrate(root, options, say_nothing)
        calibrate(fresh, options, say_nothing)
        assert read_all(root) == read_all(fresh)


def test_damaged_statistics_are_left_out_and_the_rest_goes_on(trial, quick, heard):
    """The round after starts from the last one that there is."""
    (trial / "stats" / "000180.parquet").write_bytes(b"PAR1")
    calibrate(trial, quick, heard.append)
    left_out = [event for event in heard if isinstance(event, LeftOut)]
    assert [event.path.name for event in left_out] == ["000180.parquet"]
    assert left_out[0].damaged
    inputs = read_lineage(trial / "models" / "000240.toml").inputs
    assert "models/000120.parquet" in inputs


def test_a_window_asked_for_makes_the_rounds_before_it_too(trial, copy_trial, quick, read_all):
    """What a pipe asks for one by one, or the last alone, ends in the same bytes."""
    last, each = copy_trial(trial, "last"), copy_trial(trial, "each")
    calibrate(trial, quick, say_nothing)
    calibrate(last, quick, say_nothing, task=Task(ends_s=frozenset({240})))
    for end in (120, 180, 240):
        calibrate(each, quick, say_nothing, task=Task(ends_s=frozenset({end})))
    assert read_all(last) == read_all(trial)
    assert read_all(each) == read_all(trial)


def test_stale_statistics_are_told(trial, quick, heard, wandering):
    """Calibrate does not analyse; it says that somebody should."""
    (trial / "tracks" / "000000.parquet").write_bytes(
        (trial / "tracks" / "000060.parquet").read_bytes()
    )
    calibrate(trial, quick, heard.append)
    notes = [event.text for event in heard if isinstance(event, Note) and event.warning]
    assert any("tracks/000000.parquet has changed since" in text for text in notes)


def test_without_statistics_the_command_to_run_first_is_named(make_trial, quick, heard):
    """Nothing to do is no error."""
    calibrate(make_trial(), quick, heard.append)
    assert "zfcal analyse" in heard[0].text


def test_baselines_stand_beside_the_score(trial, quick, heard):
    """The first round has no last window; the second does."""
    calibrate(trial, dataclasses.replace(quick, baselines=True), heard.append)
    first, second = (read_result(trial / "models" / f"{end}.toml") for end in ("000120", "000180"))
    assert set(first["baselines"]) == {"random_search"}
    assert set(second["baselines"]) == {"random_search", "last_window_unchanged"}
    assert all(0 <= value <= 1 for value in second["baselines"].values())


def test_a_model_file_is_toml_with_an_interval_per_parameter(trial, quick, heard):
    """Ten numbers for two zones, each within its interval."""
    calibrate(trial, quick, heard.append)
    document = tomllib.loads((trial / "models" / "000120.toml").read_text())
    parameters = document["result"]["intervals"]["parameters"]
    assert len(parameters) == 10
    assert all(part["low"] <= part["value"] <= part["high"] for part in parameters.values())
    assert len(document["result"]["hypervolume"]) == 4


def test_a_window_without_fish_is_left_out_but_not_damaged(make_trial, quick, heard):
    """Everybody is outside a tank that lies elsewhere."""
    root = make_trial(seconds=120)
    arena = root / "arena.geojson"
    document = json.loads(arena.read_text())
    ring = document["features"][0]["geometry"]["coordinates"][0]
    document["features"][0]["geometry"]["coordinates"] = [[[x + 3, y] for x, y in ring]]
    arena.write_text(json.dumps(document))
    analyse(root, AnalyseOptions(), heard.append)
    heard.clear()
    calibrate(root, quick, heard.append)
    left_out = [event for event in heard if isinstance(event, LeftOut)]
    assert [event.damaged for event in left_out] == [False]
    assert not (root / "models" / "000120.toml").exists()


def test_one_calibrate_at_a_time(trial, quick, heard):
    """The second one is refused; a dry run needs no lock."""
    with lock(trial, "calibrate"):
        with pytest.raises(LockedError):
            calibrate(trial, quick, heard.append)
        calibrate(trial, quick, heard.append, task=Task(dry_run=True))


@pytest.mark.parametrize("budget", [0.0, -1.0, float("nan")])
def test_a_budget_is_a_positive_time(budget):
    """And stands instead of generations, not beside them."""
    with pytest.raises(InputError):
        CalibrateOptions(budget_s=budget)


def test_a_budget_and_generations_contradict(quick):
    """Which of the two would end the round?"""
    with pytest.raises(InputError, match="not with both"):
        dataclasses.replace(quick, budget_s=5.0)


def test_places_by_hand(tmp_path):
    """The files of the round of the window to 120 s."""
    places = RoundPlaces(root=tmp_path, end_s=120)
    made = [path.relative_to(tmp_path).as_posix() for path, _ in places.artifacts("score")]
    assert made == ["models/000120.parquet", "scores/000120-model.parquet", "models/000120.toml"]
    made = [path.relative_to(tmp_path).as_posix() for path, _ in places.artifacts("forward")]
    assert made == [
        "models/000120.parquet",
        "scores/000120-model.parquet",
        "scores/000120-rules.parquet",
        "models/000120.toml",
    ]
    assert places.checkpoint.name == ".000120.checkpoint"
    assert np.isfinite(places.end_s)


def test_what_a_round_writes_makes_no_trial_that_was_moved_away(trial, quick):
    """Its population and its model: an error, and no folder where it was."""
    calibrate(trial, quick, say_nothing)
    population, model = (trial / "models" / f"000120{ending}" for ending in (".parquet", ".toml"))
    table, lineage = read_table(population, "zfcal.population/1"), read_lineage(population)
    parameters, origin = read_model(model), read_lineage(model)
    trial.rename(trial.with_name("away"))
    for write in (
        lambda: write_table(population, table, lineage),
        lambda: write_model(model, parameters, origin, parents=False),
    ):
        with pytest.raises(StorageError, match="cannot be written"):
            write()
    assert not trial.exists()


def test_other_features_have_a_score_that_is_not_s(trial, quick, heard):
    """It stands under a name of its own with what it is of; S in the scores is of the four."""
    analyse(trial, AnalyseOptions(features=("curvature",)), say_nothing)
    named = with_settings(quick, features=("D", "W", "O", "T", "curvature"))
    calibrate(trial, named, heard.append, task=Task(ends_s=frozenset({120})))

    result = read_result(trial / "models" / "000120.toml")
    table = read_table(trial / "scores" / "000120-model.parquet", "zfcal.scores/1").to_pydict()
    scores, ceiling = scores_from_rows(table)[120, "model-vs-control"]
    assert result["score"]["of"] == ["D", "W", "O", "T", "curvature"]
    assert set(result["score"]["similarities"]) == set(result["score"]["of"])
    assert (result["S"], result["ceiling"]) == pytest.approx((scores.S, ceiling.of("S")[0]))
    assert result["score"]["value"] != pytest.approx(result["S"])
    assert "optimiser_score" in result
    assert "optimiser_S" not in result
    lineage = read_lineage(trial / "models" / "000120.toml")
    assert lineage.options["features"] == ["D", "W", "O", "T", "curvature"]

    path = trial / "models" / "000120.parquet"
    population, extra = read_table(path, "zfcal.population/1"), read_extra(path)
    assert set(population.column("S").to_pylist()) == {None}
    assert extra["features"] == result["score"]["of"]
    previous = read_previous(path, ("D", "W", "O", "T", "curvature"))
    assert previous.scores.tolist() == extra["score"]
    assert np.isnan(read_previous(path).scores).all()


def test_a_round_on_other_features_starts_from_any_population(trial, quick, heard):
    """From one of S it takes the genomes and not the scores."""
    calibrate(trial, quick, heard.append, task=Task(ends_s=frozenset({120})))
    path = trial / "models" / "000120.parquet"
    assert not np.isnan(read_previous(path).scores).any()
    assert np.isnan(read_previous(path, ("D", "curvature")).scores).all()


def test_statistics_without_a_feature_that_is_named_are_left_out(trial, quick, heard):
    """With the command that counts it; what is there stays."""
    named = with_settings(quick, features=("D", "residence", "spread"))
    calibrate(trial, named, heard.append)
    (first, *_) = [event for event in heard if isinstance(event, LeftOut)]
    assert "holds no residence, spread" in first.problem
    assert first.hint == f"Count it first: zfcal analyse {trial} --features residence,spread"
    assert made_of(heard) == []


def test_the_four_by_name_change_nothing(trial, quick, heard):
    """A model that was made without naming them is up to date."""
    calibrate(trial, quick, heard.append)
    heard.clear()
    calibrate(trial, with_settings(quick, features=("T", "W", "O", "D")), heard.append)
    assert made_of(heard) == []
