"""What the comparison of optimisers makes of its numbers; the packages compared are not needed."""

import numpy as np
import pytest

OURS, OTHER, SLOW = "ours", "another", "slow"


@pytest.fixture
def document(scripts):
    """Return the module that makes the table."""
    return scripts("optimisers_document")


class Answers:
    """An objective whose features are the first four genes."""

    def __init__(self, group):
        self.group = group

    def __call__(self, genes):
        """Return four features for each genome."""
        return genes[:, :4]


class Ticks:
    """A clock that moves by a second with each answer."""

    elapsed_s = 0.0

    def advance(self, at_once):
        """Half of it before the answer, half after it."""
        assert at_once >= 1
        self.elapsed_s += 0.5


@pytest.fixture
def recorder(scripts, stand_in_group):
    """Return what makes a recorder of a plain objective."""

    def make(**limits):
        made = scripts("recorder").Recorder
        return made(evaluate=Answers(stand_in_group), clock=Ticks(), **limits)

    return make


@pytest.fixture
def stand_in_group(scripts):
    """Return two cores' worth of a group that nobody simulates."""
    synthetic = scripts("synthetic")
    arena, template = synthetic.two_rooms()
    return synthetic.Group(arena=arena, template=template, n_fish=4, n_robots=1, n_workers=2)


def rows(scores, *, n=960, peer=None):
    """Return what an optimiser of this S reached."""
    one = {"S": scores, "held_out_S": 0.5, "hypervolume": 0.25, "own_S": 0.9, "n": n, "s": 2.0}
    return {"evaluations": one, "seconds": one, "peer": peer}


def results(pairs):
    """Return the JSON of windows on which ours and another reached these."""
    fixed = {"S": 0.6, "held_out_S": 0.6}
    return {
        "machine": "none",
        "load_before": 0.0,
        "load_after": 0.0,
        "effort": {"chosen": {"natural": [1]}, "steps": 3000, "long_runs": 3,
                   "evaluations": 960, "seconds": 4.0, "slow_s": 10.0},
        "windows": [
            {"truth": "natural", "seed": k, "unchanged": fixed, "model itself": fixed,
             "optimisers": {OURS: rows(ours), OTHER: rows(other),
                            SLOW: rows(0.7, n=30, peer=rows(0.35)["evaluations"])}}
            for k, (ours, other) in enumerate(pairs)
        ],
    }  # fmt: skip


def test_who_is_ahead_on_all_of_six_windows_wins(document):
    """By luck alone that happens to either of two equals once in 32 times."""
    pairs = [(0.8, 0.8 + 0.01 * k) for k in range(1, 7)]
    assert document.chance(pairs) == pytest.approx(2 / 2**6)
    assert document.winners(results([(o, x) for o, x in pairs])) == [OTHER]


@pytest.mark.parametrize("last", [0.0, 0.79])
def test_who_is_behind_on_the_widest_of_six_windows_does_not_win(document, last):
    """Nor who is level everywhere, or ahead on five windows only."""
    pairs = [(0.8, 0.81 + 0.01 * k) for k in range(5)] + [(0.9, last)]
    assert document.winners(results(pairs)) == []
    assert document.winners(results([(0.8, 0.8)] * 6)) == []
    assert document.winners(results(pairs[:5])) == []


def test_who_was_too_slow_is_compared_with_as_many_evaluations(document):
    """0.7 against 0.35 after thirty evaluations is twice as much; after four seconds it is less."""
    found = results([(0.8, 0.9)] * 6)
    assert document._against(found, SLOW, "evaluations") == "2.000 (6 of 6)"
    assert document._against(found, SLOW, "seconds") == "0.875 (0 of 6)"


def test_the_table_has_a_row_for_everybody(document):
    """Optimisers, last window's parameters and the truth; the first has no ratio to itself."""
    text = document.markdown(results([(0.8, 0.9)] * 6))
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    assert lines[1].startswith("| ours | 0.800 |  | 0.500 |  | 0.250 | 2.0 |")
    assert lines[2].startswith("| another | 0.900 | 1.125 (6 of 6) | 0.500 | 1.000 (0 of 6) |")
    assert "30 in 2.0" in lines[3]
    assert [line.split(" | ")[0] for line in lines[4:6]] == [
        "| last window's parameters, unchanged",
        "| the model that moved the fish",
    ]
    assert "Ahead of NSGA-II of zfcal at equal evaluations and at equal seconds: another." in text


def test_a_search_ends_when_it_has_had_both_its_evaluations_and_its_time(scripts, recorder):
    """Twenty genomes and five seconds, ten genomes a second: after the sixth."""
    ask = recorder(evaluations=20, seconds=5.0)
    genes = np.full((10, 18), 0.5)
    for _ in range(5):
        ask(genes)
    with pytest.raises(scripts("recorder").EnoughError):
        ask(genes)


def test_a_slow_search_is_stopped(scripts, recorder):
    """After three seconds, whatever it lacks."""
    ask = recorder(evaluations=1000, seconds=5.0, at_most_s=2.5)
    ask.score(np.full(18, 0.5))
    ask.score(np.full(18, 0.5))
    with pytest.raises(scripts("recorder").EnoughError):
        ask.score(np.full(18, 0.5))


def test_what_had_been_answered_by_then(recorder):
    """Fifteen genomes of batches of ten came with the second batch; one second brought one."""
    ask = recorder(evaluations=1000, seconds=99.0)
    genes = np.random.default_rng(1).random((30, 18))
    for part in np.split(genes, 3):
        ask(part)
    had = ask.until(evaluations=15)
    assert (had.genes == genes[:15]).all()
    assert (had.features == genes[:15, :4]).all()
    assert had.seconds == 2.0
    assert len(ask.until(seconds=1.5).genes) == 10
    assert len(ask.until(seconds=0.1).genes) == 10
    assert ask.until(evaluations=1000).seconds == 3.0


def test_a_quiet_clock_divides_what_other_threads_do(scripts, monkeypatch):
    """A second of the main thread and four of others on two cores: three; alone: five."""
    module = scripts("recorder")
    times = iter([(0.0, 0.0), (1.0, 5.0), (2.0, 10.0)])
    now = [0.0, 0.0]

    def thread_time():
        now[:] = next(times)
        return now[0]

    monkeypatch.setattr(module.time, "thread_time", thread_time)
    monkeypatch.setattr(module.time, "process_time", lambda: now[1])
    clock = module.QuietClock(2)
    clock.advance(at_once=60)
    assert clock.elapsed_s == 3.0
    clock.advance(at_once=1)
    assert clock.elapsed_s == 8.0


def test_what_is_reported_was_not_developed_on(scripts):
    """No seed and no random truth is in both."""
    synthetic = scripts("synthetic")
    chosen = (synthetic.DEVELOPMENT, synthetic.REPORTED, synthetic.MORE)
    seeds = [{seed for part in one.values() for seed in part} for one in chosen]
    assert not seeds[0] & (seeds[1] | seeds[2])
    random = [{name for name in one if name.startswith("random")} for one in chosen]
    assert not random[0] & (random[1] | random[2])


def test_a_window_is_two_minutes_of_what_the_fish_did(scripts):
    """Four fish on 600 samples; the half hour after it is held out."""
    window = scripts("synthetic").make_window("natural", 1, n_workers=2)
    assert window.samples.xy_m.shape == (600, 5, 2)
    assert window.task.control.occupation.sum() == 4 * 600
    assert window.held_out.occupation.sum() == 4 * 9000
    assert window.before.seeds != window.task.seeds
    again = scripts("synthetic").make_window("natural", 1, n_workers=1)
    assert (again.samples.xy_m == window.samples.xy_m).all()
