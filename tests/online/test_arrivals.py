"""Which files are there, whole and settled, by looking alone."""

import os
import shutil

import pytest

from zfcal.online.arrivals import SETTLED_S, Arrivals, Arrived, Unfinished, segment_ends


class Clock:
    """A clock that a test moves."""

    def __init__(self):
        self.now_s = 1000.0

    def __call__(self):
        """Return the time, in seconds."""
        return self.now_s


@pytest.fixture
def clock():
    """Return a clock that stands still."""
    return Clock()


@pytest.fixture
def trial(make_trial):
    """Return a trial of four segments."""
    return make_trial(seconds=240)


def look_again(arrivals, clock, after_s=SETTLED_S):
    """Look, wait, look; return what the second look found."""
    arrivals.look()
    clock.now_s += after_s
    return arrivals.look()


def test_a_file_counts_when_it_has_looked_the_same_for_a_while(trial, clock):
    """At first sight nothing is whole; then all that came together has one time."""
    arrivals = Arrivals(trial, clock)
    first = [each.path.name for each in arrivals.look()]
    assert first == ["000000.toml", "trial.toml"]
    assert arrivals.unsettled
    clock.now_s += SETTLED_S
    names = [each.path.name for each in arrivals.look()]
    assert names == ["000000.parquet", "000060.parquet", "000120.parquet", "000180.parquet"]
    assert arrivals.whole_s["tracks"] == dict.fromkeys((0, 60, 120, 180), clock.now_s)
    assert not arrivals.unsettled
    assert arrivals.look() == []


def test_a_file_that_grows_does_not_count(trial, clock):
    """Half of it is passed over while it grows, and once named when it stays so."""
    path = trial / "tracks" / "000240.parquet"
    whole = (trial / "tracks" / "000000.parquet").read_bytes()
    arrivals = Arrivals(trial, clock)
    look_again(arrivals, clock)
    for share in (0.2, 0.5, 0.9):
        path.write_bytes(whole[: int(share * len(whole))])
        clock.now_s += 0.9 * SETTLED_S
        assert arrivals.look() == []
    (news,) = look_again(arrivals, clock)
    assert isinstance(news, Unfinished)
    assert str(path) in news.problem
    assert "no footer" in news.problem
    assert look_again(arrivals, clock) == []
    assert list(arrivals.unfinished) == ["tracks/000240.parquet"]
    path.write_bytes(whole)
    assert look_again(arrivals, clock) == [Arrived(path=path)]
    assert arrivals.unfinished == {}


def test_a_footer_alone_makes_no_whole_file(trial, clock):
    """The magic bytes at the end of rubbish are not believed."""
    path = trial / "tracks" / "000240.parquet"
    path.write_bytes(b"PAR1" + bytes(100) + b"PAR1")
    news = look_again(Arrivals(trial, clock), clock)
    assert [each.path for each in news if isinstance(each, Unfinished)] == [path]


def test_dot_files_and_folders_of_images_are_not_seen(trial, clock):
    """Parts of rsync, locks and checkpoints are nobody's business; nor are files elsewhere."""
    arrivals = Arrivals(trial, clock)
    look_again(arrivals, clock)
    before = arrivals.signature
    (trial / "tracks" / ".000240.parquet.Xa3").write_bytes(b"half")
    (trial / "models" / ".000120.checkpoint").write_bytes(b"kept")
    (trial / "poses").mkdir()
    (trial / "poses" / "000000.mcap").write_bytes(b"")
    assert look_again(arrivals, clock) == []
    assert arrivals.signature == before


@pytest.mark.parametrize("step_s", [-3600.0, 3600.0, 1e9])
def test_times_of_files_are_never_compared_with_a_clock(trial, clock, step_s):
    """Files from the past and from the future settle alike."""
    for path in (trial / "tracks").iterdir():
        status = path.stat()
        os.utime(path, (status.st_atime + step_s, status.st_mtime + step_s))
    arrivals = Arrivals(trial, clock)
    assert len(look_again(arrivals, clock)) == 4
    assert len(arrivals.whole_s["tracks"]) == 4


def test_a_file_that_is_replaced_is_new(trial, clock):
    """The same name with other looks settles anew, and the signature differs."""
    arrivals = Arrivals(trial, clock)
    look_again(arrivals, clock)
    before = arrivals.signature
    path = trial / "tracks" / "000060.parquet"
    data = path.read_bytes()
    path.unlink()
    path.write_bytes(data)
    assert look_again(arrivals, clock) == [Arrived(path=path)]
    assert arrivals.signature != before
    assert arrivals.whole_s["tracks"][60] == clock.now_s


def test_a_file_that_goes_is_forgotten(trial, clock):
    """Also with its whole folder, and it may come back."""
    arrivals = Arrivals(trial, clock)
    look_again(arrivals, clock)
    (trial / "tracks").rename(trial.parent / "elsewhere")
    assert arrivals.look() == []
    assert arrivals.whole_s["tracks"] == {}
    (trial.parent / "elsewhere").rename(trial / "tracks")
    assert len(look_again(arrivals, clock)) == 4


def test_a_trial_that_is_gone_is_an_error_of_the_system(trial, clock):
    """The loop takes it for a disk that may come back."""
    arrivals = Arrivals(trial, clock)
    arrivals.look()
    shutil.rmtree(trial)
    with pytest.raises(FileNotFoundError):
        arrivals.look()


def test_a_trial_that_goes_while_it_is_looked_at_is_whole_when_it_is_back(trial, clock):
    """Names were read, then the disk went: what could not be opened is no damaged file."""
    away = trial.with_name("away")

    def goes_meanwhile():
        if not away.exists():
            trial.rename(away)
        return clock.now_s

    arrivals = Arrivals(trial, goes_meanwhile)
    assert arrivals.look() == []
    with pytest.raises(FileNotFoundError):
        arrivals.look()
    arrivals._clock = clock
    away.rename(trial)
    look_again(arrivals, clock)
    assert arrivals.unfinished == {}
    assert not arrivals.unsettled


def test_a_file_that_could_not_be_read_for_a_moment_is_read_again(trial, clock, monkeypatch):
    """Said once; what it looks like stays the same when a network disk answers again."""
    arrivals = Arrivals(trial, clock)
    path = trial / "models" / "000000.toml"

    def refuse(_):
        raise OSError(5, "Input/output error")

    with monkeypatch.context() as patch:
        patch.setattr("zfcal.online.arrivals.open_regular", refuse)
        named = [each for each in arrivals.look() if isinstance(each, Unfinished)]
        assert path in [each.path for each in named]
        assert arrivals.look() == []
    assert Arrived(path=path) in arrivals.look()
    assert arrivals.unfinished == {}


def test_what_a_stage_has_made_counts_at_once(trial, clock):
    """It is whole by the way in which it is made, and is not told; what is not there is not."""
    arrivals = Arrivals(trial, clock)
    look_again(arrivals, clock)
    (trial / "stats").mkdir()
    path = trial / "stats" / "000120.parquet"
    shutil.copy(trial / "tracks" / "000000.parquet", path)
    arrivals.trust(path)
    arrivals.trust(trial / "stats" / "000180.parquet")
    assert arrivals.whole_s["stats"] == {120: clock.now_s}
    assert look_again(arrivals, clock) == []


def test_a_window_is_there_with_the_later_of_its_segments():
    """A minute that is missing keeps two windows waiting; odd seconds are no segments."""
    whole = {0: 1.0, 60: 5.0, 120: 3.0, 240: 9.0, 270: 1.0}
    assert segment_ends(whole) == {120: 5.0, 180: 5.0}


@pytest.mark.parametrize("name", ["tracks/000240.parquet", "models/000120.toml"])
@pytest.mark.parametrize("kind", ["pipe", "loop", "folder", "outside"])
def test_what_is_no_file_of_the_trial_is_named_and_keeps_nobody_waiting(
    trial, clock, tmp_path, name, kind
):
    """It is named once; the others count."""
    path = trial / name
    (tmp_path / "theirs").touch()
    makes = {
        "pipe": lambda: os.mkfifo(path),
        "loop": lambda: path.symlink_to(path.name),
        "folder": path.mkdir,
        "outside": lambda: path.symlink_to(tmp_path / "theirs"),
    }
    makes[kind]()
    arrivals = Arrivals(trial, clock)
    found = [*arrivals.look()]
    clock.now_s += SETTLED_S
    found += arrivals.look()
    assert [each.path for each in found if isinstance(each, Unfinished)] == [path]
    assert list(arrivals.whole_s["tracks"]) == [0, 60, 120, 180]
    assert not arrivals.unsettled


def test_a_folder_that_leads_outside_is_named(trial, clock, tmp_path):
    """The trial is not gone for that."""
    (tmp_path / "theirs").mkdir()
    (trial / "stats").symlink_to(tmp_path / "theirs")
    arrivals = Arrivals(trial, clock)
    look_again(arrivals, clock)
    assert "leads outside the trial" in arrivals.unfinished["stats"]
