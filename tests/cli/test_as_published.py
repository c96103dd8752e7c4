"""`zfcal calibrate --as-published`: the paper's way, and each deviation from it as an option."""

import tomllib

import pyarrow.parquet as pq
import pytest

QUICK = ("--generations", "1", "--population", "4", "--steps", "20")
WAY = {
    "optimiser": "deap",
    "seed_likelihood": False,
    "n_confirmed": 0,
    "diversity": "population",
    "renews": False,
}


@pytest.fixture
def analysed(zfcal, trial):
    """Return a trial of two windows with its statistics."""
    assert zfcal("analyse", "trial").code == 0
    return trial


def model_of(trial):
    """Return the first round's model file."""
    return tomllib.loads((trial / "models" / "000120.toml").read_text())


def test_one_word_stands_for_all_of_the_papers_way(zfcal, analysed):
    """Lineage states each of them, and none where the defaults are kept."""
    assert zfcal("calibrate", "trial", "--as-published", *QUICK).code == 0
    said = model_of(analysed)["lineage"]["options"]
    assert WAY.items() <= said.items()
    assert "sampler" not in said
    assert "champion" not in said
    assert not (analysed / "scores" / "000120-rules.parquet").exists()


def test_the_score_is_the_searchs_own(zfcal, analysed):
    """The best S of the last population is the S that is reported."""
    assert zfcal("calibrate", "trial", "--as-published", *QUICK).code == 0
    population = pq.read_table(analysed / "models" / "000120.parquet")
    best = max(population.column("S").to_pylist())
    scores = pq.read_table(analysed / "scores" / "000120-model.parquet").to_pylist()
    (reported,) = (row["value"] for row in scores if row["feature"] == "S")
    assert reported == best
    assert model_of(analysed)["result"]["optimiser_S"] == best


@pytest.mark.slow
def test_an_option_given_beside_it_counts(zfcal, analysed):
    """One deviation at a time can be measured."""
    words = ("--as-published", "--renewal", "--confirm", "2", "--sampler", "grid")
    assert zfcal("calibrate", "trial", *words, *QUICK).code == 0
    said = model_of(analysed)["lineage"]["options"]
    assert "renews" not in said
    assert (said["n_confirmed"], said["sampler"]) == (2, "grid")
    assert said["optimiser"] == "deap"


def test_its_parts_make_the_same_file(zfcal, analysed):
    """The word is short for the options, to the byte."""
    parts = (
        "--optimiser", "deap", "--no-seed-likelihood", "--publish", "score", "--confirm", "0",
        "--diversity", "population", "--no-renewal",
    )  # fmt: skip
    assert zfcal("calibrate", "trial", "--as-published", *QUICK).code == 0
    assert "nothing to do" in zfcal("calibrate", "trial", *parts, *QUICK).err


def test_the_older_name_of_publish_beside_it_is_wrong_usage(zfcal, analysed):
    """It would not take effect."""
    done = zfcal("calibrate", "trial", "--as-published", "--champion", "likely", *QUICK)
    assert done.code == 2
    assert "--as-published publishes by score" in done.err


def test_publish_likelihood_beside_it_needs_the_estimate(zfcal, analysed):
    """The paper's way makes none."""
    done = zfcal("calibrate", "trial", "--as-published", "--publish", "likelihood", *QUICK)
    assert done.code == 2
    assert "--no-seed-likelihood" in done.err
