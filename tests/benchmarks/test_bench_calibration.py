"""The benchmarks of calibration, each run small; who wins, what is fresh, what is committed."""

import json
from pathlib import Path

import numpy as np
import pytest

from zfcal.parameters import to_genes


@pytest.mark.slow
def test_the_benchmark_of_a_round_runs(tiny):
    """Both schedules, and the optimiser alone."""
    found, text = tiny("calibration/bench_calibration.py")
    assert len(found["rounds"]) == 2
    assert found["overhead"]["breeding_last_ms"] > 0
    assert text.count("\n| ") == 2 + 1 + 3 + 1


@pytest.mark.slow
def test_the_benchmark_of_a_cluster_runs(tiny):
    """Everywhere the same numbers come out."""
    found, text = tiny("calibration/bench_cluster.py")
    assert {"cluster, 1 worker", "cluster, 2 workers"} <= set(found["places"])
    assert "All places counted the same, bit for bit." in text


@pytest.mark.slow
def test_the_benchmark_of_coverage_runs(tiny):
    """Two kinds of intervals of each kind of parameter, and of gammas once more."""
    found, text = tiny("calibration/bench_coverage.py")
    assert set(found["kinds"]) == {"kappa_0", "kappa_f", "alpha", "gamma"}
    assert text.count("| by profile |") == text.count("| symmetric |") == 4 + 1
    for one in found["kinds"].values():
        held = one["profile"]["held"]
        assert sorted(held) == held
        assert held[-1] <= one["n"]


@pytest.mark.slow
def test_the_benchmark_of_the_papers_way_runs(tiny, tmp_path):
    """One virtual trial: three rounds, of which the first has a window that follows."""
    found, text = tiny("calibration/bench_as_published.py", "--build", tmp_path / "build")
    (row,) = found["rows"]
    assert [each["end_s"] for each in row["rounds"]] == [120, 180, 240]
    assert [each["forward"] is None for each in row["rounds"]] == [False, True, True]
    assert "| as published | 0." in text


def test_differences_to_the_papers_way_are_taken_trial_by_trial(script):
    """By 0.1 and 0.3 more: 0.2, and a standard error of 0.1."""
    scores = {"as published": (0.5, 0.6), "other": (0.6, 0.9)}
    rows = []
    for way, each in scores.items():
        for seed, s in enumerate(each):
            one = {"reported": s, "anew": s, "forward": s, "ceiling": 0.8}
            rows.append({"seed": seed, "way": way, "rounds": [one]})
    found = {"machine": "one", "minutes": 4, "generations": 1, "rows": rows}

    text = script("calibration.bench_as_published").markdown(found)

    assert "| as published | 0.550 ± 0.050 |" in text
    assert "| other | +0.200 ± 0.100 |" in text


def test_a_share_has_its_binomial_interval(script):
    """None of ten: up to 1 - 0.025 ** 0.1."""
    share_and_ends = script("calibration.bench_coverage").share_and_ends
    assert share_and_ends(0, 10) == pytest.approx((0.0, 0.0, 1 - 0.025**0.1))
    assert share_and_ends(10, 10) == pytest.approx((1.0, 0.025**0.1, 1.0))


def test_committed_intervals_hold_the_truth_as_often_as_they_say(script, repository):
    """At 95 %, of each kind of parameter, over two hundred trials or more."""
    path = repository / "benchmarks" / "results" / "coverage.json"
    found = json.loads(path.read_text(encoding="utf-8"))
    assert found["trials"] >= 200
    for one in (*found["kinds"].values(), found["gamma_below_the_largest"]):
        _, low, high = one["profile"]["shares"][-1]
        assert high >= 0.95
        assert low <= 0.98


def test_truths_of_coverage_lie_within_what_a_genome_can_hold(script):
    """And are spread by 0.3 in their logs, where the bound does not cut them off."""
    coverage = script("calibration.bench_coverage")
    _, template = script("calibration.synthetic").two_rooms()
    genes = [to_genes(coverage.truth_of(seed, template)) for seed in range(400)]
    assert max(map(max, genes)) <= 1.0
    assert np.log([each[0] for each in genes]).std() == pytest.approx(0.3, rel=0.2)


@pytest.mark.slow
def test_the_benchmark_of_the_main_job_runs(tiny):
    """From the start of a process to recovered parameters."""
    found, text = tiny("calibration/bench_main_job.py")
    assert {"start_up", "analyse", "kernel", "generations"} <= set(found)
    assert "| kernel: " in text


@pytest.mark.slow
def test_the_benchmark_of_optimisers_runs(tiny):
    """Every optimiser has its row."""
    for package in ("cma", "pymoo", "skopt"):
        pytest.importorskip(package, reason="in requirements-bench.lock")
    found, text = tiny("calibration/bench_optimisers.py")
    (window,) = found["windows"]
    for name in window["optimisers"]:
        assert f"| {name} | " in text


@pytest.mark.slow
def test_the_benchmark_of_rounds_runs(tiny, tmp_path):
    """Two trials, with a picture."""
    found, text = tiny("calibration/bench_rounds.py")
    assert len(found["simulated"]) == 2
    assert "S over the rounds" in text
    assert (tmp_path / "pictures" / "rounds.png").stat().st_size > 5000


OURS, OTHER, SLOW = "ours", "another", "slow"


@pytest.fixture
def document(script):
    """Return the module that makes the table of optimisers."""
    return script("calibration.optimisers_document")


def rows(scores, *, n=960, peer=None):
    """Return what an optimiser of this S reached."""
    one = {"S": scores, "held_out_S": 0.5, "hypervolume": 0.25, "own_S": 0.9, "n": n, "s": 2.0}
    return {"evaluations": one, "seconds": one, "peer": peer}


def results(pairs):
    """Return the JSON of windows on which ours and another reached these."""
    fixed = {"S": 0.6, "held_out_S": 0.6}
    return {
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


def test_what_is_reported_was_not_developed_on(script):
    """No seed and no random truth is in both."""
    synthetic = script("calibration.synthetic")
    chosen = (synthetic.DEVELOPMENT, synthetic.REPORTED, synthetic.MORE)
    seeds = [{seed for part in one.values() for seed in part} for one in chosen]
    assert not seeds[0] & (seeds[1] | seeds[2])
    random = [{name for name in one if name.startswith("random")} for one in chosen]
    assert not random[0] & (random[1] | random[2])


@pytest.mark.parametrize(("words", "n"), [([], 2), (["--full"], 6), (["--write"], 6)])
def test_committed_rounds_are_measured_in_full(script, words, n):
    """And what is measured by default is among them, to be compared with."""
    rounds = script("calibration.bench_rounds")
    options_of = rounds.parser(rounds.__doc__)
    options_of.add_argument("--full", action="store_true")
    seeds = rounds.effort_of(options_of.parse_args(words)).seeds
    assert len(seeds) == n
    assert set(seeds) <= set(rounds.FULL.seeds)


@pytest.mark.slow
def test_the_benchmark_of_publishing_runs(command):
    """The parts of the rules are among the whole round."""
    done = command("calibration/publishing_cost.py", "--minutes", "4", "--budget", "3")
    found = json.loads(done.stdout)
    seconds = found["seconds"]
    assert 0 < seconds["simulations of the models"] < seconds["all of judging and handing on"]
    assert 0 < found["share_of_the_rules"] < 1


@pytest.mark.slow
def test_the_picture_of_the_model_shows_what_the_page_says(script):
    """Alone a hill ahead, at a wall two along it, beside others more toward them; all sum to 1."""
    picture = script("calibration.model_picture")
    arena = picture.load_arena("open-square", Path())
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    natural = picture.natural(zones, dt_s=picture.DT_S)
    for name, (_, ahead) in picture.PLACES.items():
        theta, alone = picture.density(natural, arena, name, 1)
        _, beside = picture.density(natural, arena, name, 3)
        assert np.trapezoid(alone, theta) == pytest.approx(1.0)
        assert np.trapezoid(beside, theta) == pytest.approx(1.0)
        back = int(np.argmin(np.cos(theta - ahead)))
        is_at_wall = name == "near a wall"
        assert abs(theta[np.argmax(alone[90:271]) + 90] - ahead) < 0.05
        assert (alone[back] > 0.9 * alone.max()) == is_at_wall
        xy, _ = picture.poses(arena, name)
        toward = np.arctan2(*(xy[1] - xy[0])[::-1])
        there = int(np.argmin(np.abs(theta - toward)))
        assert beside[there] > alone[there]
    assert len(picture.draw(natural, arena).axes) == 4
