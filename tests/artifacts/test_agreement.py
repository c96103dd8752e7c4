"""Whether the settings of a trial and its tracks agree on agents and frame rate."""

import re

import numpy as np
import pytest

from zfcal.artifacts import agreement
from zfcal.artifacts.agreement import check_agreement, disagreements
from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.segments import segment_path
from zfcal.artifacts.settings import read_trial
from zfcal.artifacts.tables import read_tracks, write_tracks
from zfcal.errors import InputError
from zfcal.tracks import Tracks, concatenate


def setting(root, **values):
    """Write settings of a trial anew, and return it."""
    path = root / "trial.toml"
    for key, value in values.items():
        path.write_text(
            re.sub(rf"^{key} = .*$", f"{key} = {value}", path.read_text(), flags=re.MULTILINE)
        )
    return read_trial(root)


def rewrite(root, change):
    """Replace the first segment's tracks by what a function makes of them."""
    path = segment_path(root, 0)
    write_tracks(path, change(read_tracks(path)), read_lineage(path))


def with_more(tracks, n_frames):
    """Return tracks that hold a fish more, under a new id, in their first frames."""
    rows = tracks.take((tracks.agent == 0) & (tracks.frame < n_frames))
    columns = {name: getattr(rows, name) for name in Tracks.__slots__}
    return concatenate([tracks, Tracks(**{**columns, "agent": rows.agent + 99})])


def test_settings_that_state_the_agents_of_the_tracks_agree(make_trial):
    """Four fish and a robot, and 5 frames a second."""
    assert disagreements(read_trial(make_trial(n_fish=4, n_robots=1, seconds=120))) == []


def test_fewer_agents_than_the_tracks_hold_are_one_clear_error(make_trial):
    """It names the file, the keys, what they say, what the tracks have, and what to do."""
    trial = setting(make_trial(n_fish=4, n_robots=1, seconds=120), n_fish=3)
    with pytest.raises(InputError) as raised:
        check_agreement(trial)
    assert str(raised.value) == (
        f"{trial.config}: n_fish = 3 and n_robots = 1 are 4 agents, the tracks hold 5 at once."
    )
    assert "Set n_fish and n_robots in trial.toml" in raised.value.hint


@pytest.mark.parametrize(
    ("n_fish", "n_robots", "n_problems"), [(5, 0, 1), (4, 1, 0), (3, 2, 0), (4, 2, 0), (6, 0, 1)]
)
def test_robots_are_not_fish(make_trial, n_fish, n_robots, n_problems):
    """As many agents, but no robot where the tracks hold one. One more may be tracked as a fish."""
    trial = setting(make_trial(n_fish=4, n_robots=1, seconds=120), n_fish=n_fish, n_robots=n_robots)
    problems = [str(problem) for problem in disagreements(trial)]
    assert len(problems) == n_problems
    assert all("the tracks hold 5 at once, of which 1 are robots." in each for each in problems)


def test_ghosts_in_one_minute_do_not_condemn_a_trial(make_trial):
    """A fish more in a third of the first minute; the second has none."""
    root = make_trial(n_fish=3, seconds=120)
    rewrite(root, lambda tracks: with_more(tracks, 100))
    assert disagreements(read_trial(root)) == []


def test_a_camera_that_is_slower_than_its_rate_agrees(make_trial):
    """At 10/3 Hz in place of 5 the numbers of its frames go up by two and by one in turn."""
    root = make_trial(n_fish=3, seconds=60)

    def slower(tracks):
        rows = tracks.take(tracks.frame % 3 != 1)
        columns = {name: getattr(rows, name) for name in Tracks.__slots__}
        number = np.unique(rows.frame, return_inverse=True)[1]
        return Tracks(**{**columns, "time_s": 0.3 * number})

    rewrite(root, slower)
    assert disagreements(read_trial(root)) == []


def test_more_agents_than_the_tracks_hold_may_be_lost(make_trial):
    """A fish that is never seen is no disagreement, nor are fish that swap their ids."""
    root = make_trial(n_fish=3, seconds=120)

    def swap(tracks):
        late = tracks.frame >= 150
        columns = {name: getattr(tracks, name) for name in Tracks.__slots__}
        return Tracks(**{**columns, "agent": tracks.agent + 10 * late.astype(np.int32)})

    rewrite(root, swap)
    assert disagreements(setting(root, n_fish=3)) == []
    assert disagreements(setting(root, n_fish=7)) == []


@pytest.mark.parametrize(("n_frames", "n_problems"), [(1, 0), (30, 1)])
def test_a_false_detection_now_and_then_is_no_agent(make_trial, n_frames, n_problems):
    """One in one of 300 frames is rare; one in a tenth of them is an animal."""
    root = make_trial(n_fish=3, seconds=60)
    rewrite(root, lambda tracks: with_more(tracks, n_frames))
    assert len(disagreements(read_trial(root))) == n_problems


@pytest.mark.parametrize(("fps", "n_problems"), [(10.0, 1), (5.25, 0), (4.0, 1)])
def test_another_frame_rate_than_that_of_the_tracks_is_an_error(make_trial, fps, n_problems):
    """The tracks have 5 Hz; a live camera may be off by some percent."""
    root = make_trial(seconds=120)
    trial = setting(root, fps=fps, dt_s=4 / fps)
    problems = [str(problem) for problem in disagreements(trial)]
    said = f"{root / 'trial.toml'}: the tracks have 5 frames a second, fps says {fps:g}."
    assert problems == [said] * n_problems


def test_frames_that_are_left_out_do_not_change_the_rate(make_trial):
    """Of every other frame there are no rows: their numbers say so."""
    root = make_trial(seconds=60)
    rewrite(root, lambda tracks: tracks.take(tracks.frame % 2 == 0))
    assert disagreements(read_trial(root)) == []


def test_a_long_trial_is_looked_at_here_and_there(make_trial, monkeypatch):
    """However long it is, some segments are read, the first and the last among them."""
    trial = read_trial(make_trial(seconds=1200))
    read, real = [], agreement.read_tracks

    def watch(path):
        read.append(int(path.stem))
        return real(path)

    monkeypatch.setattr(agreement, "read_tracks", watch)
    assert disagreements(trial) == []
    assert len(read) == 8
    assert (read[0], read[-1]) == (0, 1140)


def test_what_cannot_be_read_is_left_to_others(make_trial):
    """A damaged segment, an empty one, and a trial without any."""
    root = make_trial(n_fish=4, seconds=120)
    rewrite(root, lambda tracks: tracks.take(slice(0)))
    segment_path(root, 60).write_bytes(b"PAR1")
    assert disagreements(setting(root, n_fish=1)) == []
    segment_path(root, 0).unlink()
    segment_path(root, 60).unlink()
    assert disagreements(read_trial(root)) == []
