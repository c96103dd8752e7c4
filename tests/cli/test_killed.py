"""kill -9 at random instants: what is run again ends in the bytes of an undisturbed run."""

import shutil

import numpy as np
import pytest

from zfcal.artifacts.mcap_files import overview

KILLS = 20

# A round of a second, so that kills fall into estimates, searches, conclusions and writes.
CALIBRATE = ("calibrate", "trial", "--generations", "6", "--population", "12", "--steps", "400")
IMPORT = ("import", "tracks.csv", "trial", "--format", "csv")
ANALYSE = ("analyse", "trial")
TRACK = ("track", "trial", "--overhead", "day3.avi")
TRACK += ("--corners", "-0.5,199.5 199.5,199.5 199.5,-0.5 -0.5,-0.5")

BESIDE = ("init", "trial", "--side-m", "1", "--fish", "3", "--robot", "--fps", "5", "--seed", "1")
FILMED = ("init", "trial", "--side-m", "0.4", "--fish", "3", "--fps", "5")


def contents(root):
    """Return every artifact's bytes; dot-files are nobody's artifacts."""
    return {
        path.relative_to(root).as_posix(): path.read_bytes()
        for path in root.rglob("*")
        if path.is_file() and not path.name.startswith(".")
    }


def grows(path):
    """Tell whether a file of poses is not closed: one that was just begun is empty."""
    return path.stat().st_size == 0 or not overview(path).whole


def lacks_a_phase(searching):
    """Tell whether fewer than four kills fell into searches, or into what is before them.

    How long each takes depends on what else the computer does: there are more kills then, for a
    while.
    """
    n_searching = sum(searching)
    return min(n_searching, len(searching) - n_searching) < 4 and len(searching) < 4 * KILLS


def whole_minutes(root):
    """Return when each minute's tracks and poses were written, where both are whole."""
    pairs = ((path, root / "poses" / f"{path.stem}.mcap") for path in root.glob("tracks/*.parquet"))
    return {
        tracks.stem: (tracks.stat().st_mtime_ns, poses.stat().st_mtime_ns)
        for tracks, poses in pairs
        if poses.exists() and overview(poses).whole
    }


def wants_more(words, searching, n_growing):
    """Tell whether to go on: on a busy machine instants of kills fall where they like."""
    if len(searching) < KILLS:
        return True
    if words == CALIBRATE:
        return lacks_a_phase(searching)
    return words == TRACK and n_growing < 4 and len(searching) < 4 * KILLS


@pytest.fixture(scope="module")
def forks(forking):
    """Return what runs commands and kills them."""
    with forking.Forks() as made:
        yield made


@pytest.fixture(scope="module")
def film(tmp_path_factory, write_film):
    """Return a video of 70 s, whose bodies keep apart."""
    return write_film(tmp_path_factory.mktemp("film") / "day3.avi", seconds=70)


@pytest.fixture
def sources(tracks_csv, film, tmp_path):
    """Put tracks of 190 s, two windows, and the video into the folder of the test."""
    tracks_csv(seconds=190)
    (tmp_path / film.name).symlink_to(film)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("before", "words", "seed"),
    [
        ((BESIDE,), IMPORT, 1),
        ((BESIDE, IMPORT), ANALYSE, 2),
        ((BESIDE, IMPORT, ANALYSE), CALIBRATE, 3),
        ((FILMED,), TRACK, 4),
    ],
    ids=["import", "analyse", "calibrate", "track"],
)
@pytest.mark.usefixtures("sources")
def test_a_command_killed_twenty_times_ends_in_the_same_bytes(forks, tmp_path, before, words, seed):
    """At random instants of its work, from its first read to its last write.

    Whatever stands there in between is whole, but for poses, which grow in place: a half-written
    file would be read by the next run, or differ in the end. A run that comes to its end begins
    anew.
    """
    for earlier in before:
        assert forks.run(tmp_path, earlier)
    root, start = tmp_path / "trial", tmp_path / "start"
    shutil.copytree(root, start)
    # The first run may compile something: instants of a kill are drawn from the second one's time.
    assert forks.run(tmp_path, words)
    shutil.rmtree(root)
    shutil.copytree(start, root)
    assert forks.run(tmp_path, words)
    undisturbed = contents(root)

    def searches():
        return any(root.glob("models/.*.checkpoint"))

    rng = np.random.default_rng(seed)
    # One that goes on where another was killed takes less: all later kills would come early.
    searching, n_growing, has_ended, takes_s = [], 0, True, forks.took_s
    while wants_more(words, searching, n_growing):
        if has_ended:
            shutil.rmtree(root)
            shutil.copytree(start, root)
        minutes = whole_minutes(root)
        # However busy the computer is: every second kill comes after the first checkpoint.
        once = searches if words == CALIBRATE and len(searching) % 2 else None
        kill_after_s = rng.uniform(0.0, 0.9) * takes_s * (0.2 if once else 1.0)
        has_ended = forks.run(tmp_path, words, kill_after_s=kill_after_s, once=once)
        if not has_ended:
            searching.append(searches())
            n_growing += any(map(grows, root.glob("poses/*.mcap")))
        # It goes on where it was: what is whole is not made again.
        assert minutes.items() <= whole_minutes(root).items()
        found = {k: v for k, v in contents(root).items() if has_ended or not k.startswith("poses")}
        assert all(undisturbed[name] == found[name] for name in found)
    assert forks.run(tmp_path, words)
    assert contents(root) == undisturbed
    assert not list(root.rglob(".*part-*"))
    assert n_growing >= 4 * (words == TRACK)
    if words == CALIBRATE:
        # Before a round's first checkpoint it estimates what is most likely.
        assert all(b"[result.likelihood" in undisturbed[f"models/{s:06d}.toml"] for s in (120, 180))
        assert 4 <= sum(searching) <= len(searching) - 4
