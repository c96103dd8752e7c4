"""From track segments to statistics and scores."""

import dataclasses

import numpy as np
import pytest

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.settings import read_trial, write_trial
from zfcal.artifacts.tables import read_extra, read_table, read_tracks, write_tracks
from zfcal.behaviour.located import locate
from zfcal.behaviour.rows import scores_from_rows, statistics_from_rows
from zfcal.behaviour.scores import compare
from zfcal.behaviour.statistics import measure, measure_robot
from zfcal.errors import InputError
from zfcal.sampling import sample
from zfcal.stages.analyse import analyse as stage
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.events import LeftOut, Made, Note, Planned, Result, UpToDate
from zfcal.stages.segments import Segments
from zfcal.stages.trial_context import Task, open_trial
from zfcal.tracks import FISH

PAPER = AnalyseOptions()


def stats_of(root, end):
    """Return the statistics of a window by case."""
    table = read_table(root / "stats" / f"{end:06d}.parquet", "zfcal.stats/1").to_pydict()
    return {case: found for (_, case), found in statistics_from_rows(table).items()}


def scores_of(root, end):
    """Return the scores of a window and their ceilings, by what is compared."""
    table = read_table(root / "scores" / f"{end:06d}.parquet", "zfcal.scores/1").to_pydict()
    return {compared: found for (_, compared), found in scores_from_rows(table).items()}


def names_of(events, kind):
    """Return what events of a kind are about, as stats/000120.parquet."""
    return [
        f"{event.path.parent.name}/{event.path.name}" for event in events if isinstance(event, kind)
    ]


def located_whole(root, tracks, start_s, end_s):
    """Return where everybody was in a stretch, from the uncut tracks."""
    opened = open_trial(root)
    samples = sample(tracks, fps=5.0, dt_s=opened.trial.dt_s, start_s=start_s, end_s=end_s)
    return locate(samples, opened.arena)


def same(a, b):
    """Return whether all counts agree."""
    return all(
        np.array_equal(getattr(a, name), getattr(b, name))
        for name in ("distance", "wall", "occupation", "transition", "speed")
    )


def test_a_window_counts_what_the_uncut_tracks_hold(make_trial, wandering, heard):
    """Cutting into segments changes no count, and none crosses the window's edge."""
    root = make_trial(seconds=240, n_robots=1)
    analyse(root, PAPER, heard.append)
    points = located_whole(root, wandering(240, n_robots=1), 60, 180)
    cases = stats_of(root, 180)
    assert same(cases["control"], measure(points.of_kind(FISH), points.arena))
    assert same(cases["social"], measure(points, points.arena))
    assert same(cases["robot"], measure_robot(points, points.arena))


def test_a_window_by_hand(make_trial, heard):
    """3 fish, 120 s at 5 Hz: 1800 agent-samples, 3 x 599 steps, 600 samples of at most 3 pairs."""
    root = make_trial(seconds=120)
    analyse(root, PAPER, heard.append)
    control = stats_of(root, 120)["control"]
    assert control.occupation.sum() == 1800
    assert control.transition.sum() == control.speed.sum() == 3 * 599
    assert control.distance.sum() <= 600 * 3


def test_without_a_robot_there_is_a_control_and_no_score(make_trial, heard):
    """The scores file is there all the same, without rows."""
    root = make_trial(seconds=120)
    analyse(root, PAPER, heard.append)
    assert list(stats_of(root, 120)) == ["control"]
    assert scores_of(root, 120) == {}


def test_scores_are_those_of_the_statistics(make_trial, heard):
    """social-vs-control compares the two cases of the same file."""
    root = make_trial(seconds=120, n_robots=1)
    analyse(root, PAPER, heard.append)
    cases, scores = stats_of(root, 120), scores_of(root, 120)
    assert scores["social-vs-control"][0] == compare(cases["social"], cases["control"])
    told = {event.value["compared"]: event.value for event in heard if isinstance(event, Result)}
    assert told["social-vs-control"]["S"] == scores["social-vs-control"][0].S
    assert scores["social-vs-control"][1] is None


def test_the_robot_is_judged_from_300_s_on(make_trial, wandering, heard):
    """The window to 540 s pools from 300 s; an early one has only itself."""
    root = make_trial(seconds=540, n_robots=1)
    analyse(root, PAPER, heard.append)
    tracks = wandering(540, n_robots=1)
    for end, start in ((240, 120), (360, 240), (420, 300), (540, 300)):
        points = located_whole(root, tracks, start, end)
        fish = measure(points.of_kind(FISH), points.arena)
        wanted = compare(measure_robot(points, points.arena), fish)
        scores, ceiling = scores_of(root, end)["robot-vs-fish"]
        assert scores.values == pytest.approx(wanted.values, nan_ok=True)
        assert ceiling.n_windows == 3
        path = root / "scores" / f"{end:06d}.parquet"
        assert read_extra(path)["robot_pooled_from_s"] == start
    assert len(read_lineage(root / "scores" / "000540.parquet").inputs) == 4 + 1


def test_the_second_run_does_nothing(make_trial, heard, read_all):
    """Every artifact is found up to date."""
    root = make_trial(n_robots=1)
    analyse(root, PAPER, heard.append)
    before = read_all(root)
    heard.clear()
    analyse(root, PAPER, heard.append)
    assert names_of(heard, Made) == []
    assert len(names_of(heard, UpToDate)) == 9
    assert read_all(root) == before


def test_of_an_older_trial_only_what_the_robot_does_to_the_fish_is_made(
    make_trial, heard, read_all
):
    """Statistics and scores from before there was such a file stay as they are."""
    root = make_trial(seconds=120, n_robots=1)
    analyse(root, PAPER, heard.append)
    before = read_all(root)
    (root / "stats" / "000120-following.parquet").unlink()
    heard.clear()
    analyse(root, PAPER, heard.append)
    assert names_of(heard, Made) == ["stats/000120-following.parquet"]
    assert names_of(heard, UpToDate) == ["stats/000120.parquet", "scores/000120.parquet"]
    assert read_all(root) == before


def test_without_a_robot_nobody_is_followed(make_trial, heard):
    """There is no such file."""
    root = make_trial(seconds=120)
    analyse(root, PAPER, heard.append)
    assert names_of(heard, Made) == ["stats/000120.parquet", "scores/000120.parquet"]


def test_a_control_does_not_bear_on_who_follows(make_trial, heard):
    """The file is up to date, whatever the control group."""
    root, control = make_trial(seconds=120, n_robots=1), make_trial("control", seconds=120, seed=3)
    analyse(root, PAPER, heard.append)
    heard.clear()
    analyse(root, AnalyseOptions(control=(control,)), heard.append)
    assert names_of(heard, UpToDate) == ["stats/000120-following.parquet"]


def test_a_robot_that_is_lost_for_the_whole_window_gives_null(make_trial, heard):
    """Its rows are there without a value; what fish do in its place is known."""
    root = make_trial(seconds=120, n_robots=1)
    for start in (0, 60):
        path = root / "tracks" / f"{start:06d}.parquet"
        tracks = read_tracks(path)
        write_tracks(path, tracks.take(tracks.kind == FISH), read_lineage(path))
    analyse(root, PAPER, heard.append)
    table = read_table(root / "stats" / "000120-following.parquet", "zfcal.following/1")
    rows = {(row["measure"], row["lag_s"]): row for row in table.to_pylist()}
    assert len(rows) == 21 + 5
    assert {row["value"] for row in rows.values()} == {None}
    assert {row["floor"] for row in rows.values()} == {None}
    assert rows["direction", 0.0]["n"] == 0
    assert rows["following", None]["ceiling"] is not None
    # One room: departures are not defined, rather than none.
    assert rows["departures_led", None]["n"] is None


def test_only_windows_of_a_changed_segment_are_made_again(make_trial, wandering, heard):
    """The first of five minutes is in the window to 120 s alone."""
    root = make_trial(seconds=300)
    other = make_trial("other", seconds=300, seed=2)
    analyse(root, PAPER, heard.append)
    heard.clear()
    (other / "tracks" / "000000.parquet").replace(root / "tracks" / "000000.parquet")
    analyse(root, PAPER, heard.append)
    assert names_of(heard, Made) == ["stats/000120.parquet", "scores/000120.parquet"]
    assert heard[0].reason == "input tracks/000000.parquet changed"


def test_a_changed_setting_makes_all_stale(make_trial, heard):
    """The reason names it; what a person notes as source does not bear on the counts."""
    root = make_trial(seconds=180)
    analyse(root, PAPER, heard.append)
    trial = read_trial(root)
    write_trial(dataclasses.replace(trial, source="tank 3"))
    heard.clear()
    analyse(root, PAPER, heard.append)
    assert names_of(heard, Made) == []
    write_trial(dataclasses.replace(trial, dt_s=0.4))
    analyse(root, PAPER, heard.append)
    assert {e.reason for e in heard if isinstance(e, Made)} == {"option dt_s: 0.2 -> 0.4"}


def test_a_dry_run_says_what_and_why_and_writes_nothing(make_trial, heard, read_all):
    """Not even a lock."""
    root = make_trial()
    analyse(root, PAPER, heard.append, task=Task(dry_run=True))
    planned = [event for event in heard if isinstance(event, Planned)]
    assert len(planned) == 6
    assert {event.reason for event in planned} == {"missing"}
    assert not (root / "stats").exists()
    assert not list(root.glob(".lock*"))


def test_force_makes_the_same_bytes_again(make_trial, heard, read_all):
    """Same inputs, same bytes."""
    root = make_trial(n_robots=1)
    analyse(root, PAPER, heard.append)
    before = read_all(root)
    heard.clear()
    analyse(root, PAPER, heard.append, task=Task(force=True))
    assert len(names_of(heard, Made)) == 9
    assert read_all(root) == before


def test_one_window_alone_is_the_same_as_among_all(make_trial, copy_trial, heard, read_all):
    """What a pipe asks for, window by window, ends in the bytes of the whole run."""
    root = make_trial(seconds=480, n_robots=1)
    online = copy_trial(root, "online")
    analyse(root, PAPER, heard.append)
    segments = Segments()
    for end in range(120, 540, 60):
        heard.clear()
        task = Task(ends_s=frozenset({end}))
        analyse(online, PAPER, heard.append, task=task, segments=segments)
        assert len(names_of(heard, Made)) == 3
    assert read_all(online) == read_all(root)


def test_a_cut_segment_is_named_and_its_windows_left_out(make_trial, heard):
    """Of the windows to 120, 180, 240 and 300 s those with the third minute are missing."""
    root = make_trial(seconds=300)
    path = root / "tracks" / "000120.parquet"
    path.write_bytes(path.read_bytes()[:-100])
    analyse(root, PAPER, heard.append)
    left_out = [event for event in heard if isinstance(event, LeftOut)]
    assert any("000120.parquet: was cut short" in event.problem for event in left_out)
    assert any(
        "window that ends at 180 s needs tracks/000120.parquet" in e.problem for e in left_out
    )
    assert sorted(path.name for path in (root / "stats").iterdir()) == [
        "000120.parquet",
        "000300.parquet",
    ]


def test_a_mended_segment_gives_what_an_undamaged_trial_has(
    make_trial, copy_trial, heard, read_all
):
    """Also in the scores that had pooled without it."""
    root = make_trial(seconds=540, n_robots=1)
    whole = copy_trial(root, "whole")
    analyse(whole, PAPER, heard.append)
    path = root / "tracks" / "000360.parquet"
    content = path.read_bytes()
    path.write_bytes(content[:200])
    analyse(root, PAPER, heard.append)
    assert "tracks/000360.parquet" not in read_lineage(root / "scores" / "000540.parquet").inputs
    heard.clear()
    analyse(root, PAPER, heard.append)
    assert names_of(heard, Made) == []
    path.write_bytes(content)
    analyse(root, PAPER, heard.append)
    assert read_all(root) == read_all(whole)


def test_a_segment_under_another_s_name_is_damaged(make_trial, heard):
    """Rows from 60 s on are no minute that starts at 0."""
    root = make_trial(seconds=120)
    (root / "tracks" / "000000.parquet").write_bytes(
        (root / "tracks" / "000060.parquet").read_bytes()
    )
    analyse(root, PAPER, heard.append)
    problems = [event.problem for event in heard if isinstance(event, LeftOut)]
    assert "holds the times 60 s to 119.8 s, expected 0 s to 60 s" in problems[0]


def test_the_control_can_be_the_fish_of_other_trials(make_trial, wandering, heard):
    """Pooled over all their minutes, and the same for every window."""
    root = make_trial(seconds=180, n_robots=1)
    a, b = make_trial("a", seconds=120, seed=2), make_trial("b", seconds=60, seed=3)
    analyse(root, AnalyseOptions(control=(a, b)), heard.append)
    points = [
        located_whole(trial, wandering(s, seed=seed), 0, s)
        for trial, s, seed in ((a, 120, 2), (b, 60, 3))
    ]
    parts = [measure(part, part.arena) for part in points]
    for end in (120, 180):
        cases = stats_of(root, end)
        assert same(cases["control"], parts[0] + parts[1])
        wanted = compare(cases["social"], cases["control"])
        assert scores_of(root, end)["social-vs-control"][0] == wanted
    assert "../a/tracks/000000.parquet" in read_lineage(root / "stats" / "000120.parquet").inputs


def test_a_trial_of_fish_alone_can_be_held_against_a_control(make_trial, heard):
    """How alike are two robot-free trials? Against itself it would score 1."""
    root, other = make_trial(seconds=120), make_trial("other", seconds=120, seed=2)
    analyse(root, AnalyseOptions(control=(other,)), heard.append)
    assert 0 < scores_of(root, 120)["social-vs-control"][0].S < 1


@pytest.mark.parametrize("wrong", ["robot", "itself", "empty", "step"])
def test_a_control_that_cannot_be_one_is_refused(make_trial, heard, wrong):
    """With a robot, the trial itself, without tracks, at another step."""
    root, other = make_trial(seconds=120), make_trial("other", n_robots=int(wrong == "robot"))
    if wrong == "empty":
        for path in (other / "tracks").iterdir():
            path.unlink()
    if wrong == "step":
        write_trial(dataclasses.replace(read_trial(other), dt_s=0.4))
    control = root if wrong == "itself" else other
    with pytest.raises(InputError):
        analyse(root, AnalyseOptions(control=(control,)), heard.append)


def test_legacy_scoring_scores_the_group_alone(make_trial, heard):
    """The authors' scripts have no robot-vs-fish and no W; the statistics stay as they are."""
    root = make_trial(seconds=120, n_robots=1)
    analyse(root, PAPER, heard.append)
    paper = scores_of(root, 120)["social-vs-control"][0]
    heard.clear()
    analyse(root, AnalyseOptions(scoring="legacy"), heard.append)
    assert names_of(heard, Made) == ["scores/000120.parquet"]
    scores = scores_of(root, 120)
    assert list(scores) == ["social-vs-control"]
    assert np.isnan(scores["social-vs-control"][0].I_W)
    assert scores["social-vs-control"][0].S != paper.S


def test_positions_outside_the_arena_are_told(make_trial, heard):
    """A tank of half the size loses more than a hundredth of them."""
    root = make_trial(seconds=120)
    arena = root / "arena.geojson"
    arena.write_text(arena.read_text().replace("1.0", "0.5"))
    analyse(root, PAPER, heard.append)
    notes = [event.text for event in heard if isinstance(event, Note)]
    assert any("lie outside the arena" in text for text in notes)
    assert read_extra(root / "stats" / "000120.parquet")["n_void"]["control"] > 0


def test_too_little_to_analyse_is_said(make_trial, heard):
    """One minute is no window."""
    analyse(make_trial(seconds=60), PAPER, heard.append)
    assert "a window needs two" in heard[0].text


def test_statistics_that_have_lost_their_tracks_are_told(make_trial, heard):
    """They stay: perhaps the tracks lie on another computer."""
    root = make_trial(seconds=240)
    analyse(root, PAPER, heard.append)
    (root / "tracks" / "000180.parquet").unlink()
    heard.clear()
    analyse(root, PAPER, heard.append)
    notes = [event.text for event in heard if isinstance(event, Note)]
    assert len(notes) == 1
    assert "stats/000240.parquet" in notes[0]
    assert (root / "stats" / "000240.parquet").exists()


def test_an_unknown_scoring_is_refused():
    """There are two."""
    with pytest.raises(InputError, match="paper, legacy"):
        AnalyseOptions(scoring="new")


def test_a_segment_that_appears_meanwhile_is_left_for_the_next_run(make_trial, heard, monkeypatch):
    """Between two looks into tracks/ its writer may have closed one more minute."""
    root = make_trial(seconds=180, n_robots=1)
    late, aside = root / "tracks" / "000120.parquet", root / "000120.parquet"
    late.rename(aside)
    first = stage.whole_segments

    def then_one_more(trial):
        found = first(trial)
        aside.rename(late)
        return found

    monkeypatch.setattr(stage, "whole_segments", then_one_more)
    analyse(root, AnalyseOptions(), heard.append)
    assert not stats_of_path(root, 180).exists()
    monkeypatch.undo()
    analyse(root, AnalyseOptions(), heard.append)
    assert stats_of_path(root, 180).exists()


def stats_of_path(root, end):
    """Return where the statistics of a window lie."""
    return root / "stats" / f"{end:06d}.parquet"
