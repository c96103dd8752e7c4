"""`zfcal demo --closed-loop` as a user calls it."""

import json

import pytest


@pytest.mark.slow
def test_a_closed_loop_ends_with_a_report(zfcal, tmp_path):
    """Its options reach the fish; the page and all figures are told as paths."""
    words = ("--closed-loop", "--no-video", "--duration", "5s", "--swims", "fixed", "--seed", 7)
    words += ("--champion", "score")
    done = zfcal("demo", tmp_path / "loop", *words, "--noise-mm", 0.2, "--wariness", 0, "-q")
    assert done.code == 0, done.err
    said = json.loads((tmp_path / "loop" / "trial" / "closed-loop.json").read_text())
    assert said["seed"] == 7
    assert said["options"]["robot"] == "fixed"
    assert said["options"]["champion"] == "score"
    assert said["options"]["fish_noise_m"] == pytest.approx(0.0002)
    assert said["options"]["fish_wariness"] == 0
    assert str(tmp_path / "loop" / "trial" / "report" / "index.html") in done.lines


@pytest.mark.parametrize(
    ("words", "flag"),
    [
        (("--no-video",), "--no-video"),
        (("--duration", "10min"), "--duration"),
        (("--swims", "random"), "--swims"),
        (("--drift-s", "5"), "--drift-s"),
    ],
)
def test_options_of_the_loop_need_the_loop(zfcal, tmp_path, words, flag):
    """An option that cannot take effect is an error."""
    done = zfcal("demo", tmp_path / "demo", *words)
    assert done.code == 2
    assert f"{flag} is for --closed-loop" in done.err
    assert not (tmp_path / "demo").exists()


def test_impossible_fish_are_one_line(zfcal, tmp_path):
    """Wrong usage, and nothing is made."""
    done = zfcal("demo", tmp_path / "loop", "--closed-loop", "--no-video", "--noise-mm", -1)
    assert done.code == 2
    assert "--noise-mm" in done.err
    assert "Traceback" not in done.err
    assert not (tmp_path / "loop").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--real-time", "--generations", "3"), "--budget, not --generations"),
        (("--budget", "20s"), "--budget is for --real-time"),
    ],
)
def test_rounds_are_bound_by_time_only_where_time_passes(zfcal, tmp_path, words, says):
    """A budget means nothing in lock-step, generations nothing in real time."""
    done = zfcal("demo", tmp_path / "loop", "--closed-loop", *words)
    assert done.code == 2
    assert says in done.err
