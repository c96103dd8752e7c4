"""`--publish` and the older `--champion`: which way rounds publish, and what is said of it."""

import json
import tomllib

import pytest

QUICK = ("--generations", "1", "--population", "4", "--steps", "20")


@pytest.fixture
def analysed(zfcal, trial):
    """Return a trial of two windows with its statistics."""
    assert zfcal("analyse", "trial").code == 0
    return trial


def champion_of(trial, end="000120"):
    """Return the way that a model's lineage states; the usual one goes without saying."""
    document = tomllib.loads((trial / "models" / f"{end}.toml").read_text())
    return document["lineage"]["options"].get("champion", "score")


@pytest.mark.parametrize(("words", "way"), [
    ((), "forward"),
    (("--publish", "forward"), "forward"),
    (("--publish", "score"), "score"),
    (("--publish", "likelihood"), "likely"),
    (("--champion", "score"), "score"),
    (("--champion", "likely"), "likely"),
    (("--champion", "likelihood"), "likely"),
])  # fmt: skip
def test_each_word_is_a_way(zfcal, analysed, words, way):
    """The older words go on working; a trial without models publishes by the rule that leads."""
    assert zfcal("calibrate", "trial/stats/000120.parquet", *QUICK, *words).code == 0
    assert champion_of(analysed) == way
    has_record = (analysed / "scores" / "000120-rules.parquet").exists()
    assert has_record is (way == "forward")


@pytest.mark.parametrize("words", [
    ("--publish", "score"), ("--champion", "likely"), ("--publish", "forward"),
])  # fmt: skip
def test_a_trial_keeps_its_way_until_it_is_told(zfcal, analysed, words):
    """Without a word there is nothing to do; another word makes all rounds again."""
    assert zfcal("calibrate", "trial", *QUICK, *words).code == 0
    again = zfcal("calibrate", "trial", *QUICK)
    assert "nothing to do" in again.err
    other = "likelihood" if words[1] == "score" else "score"
    planned = zfcal("calibrate", "trial", *QUICK, "--publish", other, "--dry-run").err
    assert "option champion" in planned


def test_both_words_are_wrong_usage(zfcal, analysed):
    """Even where they agree."""
    done = zfcal("calibrate", "trial", *QUICK, "--publish", "score", "--champion", "score")
    assert done.code == 2
    assert "--publish and --champion say the same: give one." in done.err


@pytest.mark.parametrize("words", [("--publish", "likelihood"), ("--champion", "likely")])
def test_the_estimate_cannot_be_both_omitted_and_published(zfcal, analysed, words):
    """Wrong usage."""
    assert zfcal("calibrate", "trial", *words, "--no-seed-likelihood").code == 2


def test_one_pooled_window_has_no_rounds_to_judge(zfcal, analysed):
    """It is the best by its score unless told; forward is refused."""
    window = ("--window", "0:120", "-o", "one.toml")
    refused = zfcal("calibrate", "trial", *QUICK, *window, "--publish", "forward")
    assert refused.code == 2
    assert "--publish forward judges round after round: --window has one." in refused.err
    done = zfcal("calibrate", "trial", *QUICK, *window, "--json")
    (result,) = json.loads(done.out)["results"]
    assert (result["rule"], result["forward"]) == ("score", None)


def test_help_lists_one_of_the_two_words(zfcal):
    """The older one goes on working unlisted."""
    for command in ("calibrate", "watch"):
        said = zfcal(command, "--help").out
        assert "--publish" in said
        assert "--champion" not in said


@pytest.mark.slow
def test_calibrate_says_one_line_a_round(zfcal, analysed):
    """To those who look on; the same numbers stand in the JSON document."""
    done = zfcal("calibrate", "trial", *QUICK)
    lines = [line for line in done.err.splitlines() if "publishes" in line]
    assert [line.split(":")[0] for line in lines] == ["Window to 120 s", "Window to 180 s"]
    assert all("ceiling" in line for line in lines)
    document = json.loads(zfcal("calibrate", "trial", *QUICK, "--force", "--json").out)
    for result, line in zip(document["results"], lines, strict=True):
        assert f"(rule {result['rule']}: {result['published']['because']})" in line
        assert f"S {result['S']:.3f}" in line
        assert result["above_ceiling"] is (result["S"] > result["ceiling_high"])
    assert "publishes" not in zfcal("calibrate", "trial", *QUICK, "--force", "-q").err


@pytest.mark.slow
def test_watch_says_the_same_line_and_logs_it(zfcal, analysed):
    """A note on standard error, and a line of JSON each for the note and the numbers."""
    done = zfcal("watch", "trial", "--once", *QUICK, "--json")
    assert done.code == 0
    logged = [json.loads(line) for line in done.out.splitlines()]
    notes = [each["text"] for each in logged if each["event"] == "note"]
    results = [each["value"] for each in logged if each["event"] == "result"]
    spoken = [line for line in done.err.splitlines() if "publishes" in line]
    assert [text for text in notes if "publishes" in text] == spoken
    assert len(spoken) == 2
    assert [value["rule"] for value in results if "rule" in value] == ["likelihood"] * 2


@pytest.mark.slow
def test_a_damaged_record_is_exit_code_3(zfcal, analysed):
    """With the file's name and what to do."""
    assert zfcal("calibrate", "trial", *QUICK).code == 0
    path = analysed / "scores" / "000120-rules.parquet"
    path.write_bytes(path.read_bytes()[:-30])
    done = zfcal("calibrate", "trial/stats/000180.parquet", *QUICK)
    assert done.code == 3
    assert "000120-rules.parquet" in done.err
    assert "Make it again." in done.err
    assert zfcal("check", "trial").code == 3
    assert zfcal("calibrate", "trial", *QUICK, "--force").code == 0
    shown = json.loads(zfcal("inspect", str(path), "--json").out)["results"]
    assert shown[0]["lineage"]["schema"] == "zfcal.rules/1"
