"""The benchmark of the diagnosis, run small; whose trials it counts, and as what."""

import json

import pytest

LISTED, UNLISTED = ("alignment", "crowding", "robot-avoidance"), ("sound", "one-eye")


@pytest.fixture
def bench(script):
    """Return the script."""
    return script("diagnosis.bench_diagnosis")


@pytest.fixture
def planned(script):
    """Return the module that plans."""
    return script("diagnosis.plan")


@pytest.fixture
def ledger(script):
    """Return the module that keeps rows."""
    return script("diagnosis.ledger")


@pytest.fixture
def summary(script):
    """Return the module that counts."""
    return script("diagnosis.summary")


@pytest.fixture
def answers(script):
    """Return the module that judges one row."""
    return script("diagnosis.answers")


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


@pytest.mark.slow
def test_a_trial_is_hidden_diagnosed_kept_and_told(command, ledger, tmp_path):
    """The document counts what is begun in six seconds, and no trial of other code beside it."""
    build, out = tmp_path / "build", tmp_path / "out"
    least = ("--quick", "--sections", "lengths", "--few", "1", "--minutes", "0.1")
    (tmp_path / "none.jsonl").touch()
    places = ("--build", build, "--stored", tmp_path / "none.jsonl", "--out", out)
    command("diagnosis/bench_diagnosis.py", *least, "--workers", "1", *places)

    rows = ledger.read(build / "lengths.jsonl")
    assert rows
    assert [row["error"] for row in rows if row["verdict"] == "error"] == []
    found = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    assert {found["code"]["quick"]["diagnosis"]} == {row["code"] for row in rows}
    told = [trial["seed"] for trial in found["trials"] if trial["quick"]]
    assert told == sorted(row["scenario"]["seed"] for row in rows)
    text = (out / "benchmarks-diagnosis.md").read_text(encoding="utf-8")
    assert "**A partial run.**" in text
    assert (out / "pictures" / "diagnosis-confusion-quick.png").stat().st_size > 5000


def test_stored_trials_that_are_not_there_are_refused(bench, monkeypatch, tmp_path):
    """Else what is written in their place would hold fewer."""
    place = tmp_path / "none.jsonl.gz"
    monkeypatch.setattr("sys.argv", ["bench", "--report", "--stored", str(place)])
    with pytest.raises(SystemExit, match="there is no such file"):
        bench.main()


@pytest.mark.slow
def test_a_trial_through_video_is_tracked(script, planned):
    """Its positions are the tracker's: they err, where those of the table do not."""
    asked = planned.scenario(1_049_001, minutes=0.5)
    job = planned.Job(section="video", kind="nothing", round=0, scenario=asked, quick=True)
    made = script("diagnosis.film").run(job, None)
    assert made.get("error") is None
    assert made["verdict"] == "untestable"
    assert 2e-5 < made["noise_m"] < 1e-3


def test_no_seed_is_used_twice_and_none_that_was_tuned_on(planned):
    """Even with as many seeds as there may be."""
    full = planned.Scale(seeds=100, few=100, nulls=10_000, pairs=100, outside=100, extended=100,
                         further=100)  # fmt: skip
    names = [str(number) for number in range(21)]
    jobs = planned.plan(full, names, UNLISTED, [f"{name}/{k}" for name in names for k in "ab"],
                        quick=False)  # fmt: skip
    seeds = [job.scenario["seed"] for job in jobs]
    assert len(seeds) == len(set(seeds))
    assert min(seeds) >= 320_000
    with pytest.raises(ValueError, match="At most 100 seeds"):
        planned.Scale(seeds=101)


def test_fingerprints_see_code_and_no_words(ledger, tmp_path):
    """A comment or docstring costs no day of computing, nor does a test; a number does."""
    place = tmp_path / "code.py"

    def mark(text):
        place.write_text(text)
        return ledger.fingerprint(tmp_path, (".",))

    first = mark('"""One."""\nx = 1  # why\n')
    (tmp_path / "test_code.py").write_text("y = 1\n")
    assert mark('"""Another."""\n\nx = 1\n') == first
    assert mark('"""One."""\nx = 2  # why\n') != first


def test_fingerprints_are_of_files_that_are_there(script, repository):
    """A folder that moved would drop out of them, and trials of other code would count."""
    trial, film = script("diagnosis.trial"), script("diagnosis.film")
    places = {*trial._EXTENSION, *film._CODE}
    assert [place for place in sorted(places) if not (repository / place).exists()] == []


def test_a_line_that_a_kill_has_torn_is_left_out(ledger, tmp_path):
    """And the next begins on a line of its own."""
    path = tmp_path / "rows.jsonl"
    ledger.append(path, {"key": "a"})
    with path.open("a") as file:
        file.write('{"key": "b", "na')
    assert ledger.read(path) == [{"key": "a"}]
    ledger.append(path, {"key": "c"})
    assert ledger.read(path) == [{"key": "a"}, {"key": "c"}]


def test_a_second_run_does_what_is_missing_or_has_failed(bench, planned, ledger, tmp_path):
    """Rows of other code count for nothing."""
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


def test_a_mode_that_the_present_code_was_not_asked_in_shows_what_another_said(
    script, bench, planned, tmp_path
):
    """With a fingerprint of its own; one trial of the present code takes its place."""
    document = script("diagnosis.document")
    marks = dict.fromkeys(planned.SECTIONS, "new")
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


def test_a_tie_is_neither_right_nor_wrong(row, answers):
    """Whether or not it holds the hidden effect, first or last, which is told apart."""
    leads = row(("alignment",), ("alignment",), ties=("crowding",))
    holds = row(("alignment",), ("crowding",), ties=("alignment",))
    misses = row(("alignment",), ("crowding",), ties=("fatigue",))
    for each in (leads, holds, misses):
        assert not answers.is_right(each)
        assert not answers.has_wrong_name(each)
        assert answers.answer(each) == "tie"
    assert answers.is_tie_with_truth(leads)
    assert answers.is_tie_with_truth(holds)
    assert not answers.is_tie_with_truth(misses)


def test_a_second_name_that_is_not_hidden_is_wrong(row, answers):
    """Although the first is right; so is a generic name, which is beyond the list."""
    each = row(("alignment",), ("alignment", "crowding"))
    assert answers.is_right(each)
    assert answers.has_wrong_name(each)
    assert not answers.names_first_wrong(each)
    generic = row(("alignment",), ("generic:speed:time",))
    assert answers.answer(generic) == "beyond the list"
    assert answers.has_wrong_name(generic)
    assert not answers.has_wrong_listed_name(generic)


def test_unexplained_is_a_false_alarm_and_untestable_is_none(row, answers):
    """Where nothing is hidden, nothing is to be said."""
    assert answers.says_something(row(verdict="unexplained"))
    assert not answers.says_something(row(verdict="untestable"))
    assert not answers.says_something(row(verdict="error"))


def test_every_effect_outside_the_list_says_what_describes_it(bench, answers):
    """A new one cannot be forgotten, nor can a name be misspelt."""
    from hidden.effects import LISTED as LISTED_NOW
    from hidden.effects import UNLISTED as UNLISTED_NOW

    assert set(answers.DESCRIBES) == set(UNLISTED_NOW)
    assert {name for fitting in answers.DESCRIBES.values() for name in fitting} <= set(LISTED_NOW)


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


def test_a_run_says_whether_it_is_complete(script, summary, row):
    """With all that was planned in the mode with replicates, and with --quick."""
    document = script("diagnosis.document")
    rows = [{**row(("alignment",), ("alignment",), nats=150.0), "quick": False}]
    found = summary.summarise(rows, planned={"listed": 1})
    assert document._completeness(found) == "A complete run with 39 replicates.\n"
    more = summary.summarise(rows, planned={"listed": 2})
    assert "partial" in document._completeness(more)
    short = summary.summarise([{**rows[0], "quick": True}], planned={"listed": 1})
    assert "Complete with `--quick`**, 1 trial" in document._completeness(short)
    assert "0 of them" in document._completeness(short)


def test_further_forms_are_planned_faint_and_clear_and_a_third_with_noise(planned):
    """As often as listed ones, from a first seed of their own."""
    jobs = planned.plan(planned.Scale(further=3), LISTED, UNLISTED, ["alignment/flow"], quick=True)
    further = [job for job in jobs if job.section == "further"]
    assert sorted(job.kind for job in further) == [
        *["alignment/flow clear"] * 3, *["alignment/flow faint"] * 3,
    ]  # fmt: skip
    noise = [job.scenario["chain"]["noise_mm"] for job in further]
    assert sorted(noise) == [0.0] * 4 + [0.5] * 2
    assert min(job.scenario["seed"] for job in further) == planned.FURTHER_SEED
    assert planned.WEIGHTS["further"] == planned.WEIGHTS["listed"]


def test_a_further_form_is_called_by_its_effect_or_a_second_choice(row, answers):
    """A tie of both is right; a tie with a third is a tie, as is the second choice alone."""

    def fares(names, **changed):
        also = ["turning-memory"]
        return answers.fares(row(("wall-persistence",), names, also=also, **changed))

    assert fares(("wall-persistence",)) == "right"
    assert fares(("wall-persistence",), ties=("turning-memory",)) == "right"
    assert fares(("wall-persistence",), ties=("alignment",)) == "tie"
    assert fares(("turning-memory",)) == "tie"
    assert fares(("alignment",), ties=("crowding",)) == "wrong"
    assert fares(("generic:speed:time",)) == "wrong"
    assert fares((), verdict="unexplained") == "wrong"
    assert fares(()) == "silent"


def test_the_table_of_further_forms_shows_a_hole(script, summary, row):
    """By effect, then by form; what is said of one form does not hide what is of the other."""

    def trial(form, names):
        made = row(("alignment",), names, section="further", nats=80.0)
        asked = {**made["scenario"], "effect": f"alignment/{form}", "strength": "clear"}
        return {**made, "scenario": asked}

    rows = [trial("flow", ("alignment",)), trial("nearest", ())]
    found = summary.further_table(rows)
    assert [(each["form"], each["right"]["hits"], each["right"]["n"]) for each in found] == [
        (None, 1, 2), ("flow", 1, 1), ("nearest", 0, 1),
    ]  # fmt: skip
    assert found[2]["silent"]["hits"] == 1
    text = "\n".join(script("diagnosis.document")._further({"further": found}))
    assert "| alignment | nearest | clear | 80 | 0 % (0/1, 0 to 79)" in text
