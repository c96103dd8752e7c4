"""What the benchmark of the diagnosis plans, keeps and counts."""

import dataclasses
import json
import math
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

LISTED, UNLISTED = ("alignment", "crowding", "robot-avoidance"), ("sound", "one-eye")


@pytest.fixture(scope="module")
def bench(scripts):
    """Return the script."""
    return scripts("bench_diagnosis")


@pytest.fixture
def planned(bench):
    """Return the module that plans."""
    return sys.modules["diagnosis_plan"]


@pytest.fixture
def ledger(bench):
    """Return the module that keeps rows."""
    return sys.modules["diagnosis_ledger"]


@pytest.fixture
def summary(bench):
    """Return the module that counts."""
    return sys.modules["diagnosis_summary"]


@pytest.fixture
def row(planned):
    """Return what makes a row of a finished trial."""

    def make(truth=(), names=(), *, ties=(), verdict=None, section=None, nats=None, **changed):
        if verdict is None:
            verdict = ("tie" if ties else "named") if names else "no-effect"
        section = section or ("listed" if truth else "nulls")
        scenario = planned.scenario(changed.pop("seed", 1))
        scenario["minutes"] = changed.pop("minutes", 30.0)
        effects = [{"name": name, "ties": [], "p": 1e-6} for name in names]
        if ties:
            effects[0]["ties"] = list(ties)
        made = {
            "section": section,
            "kind": truth[0] if truth else "plain",
            "scenario": scenario,
            "quick": True,
            "truth": list(truth),
            "verdict": verdict,
            "effects": effects,
            "nats": None if nats is None else {"total": nats},
            "cpu_s": 10.0,
            "wall_s": 20.0,
            "noise_m": 0.0,
        }
        return {**made, **changed}

    return make


def test_a_complete_plan_has_what_was_promised(planned):
    """20 seeds an effect, 5 at each other length and strength, 400 nulls in equal parts."""
    jobs = planned.plan(planned.Scale(), LISTED, UNLISTED, quick=False)

    def count(section, kind=None):
        return sum(job.section == section and kind in {None, job.kind} for job in jobs)

    assert count("listed", "crowding") == 20
    assert count("lengths", "crowding 2 min") == count("lengths", "crowding 10 min") == 5
    assert count("strengths", "crowding faint") == count("strengths", "crowding strong") == 5
    assert count("without-robot", "crowding") == 5
    assert [count("nulls", decoy) for decoy in planned.DECOYS] == [80] * 5
    assert count("extend", "alignment") == 3


def test_robot_avoidance_is_not_asked_for_without_a_robot(planned):
    """There is nothing to avoid."""
    jobs = planned.plan(planned.Scale(), LISTED, UNLISTED, quick=False)
    alone = {job.kind for job in jobs if job.section == "without-robot"}
    assert alone == {"alignment", "crowding"}


def test_no_seed_is_used_twice_and_none_that_was_tuned_on(planned):
    """Even with as many seeds as there may be."""
    full = planned.Scale(seeds=100, few=100, nulls=10_000, pairs=100, outside=100, extended=100)
    names = [str(number) for number in range(21)]
    jobs = planned.plan(full, names, UNLISTED, quick=False)
    seeds = [job.scenario["seed"] for job in jobs]
    assert len(seeds) == len(set(seeds))
    assert min(seeds) >= 20_000


def test_more_seeds_than_places_are_refused(planned):
    """They would run into those of the next effect."""
    with pytest.raises(ValueError, match="At most 100 seeds"):
        planned.Scale(seeds=101)


def test_a_smaller_plan_is_a_part_of_the_larger(planned, ledger):
    """So that what a short run has done need not be done again."""
    small = planned.Scale(seeds=2, few=1, nulls=20, pairs=1, outside=1, extended=1)
    parts = [
        {ledger.key_of(job.said()) for job in planned.plan(s, LISTED, UNLISTED, quick=True)}
        for s in (small, planned.Scale())
    ]
    assert parts[0] < parts[1]


def test_every_kind_of_a_section_comes_before_the_second_of_any(planned):
    """A run that is stopped early has a bit of everything, and times nothing beside others."""
    jobs = planned.plan(planned.Scale(), LISTED, UNLISTED, quick=True)
    for section in set(planned.SECTIONS) - {"time", "nulls"}:
        rounds = [job.round for job in jobs if job.section == section]
        assert rounds == sorted(rounds)
    assert {job.section for job in jobs[-2:]} == {"time"}


@pytest.mark.parametrize("n", [100, 250])
def test_any_first_part_of_the_plan_is_balanced(planned, n):
    """Each section has its share to within a trial, and the decoys are as many of each."""
    names = [str(number) for number in range(21)]
    jobs = planned.plan(planned.Scale(), names, UNLISTED, quick=True)[:n]
    whole = sum(planned.WEIGHTS.values())
    for section, weight in planned.WEIGHTS.items():
        count = sum(job.section == section for job in jobs)
        assert abs(count - n * weight / whole) <= 1.0, section
    decoys = [sum(job.kind == decoy for job in jobs) for decoy in planned.DECOYS]
    assert max(decoys) - min(decoys) <= 1
    strong = sum(job.section == "strengths" and "strong" in job.kind for job in jobs)
    assert strong >= 2


def test_noise_of_nulls_goes_from_three_tenths_to_two_millimetres(planned):
    """All five levels, with and without a robot."""
    jobs = planned.plan(planned.Scale(), LISTED, UNLISTED, quick=True)
    noisy = [job.scenario for job in jobs if job.kind == "noise"]
    assert {each["chain"]["noise_mm"] for each in noisy} == {0.3, 0.6, 1.0, 1.5, 2.0}
    assert {(e["chain"]["noise_mm"], e["robot"]) for e in noisy} >= {(2.0, True), (2.0, False)}


def test_scenarios_are_what_the_second_simulator_takes(planned, bench):
    """Every argument is named, and its defaults are spelt out."""
    from dataclasses import fields

    from hidden.chain import Chain
    from hidden.effects import EFFECTS
    from hidden.scenario import Scenario

    made = planned.scenario(1)
    assert set(made) == {field.name for field in fields(Scenario)}
    assert Scenario(**{**made, "chain": Chain(**made["chain"])}) == Scenario(seed=1)
    assert {name for pair in planned.PAIRED for name in pair} <= set(EFFECTS)


def test_an_unknown_argument_of_a_scenario_is_refused(planned):
    """It would be kept and make no difference."""
    with pytest.raises(ValueError, match="no minute"):
        planned.scenario(1, minute=2)


def test_a_torn_last_line_is_lost_and_nothing_else(ledger, tmp_path):
    """A kill in the middle of writing costs one trial; the next row begins a line of its own."""
    path = tmp_path / "rows.jsonl"
    ledger.append(path, {"key": "a"})
    with path.open("a") as file:
        file.write('{"key": "b", "na')
    assert ledger.read(path) == [{"key": "a"}]
    ledger.append(path, {"key": "c"})
    assert ledger.read(path) == [{"key": "a"}, {"key": "c"}]


def test_damage_elsewhere_is_told(ledger, tmp_path):
    """A line in the middle was never torn by a kill."""
    path = tmp_path / "rows.jsonl"
    path.write_text('{"key": "a"}\nnonsense\n{"key": "b"}\n')
    with pytest.raises(ValueError, match="line 2 is damaged"):
        ledger.read(path)


def test_fingerprints_see_code_and_no_words(ledger, tmp_path):
    """A comment or docstring costs no day of computing; a number does."""
    place = tmp_path / "code.py"

    def mark(text):
        place.write_text(text)
        return ledger.fingerprint(tmp_path, ("code.py",))

    first = mark('"""One."""\nx = 1  # why\n')
    assert mark('"""Another."""\n\nx = 1\n') == first
    assert mark('"""One."""\nx = 2  # why\n') != first


def test_tests_are_no_part_of_a_fingerprint(ledger, tmp_path):
    """They bear on no answer."""
    (tmp_path / "code.py").write_text("x = 1\n")
    before = ledger.fingerprint(tmp_path, (".",))
    (tmp_path / "test_code.py").write_text("y = 1\n")
    assert ledger.fingerprint(tmp_path, (".",)) == before


def test_keys_do_not_depend_on_the_order_of_entries(ledger):
    """Nor do they forget a value."""
    assert ledger.key_of({"a": 1, "b": 2}) == ledger.key_of({"b": 2, "a": 1})
    assert ledger.key_of({"a": 1, "b": 2}) != ledger.key_of({"a": 1, "b": 3})


def test_a_second_run_does_what_is_missing_or_has_failed(bench, planned, tmp_path):
    """Rows of other code count for nothing."""
    ledger = sys.modules["diagnosis_ledger"]
    jobs = [
        job
        for job in planned.plan(planned.Scale(), LISTED, UNLISTED, quick=True)
        if job.section == "listed"
    ][:4]
    desk = bench.Desk(folder=tmp_path, marks={"listed": "new"})
    old = bench.Desk(folder=tmp_path, marks={"listed": "old"})
    keys = [ledger.key_of(job.said()) for job in jobs]
    desk.keep("listed", {"key": keys[0], "quick": True, "verdict": "named"})
    desk.keep("listed", {"key": keys[1], "quick": True, "verdict": "error"})
    old.keep("listed", {"key": keys[2], "quick": True, "verdict": "named"})

    assert bench.missing(jobs, desk, ["listed"]) == jobs[1:]
    assert desk.n_stale("listed", list(desk.rows("listed").values())) == 1


def test_a_run_goes_on_from_trials_that_were_made_elsewhere(bench, ledger, tmp_path):
    """Those of the present code count; what is made here goes before."""
    made = [
        {"section": "listed", "key": "a", "code": "new", "verdict": "named"},
        {"section": "listed", "key": "b", "code": "old", "verdict": "named"},
        {"section": "nulls", "key": "c", "code": "new", "verdict": "no-effect"},
        {"section": "listed", "key": "d", "code": "new", "verdict": "error"},
    ]
    ledger.pack(tmp_path / "there.jsonl.gz", made)
    marks = {"listed": "new", "nulls": "new"}
    packed = ledger.read(tmp_path / "there.jsonl.gz")
    desk = bench.Desk(folder=tmp_path / "here", marks=marks, packed=packed)
    desk.keep("listed", {"key": "d", "verdict": "tie"})

    found = desk.rows("listed")
    assert {key: row["verdict"] for key, row in found.items()} == {"a": "named", "d": "tie"}
    assert set(desk.rows("nulls")) == {"c"}


def test_a_mode_that_the_present_code_was_not_asked_in_shows_what_another_said(bench, tmp_path):
    """With a fingerprint of its own; one trial of the present code takes its place."""
    document = sys.modules["diagnosis_document"]
    marks = dict.fromkeys(sys.modules["diagnosis_plan"].SECTIONS, "new")
    desk = bench.Desk(folder=tmp_path, marks=marks)
    for key, code, quick in (
        ("a", "old", True), ("b", "old", True), ("c", "older", True),
        ("d", "old", False), ("e", "new", False),
    ):  # fmt: skip
        other = bench.Desk(folder=tmp_path, marks={"listed": code})
        other.keep("listed", {"key": key, "quick": quick, "verdict": "named"})

    assert [row["key"] for row in bench.told(desk)] == ["a", "b", "e"]
    assert desk.n_stale("listed", bench.told(desk)) == 2
    assert desk.marks_of(quick=True)["listed"] == "old"
    assert desk.marks_of(quick=False) == marks
    codes = {
        mode: {"diagnosis": desk.marks_of(quick=mode == "quick")["listed"], "extension": "x"}
        for mode in ("full", "quick")
    }
    assert document._codes({"code": codes, "modes": codes}) == (
        "with 39 replicates: diagnosis new, extension x; with `--quick`: diagnosis old, extension x"
    )
    desk.keep("listed", {"key": "f", "quick": True, "verdict": "named"})
    assert [row["key"] for row in bench.told(desk)] == ["f", "e"]


def test_the_same_trials_are_packed_to_the_same_bytes(ledger, tmp_path):
    """Whatever their order and the time of day."""
    made = [{"key": "a", "n": 1}, {"n": 2, "key": "b"}]
    ledger.pack(tmp_path / "one.gz", made)
    ledger.pack(tmp_path / "other.gz", [{"key": "b", "n": 2}, made[0]])
    assert (tmp_path / "one.gz").read_bytes() == (tmp_path / "other.gz").read_bytes()


def test_a_section_that_cannot_be_run_says_what_it_needs(bench, planned, monkeypatch, tmp_path):
    """And is left out of what is missing."""
    trial = sys.modules["diagnosis_trial"]
    monkeypatch.setattr(trial, "_has", lambda _module: False)
    jobs = planned.plan(planned.Scale(), LISTED, UNLISTED, quick=True)
    desk = bench.Desk(folder=tmp_path, marks=dict.fromkeys(planned.SECTIONS, "now"))

    assert trial.lacks("video") == "needs zfcal track"
    assert trial.lacks("listed") is None
    assert bench.missing(jobs, desk, ["video", "extend"]) == []


def test_wilson_by_hand(summary):
    """0 of 10: from nothing to z^2 / (n + z^2) = 3.8415 / 13.8415."""
    found = summary.rate(0, 10)
    assert found["share"] == 0.0
    assert found["low"] == pytest.approx(0.0, abs=1e-4)
    assert found["high"] == pytest.approx(3.8415 / 13.8415, abs=1e-4)


def test_a_share_of_nothing_is_not_known(summary):
    """It is neither zero nor one."""
    assert summary.rate(0, 0)["share"] is None


def test_a_tie_is_neither_right_nor_wrong(summary, row):
    """Whether or not it holds the hidden effect, first or last, which is told apart."""
    leads = row(("alignment",), ("alignment",), ties=("crowding",))
    holds = row(("alignment",), ("crowding",), ties=("alignment",))
    misses = row(("alignment",), ("crowding",), ties=("fatigue",))
    for each in (leads, holds, misses):
        assert not summary.is_right(each)
        assert not summary.has_wrong_name(each)
        assert summary.answer(each) == "tie"
    assert summary.is_tie_with_truth(leads)
    assert summary.is_tie_with_truth(holds)
    assert not summary.is_tie_with_truth(misses)


def test_a_second_name_that_is_not_hidden_is_wrong(summary, row):
    """Although the first is right."""
    each = row(("alignment",), ("alignment", "crowding"))
    assert summary.is_right(each)
    assert summary.has_wrong_name(each)
    assert not summary.names_first_wrong(each)


def test_a_generic_name_is_no_listed_one(summary, row):
    """It is beyond the list, and wrong where a listed effect was hidden."""
    each = row(("alignment",), ("generic:speed:time",))
    assert summary.answer(each) == "beyond the list"
    assert summary.has_wrong_name(each)
    assert not summary.has_wrong_listed_name(each)


def test_unexplained_is_a_false_alarm_and_untestable_is_none(summary, row):
    """Where nothing is hidden, nothing is to be said."""
    assert summary.says_something(row(verdict="unexplained"))
    assert not summary.says_something(row(verdict="untestable"))
    assert not summary.says_something(row(verdict="error"))


def test_effects_outside_the_list_may_get_names_that_describe_them(summary, row):
    """Waxing walls are a wall's persistence in part; one eye is no place preference."""
    fits = row(("waxing-walls",), ("wall-persistence",), section="outside")
    fails = row(("one-eye",), ("place-preference",), section="outside")
    generic = row(("one-eye",), ("generic:heading:neighbour",), section="outside")
    assert [summary.misdescribes(each) for each in (fits, fails, generic)] == [False, True, False]


def test_every_effect_outside_the_list_says_what_describes_it(summary, bench):
    """A new one cannot be forgotten, nor can a name be misspelt."""
    from hidden.effects import LISTED as LISTED_NOW
    from hidden.effects import UNLISTED as UNLISTED_NOW

    assert set(summary.DESCRIBES) == set(UNLISTED_NOW)
    assert {name for fitting in summary.DESCRIBES.values() for name in fitting} <= set(LISTED_NOW)


def test_confusion_and_its_inversion_count_the_same_trials(summary, row):
    """Two of alignment's three are found; of two that say crowding one hides it."""
    rows = [
        row(("alignment",), ("alignment",)),
        row(("alignment",), ("alignment",)),
        row(("alignment",), ("crowding",)),
        row(("crowding",), ("crowding",)),
        row(),
    ]
    matrix = summary.confusion(rows)
    assert matrix["alignment"] == {"alignment": 2, "crowding": 1}
    assert matrix["nothing"] == {"no-effect": 1}
    turned = summary.inversion(matrix)
    assert turned["crowding"]["hidden"] == {"alignment": 1, "crowding": 1}
    assert turned["crowding"]["rate"]["share"] == pytest.approx(0.5)
    assert turned["alignment"]["rate"]["share"] == pytest.approx(1.0)


def test_targets_take_only_the_trials_that_they_are_about(summary, row):
    """30 minutes with a robot: a short trial and one of 60 nats count for neither."""
    rows = [
        row(("alignment",), ("alignment",), nats=150.0),
        row(("alignment",), (), nats=150.0),
        row(("alignment",), (), nats=150.0, minutes=2.0, section="lengths"),
        row(("alignment",), (), nats=60.0),
        row(("alignment",), ("alignment",), nats=30.0, section="strengths"),
        row(verdict="unexplained"),
        row(),
    ]
    found = {each["what"]: each for each in summary.targets(rows)}
    assert (found["named rightly, at least 100 nats"]["hits"],
            found["named rightly, at least 100 nats"]["n"]) == (1, 2)  # fmt: skip
    assert found["named rightly, 20 to 50 nats"]["share"] == pytest.approx(1.0)
    assert found["nulls and decoys: says anything at all"]["share"] == pytest.approx(0.5)
    assert found["nulls and decoys: names or ties an effect"]["share"] == pytest.approx(0.0)


def test_both_of_a_pair_must_be_named(summary, row):
    """One of two is not enough."""
    pair = ("alignment", "crowding")
    rows = [row(pair, pair[::-1], section="pairs"), row(pair, pair[:1], section="pairs")]
    found = {each["what"]: each for each in summary.targets(rows)}
    assert found["both of a pair named"]["share"] == pytest.approx(0.5)


def test_power_puts_each_trial_in_one_bin_of_nats(summary, row):
    """Edges belong to the bin above; less than nothing counts as nothing."""
    rows = [row(("alignment",), ("alignment",), nats=n) for n in (-3.0, 20.0, 49.9, 800.0)]
    bins = [each for each in summary.power(rows) if each["minutes"] is None]
    assert [each["right"]["n"] for each in bins] == [1, 2, 0, 0, 0, 1]
    assert bins[-1]["nats"] == [500, None]


def test_gaps_are_medians_over_extended_trials(summary, row):
    """Of each measure, what is closed and what the placebo closes; None does not count."""
    rows = [
        row(("alignment",), ("alignment",), section="extend",
            gap=[{"measure": "effect", "closed": closed, "placebo": None}])
        for closed in (0.7, 0.9, 1.0)
    ]  # fmt: skip
    found = summary.gaps(rows)["effect"]
    assert found["closed"]["median"] == pytest.approx(0.9)
    assert found["placebo"] == {"n": 0, "low": None, "median": None, "high": None}


def test_the_document_says_that_a_run_is_partial(bench, summary, row, tmp_path):
    """Numbers, document and figures are made of however few trials there are."""
    rows = [
        row(("alignment",), ("alignment",), nats=150.0),
        row(("alignment",), ("fatigue",), nats=150.0, seed=2),
        row(seed=3),
    ]
    planned = dict.fromkeys(sys.modules["diagnosis_plan"].SECTIONS, 20)
    found = {
        "machine": "a machine",
        "code": {mode: {"diagnosis": "0", "extension": "1"} for mode in ("full", "quick")},
        **summary.summarise(rows, planned=planned, lacking={"video": "needs zfcal track"}),
    }
    bench.publish(found, sys.modules["regressions"].Places(results=tmp_path, docs=tmp_path))

    text = (tmp_path / "benchmarks-diagnosis.md").read_text()
    assert "**A partial run.** Of 180 planned trials 3 with `--quick` were run" in text.replace(
        "\n", " "
    )
    assert "Not run: needs zfcal track." in text
    assert "| alignment | 100 % (1/1, 21 to 100) | – |" in text
    assert "| fatigue | 0 % (0/1, 0 to 79) | alignment 1 |" in text
    assert "| no-effect | – | nothing 1 |" in text
    kept = json.loads((tmp_path / "diagnosis.json").read_text())
    assert [trial["answer"] for trial in kept["trials"]] == ["alignment", "fatigue", "no-effect"]
    assert all(not math.isnan(trial["cpu_s"]) for trial in kept["trials"])
    for figure in ("confusion", "power"):
        assert (tmp_path / "pictures" / f"diagnosis-{figure}-quick.png").stat().st_size > 5000


def test_trials_through_video_are_told_one_by_one(bench, summary, row):
    """What was hidden, how strong, and what was said; those that failed are not among them."""
    document = sys.modules["diagnosis_document"]
    rows = [
        {**row(("alignment",), ("alignment",), section="video", nats=76.4), "kind": "alignment"},
        {**row(("alignment",), section="video", nats=90.0, seed=2), "kind": "alignment"},
        {**row(("crowding",), section="video", nats=80.0, seed=3), "error": "no video"},
    ]
    found = summary.summarise(rows, planned={"video": 5}, lacking={})
    text = "".join(document._through_video(found))
    assert "| alignment | 76 | alignment |" in text
    assert "| alignment | 90 | no-effect |" in text
    assert "80" not in text


def test_a_complete_run_says_so(bench, summary, row):
    """With all that was planned in the mode with replicates."""
    document = sys.modules["diagnosis_document"]
    rows = [{**row(("alignment",), ("alignment",), nats=150.0), "quick": False}]
    found = summary.summarise(rows, planned={"listed": 1}, lacking={})
    assert document._completeness(found) == "A complete run with 39 replicates.\n"
    more = summary.summarise(rows, planned={"listed": 2}, lacking={})
    assert "partial" in document._completeness(more)
    short = summary.summarise([{**rows[0], "quick": True}], planned={"listed": 1}, lacking={})
    assert "Complete with `--quick`**, 1 trial" in document._completeness(short)
    assert "0 of them" in document._completeness(short)


@pytest.fixture
def worked(bench, planned, row, monkeypatch, tmp_path):
    """Return what works on jobs with threads and answers at once, and what it was asked."""
    trial, asked = sys.modules["diagnosis_trial"], []

    def answer_at_once(job, nats):
        asked.append((job.kind, nats))
        key = sys.modules["diagnosis_ledger"].key_of(job.said())
        return {**row((job.kind,), (job.kind,), nats=7.0), **job.said(), "key": key, "all_s": 1.0}

    def threads(workers, **_of_processes):
        return ThreadPoolExecutor(workers)

    monkeypatch.setattr(trial, "run", answer_at_once)
    monkeypatch.setattr(bench, "ProcessPoolExecutor", threads)
    marks = dict.fromkeys((*planned.SECTIONS, trial.ORACLE), "now")
    desk = bench.Desk(folder=tmp_path, marks=marks)

    def work(jobs, deadline_s=math.inf):
        bench.work(jobs, desk, workers=1, deadline_s=deadline_s)
        return asked

    return work, desk


def test_every_trial_is_kept_when_it_is_done(bench, planned, worked):
    """And then there is nothing missing."""
    work, desk = worked
    jobs = planned.plan(planned.Scale(seeds=2), LISTED, (), quick=True)
    jobs = [job for job in jobs if job.section == "listed"]
    work(jobs)
    assert len(desk.rows("listed")) == 6
    assert bench.missing(jobs, desk, ["listed"]) == []


def test_the_oracle_counts_once_whatever_the_mode(planned, worked):
    """What it saw of a scenario is kept: it takes longer than the diagnosis."""
    work, _ = worked
    jobs = planned.plan(planned.Scale(seeds=1), LISTED[:1], (), quick=True)
    (job,) = (job for job in jobs if job.section == "listed")
    work([job])
    assert work([dataclasses.replace(job, quick=False)]) == [
        ("alignment", None),
        ("alignment", {"total": 7.0}),
    ]


@pytest.mark.slow
def test_a_trial_through_video_is_tracked(bench, planned):
    """Its positions are the tracker's: they err, where those of the table do not."""
    film = sys.modules["diagnosis_film"]
    asked = planned.scenario(1_049_001, minutes=0.5)
    job = planned.Job(section="video", kind="nothing", round=0, scenario=asked, quick=True)
    made = film.run(job, None)
    assert made.get("error") is None
    assert made["verdict"] == "untestable"
    assert 2e-5 < made["noise_m"] < 1e-3


def test_trials_through_video_are_run_by_what_films_them(planned, worked, monkeypatch):
    """Not from the table, as all others."""
    work, _ = worked
    monkeypatch.setattr(sys.modules["diagnosis_film"], "run", sys.modules["diagnosis_trial"].run)
    monkeypatch.setattr(sys.modules["diagnosis_trial"], "run", None)
    (job, *_) = [
        job
        for job in planned.plan(planned.Scale(), LISTED, (), quick=True)
        if job.section == "video"
    ]
    assert len(work([job])) == 1


def test_no_trial_begins_after_the_deadline(planned, worked):
    """What is under way ends."""
    work, desk = worked
    jobs = planned.plan(planned.Scale(seeds=1), LISTED, (), quick=True)
    assert work(jobs[:3], deadline_s=-math.inf) == []
    assert desk.rows("listed") == {}
