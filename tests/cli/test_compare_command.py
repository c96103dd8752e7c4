"""`zfcal compare`: two sets of trials, as a person compares them."""

import json
import re

import pytest

from zfcal.artifacts.validation import check
from zfcal_cli.main import run

A, B = ("a1", "a2"), ("b1", "b2")


@pytest.fixture
def pairs(make_trial):
    """Two sets of two trials of wandering fish."""
    for number, name in enumerate((*A, *B)):
        make_trial(name, seconds=60, seed=number + 1)


def test_few_trials_are_described_and_nothing_is_tested(zfcal, pairs):
    """The table goes to standard output, the exit code is 0."""
    done = zfcal("compare", *A, "--against", *B)

    assert done.code == 0
    assert done.lines[:2] == ["A: a1, a2", "B: b1, b2"]
    assert any(re.match(r"Speeds +m/s +2, 2 ", line) for line in done.lines)
    assert "Nothing is tested: there are 2 and 2 trials" in done.out


def test_json_is_one_document_of_its_schema(zfcal, pairs):
    """Without --out its files are empty, and nothing is written."""
    done = zfcal("compare", *A, "--against", *B, "--json")
    document = json.loads(done.out)

    check(document, "compare", "stdout")
    assert document["files"] == {}
    assert [each["trial"] for each in document["sets"]["B"]] == list(B)


def test_out_writes_once_and_says_the_same_again(zfcal, pairs, tmp_path):
    """Paths on standard output, the table on standard error; the second run does nothing."""
    words = ("compare", *A, "--against", *B, "--out", "both")
    planned = zfcal(*words, "--dry-run")
    assert "would make both/compare.json: missing" in planned.err
    assert not (tmp_path / "both").exists()

    done = zfcal(*words)
    assert (done.code, done.lines) == (0, ["both/compare.json", "both/compare.png"])
    assert "Nothing is tested" in done.err
    again = zfcal(*words)
    assert again.lines == done.lines
    assert "Nothing is tested" in again.err
    assert "nothing to do, 2 up to date" in again.err
    assert "2 made" in zfcal(*words, "--force").err
    assert json.loads(zfcal(*words, "--json").out) == json.loads(
        (tmp_path / "both" / "compare.json").read_text()
    )


def test_a_damaged_segment_ends_with_3_each_time(zfcal, make_trial):
    """It is named, the rest is compared; up to date is not whole."""
    make_trial("a", seconds=120)
    (make_trial("c", seconds=120, seed=2) / "tracks" / "000060.parquet").write_bytes(b"PAR1")
    words = ("compare", "a", "--against", "c")

    for more in ((), ("-o", "out"), ("-o", "out")):
        done = zfcal(*words, *more)
        assert done.code == 3, more
        assert "c" in done.err
        assert "tracks/000060.parquet" in done.err
    document = json.loads(zfcal(*words, "--json").out)
    assert "tracks/000060.parquet" in document["left_out"][0]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("a1", "--against", "b1", "a1"), "a1 is in both sets"),
        (("a1", "--against", "nowhere"), "nowhere: is not in a trial"),
        (("nowhere", "--against", "b1"), "nowhere: is not in a trial"),
    ],
)
def test_sets_that_are_wrong_are_one_line_and_a_hint(zfcal, pairs, words, says):
    """A trial on both sides, and what is none."""
    done = zfcal("compare", *words)

    assert done.code == 1
    assert says in done.err
    assert len(done.err.splitlines()) == 2


@pytest.mark.parametrize(
    "words",
    [
        ("a1",),
        ("a1", "--against"),
        ("--against", "b1", "b2"),
        ("a1", "--against", "b1", "--format", "svg"),
        ("a1", "--against", "b1", "--force"),
        ("a1", "--against", "b1", "-n"),
        ("a1", "--against", "b1", "-o", "out", "--format", "pdf"),
    ],
)
def test_words_that_say_no_two_sets_are_wrong_usage(zfcal, words):
    """A side that is missing, and options that could not take effect."""
    done = zfcal("compare", *words)

    assert (done.code, done.out) == (2, "")


def test_words_without_a_second_set_are_said_in_the_document(zfcal):
    """Where one is asked for."""
    done = zfcal("compare", "a1", "--against", "--json")

    assert done.code == 2
    (error,) = json.loads(done.out)["errors"]
    assert error["message"] == "--against needs the trials of set B."


def test_against_takes_all_words_up_to_the_next_option(zfcal, pairs):
    """And may be repeated."""
    first = zfcal("compare", *A, "--against", *B, "-q").out
    again = zfcal("compare", *A, "--against", "b1", "--against", "b2", "-q").out
    before = zfcal("compare", "-q", "--against", *B, "--", *A).out

    assert first == again == before


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """Three sets of four short simulations: two of one law, and one of faster fish."""
    folder = tmp_path_factory.mktemp("simulated")
    start = ("--side-m", "1", "--fish", "3", "--fps", "5", "-q")
    assert run(["init", str(folder / "base"), *start]) == 0
    slow = folder / "base" / "models" / "000000.toml"
    fast = folder / "fast.toml"
    text = slow.read_text().partition("[lineage]")[0]
    fast.write_text(re.sub(r"speed_frequency = \[(.*?)\]", _faster, text))
    sets = {}
    for name, model, seed in (("one", slow, 10), ("two", slow, 20), ("fast", fast, 30)):
        sets[name] = [str(folder / f"{name}{i}") for i in range(4)]
        for number, root in enumerate(sets[name]):
            new = ("--arena", str(folder / "base" / "arena.geojson"), "--fish", "3", "--fps", "5")
            options = ("--duration", "60", "--seed", str(seed + number), "-q")
            assert run(["simulate", root, "--model", str(model), *new, *options]) == 0
    return sets


def _faster(found):
    """Return the same frequencies, three of ten bins faster."""
    shares = [float(each) for each in found[1].split(",")]
    moved = [0.0, 0.0, 0.0, *shares[:-3]]
    return f"speed_frequency = [{', '.join(str(each / sum(moved)) for each in moved)}]"


@pytest.mark.slow
def test_faster_fish_are_told_apart(zfcal, simulated):
    """Four trials of a minute on each side show it, all statistics in view."""
    done = zfcal("compare", *simulated["fast"], "--against", *simulated["one"], "--json")
    rows = {row["name"]: row for row in json.loads(done.out)["statistics"]}

    assert done.code == 0
    assert rows["V_m_s"]["p_family"] == pytest.approx(2 / 70)
    assert rows["V_m_s"]["difference"] > 0.03
    assert rows["V_m_s"]["interval"][0] > 0


@pytest.mark.slow
def test_fish_of_one_law_are_not_told_apart(zfcal, simulated):
    """Other seeds are no difference."""
    done = zfcal("compare", *simulated["one"], "--against", *simulated["two"], "--json")
    document = json.loads(done.out)

    assert document["test"]["tested"] >= 8
    assert min(row["p_family"] or 1 for row in document["statistics"]) > 0.05
