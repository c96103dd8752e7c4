"""From findings to a model that has the effect, with before and after."""

import dataclasses
import math
import tomllib

import numpy as np
import pytest

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.lock import lock
from zfcal.artifacts.models import read_model, write_model
from zfcal.artifacts.validation import check, read_json
from zfcal.diagnose.findings import Screened, Verdict
from zfcal.errors import InputError, LockedError
from zfcal.stages.calibrate.searching import CalibrateOptions
from zfcal.stages.diagnose.diagnose import DiagnoseOptions, KnownNoise, diagnose
from zfcal.stages.events import Made, Note, Planned, Progress, Result, UpToDate, say_nothing
from zfcal.stages.extend.extend import ExtendOptions, extend
from zfcal.stages.trial_context import Task

MEASURES = ["nats_per_step", "S_over_ceiling", "D", "W", "O", "T", "effect"]


class Killed(BaseException):
    """What a test throws into a stage, as a power cut would."""


@pytest.fixture
def found(monkeypatch, make_diagnosis):
    """Answer every question with this diagnosis: change it to change the answer."""
    answer = {"names": ("alignment",)}
    asked = []

    def engine(question, heard):
        asked.append(question)
        diagnosis = make_diagnosis(question.arena, question.model, **answer)
        strength = {"weight": 5.0, "kappa": 8.0}
        effects = tuple(dataclasses.replace(e, strength=strength) for e in diagnosis.effects)
        return dataclasses.replace(diagnosis, effects=effects)

    monkeypatch.setattr("zfcal.stages.diagnose.diagnose._engine", engine)
    monkeypatch.setattr(
        "zfcal.stages.diagnose.diagnose._estimate",
        lambda _case, _stretch, stated_m, source: KnownNoise(sd_m=stated_m, source=source),
    )
    answer["asked"] = asked
    return _Answer(answer)


class _Answer:
    """The answer that is given, and the questions that were asked."""

    def __init__(self, known):
        self.asked = known.pop("asked")
        self._known = known

    def change(self, **parts):
        """Answer otherwise from now on."""
        self._known.update(parts)


@pytest.fixture
def trial(make_trial):
    """Return a trial of 5 minutes."""
    return make_trial(seconds=300)


@pytest.fixture
def options(quick):
    """Return options under which an extension takes seconds."""
    return ExtendOptions(calibration=quick)


def of_type(events, kind):
    """Return the events of a kind."""
    return [event for event in events if type(event) is kind]


def test_the_model_gets_the_effect_and_the_findings_the_gap(trial, found, options, heard):
    """All measures, the placebo by name, and a table with the scores of the three models."""
    path = extend(trial, options, heard.append)
    assert path == trial / "models" / "extended.toml"
    model = read_model(path)
    assert set(model.effects) == {"alignment"}
    result = tomllib.loads(path.read_text())["result"]
    assert set(result["held_out"]) == {"without", "with", "placebo"}
    assert result["placebo"] not in {"alignment", ""}
    assert list(result["gap"]) == MEASURES
    findings = trial / "diagnosis" / "findings.json"
    document = read_json(findings)
    check(document, "findings", findings)
    assert [entry["measure"] for entry in document["gap"]] == MEASURES
    assert list(document["extended"]) == ["models/extended.toml"]
    (note,) = (each for each in document["notes"] if each["name"] == "extended")
    assert "has alignment." in note["says"]
    assert f"comparison: {result['placebo']}." in note["says"]
    assert [event.value for event in of_type(heard, Result)] == [document]


@pytest.mark.slow
def test_the_findings_stay_up_to_date_with_their_gap(trial, found, options, heard):
    """Diagnose has nothing to do afterwards, and a second extend neither."""
    extend(trial, options, say_nothing)
    diagnose(trial, DiagnoseOptions(), heard.append)
    assert not of_type(heard, Made)
    heard.clear()
    extend(trial, options, heard.append)
    assert not of_type(heard, Made)
    assert [event.path.name for event in of_type(heard, UpToDate)] == [
        "findings.json",
        "extended.toml",
    ]
    assert len(found.asked) == 1


@pytest.mark.slow
def test_a_gap_that_is_gone_is_put_back_without_calibrating(trial, found, options, heard):
    """Diagnose --force drops it; the model file still has it."""
    extend(trial, options, say_nothing)
    before = read_json(trial / "diagnosis" / "findings.json")
    diagnose(trial, DiagnoseOptions(), say_nothing, task=Task(force=True))
    assert "gap" not in read_json(trial / "diagnosis" / "findings.json")
    extend(trial, options, heard.append)
    assert [event.path.name for event in of_type(heard, Made)] == ["findings.json"]
    assert read_json(trial / "diagnosis" / "findings.json") == before


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_whatever_the_workers(
    make_trial, copy_trial, found, quick, read_all
):
    """Findings and model; another seed gives others."""
    root = make_trial(seconds=240)
    other = copy_trial(root, "other")
    for place, n_workers in ((root, 1), (other, 2)):
        calibration = dataclasses.replace(quick, n_workers=n_workers)
        extend(place, ExtendOptions(calibration=calibration), say_nothing)
    assert read_all(root) == read_all(other)
    again = dataclasses.replace(quick, seed=77)
    extend(other, ExtendOptions(calibration=again), say_nothing)
    assert read_all(root)["models/extended.toml"] != read_all(other)["models/extended.toml"]


@pytest.mark.slow
def test_a_killed_extension_goes_on_and_ends_in_the_same_bytes(
    trial, copy_trial, found, options, read_all
):
    """Killed while the second model is calibrated."""
    other = copy_trial(trial, "other")
    extend(trial, options, say_nothing)

    def kill(event):
        if isinstance(event, Progress) and event.stage == "models" and event.done == 1:
            raise Killed

    with pytest.raises(Killed):
        extend(other, options, kill)
    assert not (other / "models" / "extended.toml").exists()
    extend(other, options, say_nothing)
    assert read_all(other) == read_all(trial)
    assert not list((other / "models").glob(".extended*"))


def test_a_dry_run_says_what_it_would_make(trial, found, options, heard, read_all):
    """First the findings; when these are there, the model."""
    extend(trial, options, heard.append, task=Task(dry_run=True))
    assert [event.path.name for event in of_type(heard, Planned)] == ["findings.json"]
    diagnose(trial, DiagnoseOptions(), say_nothing)
    before = read_all(trial)
    heard.clear()
    extend(trial, options, heard.append, task=Task(dry_run=True))
    assert [event.path.name for event in of_type(heard, Planned)] == ["extended.toml"]
    assert read_all(trial) == before


@pytest.mark.slow
def test_stale_findings_are_asked_for_again_as_they_were(trial, found, options):
    """Quick ones stay quick."""
    diagnose(trial, DiagnoseOptions(quick=True, noise_m=0.0005), say_nothing)
    (trial / "tracks" / "000240.parquet").unlink()
    extend(trial, options, say_nothing)
    assert [question.quick for question in found.asked] == [True, True]
    assert [question.noise_m for question in found.asked] == [0.0005, 0.0005]


def test_a_named_effect_is_added_whatever_was_found(trial, found, quick, heard):
    """Its fit starts from the defaults."""
    options = ExtendOptions(names=("turning-bias",), calibration=quick)
    path = extend(trial, options, heard.append)
    assert set(read_model(path).effects) == {"turning-bias"}
    notes = read_json(trial / "diagnosis" / "findings.json")["notes"]
    assert "has turning-bias." in notes[-1]["says"]
    assert read_lineage(path).options["effects"] == {"turning-bias": {}}


def test_no_effect_is_nothing_to_do(trial, found, options, heard):
    """One line, no model."""
    found.change(names=())
    assert extend(trial, options, heard.append) is None
    assert "nothing to add" in of_type(heard, Note)[0].text
    assert not (trial / "models" / "extended.toml").exists()


def test_what_is_unexplained_cannot_be_added(trial, found, options, heard):
    """One line that says why."""
    found.change(names=(), verdict=Verdict.UNEXPLAINED)
    assert extend(trial, options, heard.append) is None
    assert "nothing that is known explains it" in of_type(heard, Note)[0].text


def test_too_little_data_is_an_error_with_the_minutes_needed(trial, found, options):
    """The least of all candidates'."""
    short = [
        Screened(name="a", z=math.nan, p=math.nan, minutes_needed=m) for m in (45.0, 12.0, None)
    ]
    found.change(names=(), verdict=Verdict.UNTESTABLE, screened=tuple(short))
    with pytest.raises(InputError, match="too short to say") as error:
        extend(trial, options, say_nothing)
    assert "12 min would do" in error.value.hint


@pytest.mark.slow
def test_an_effect_that_the_model_has_already_is_refused(trial, found, options, quick):
    """Also one that is unknown."""
    path = extend(trial, options, say_nothing)
    diagnose(trial, DiagnoseOptions(model=path), say_nothing)
    findings = trial / "diagnosis" / "extended" / "findings.json"
    with pytest.raises(InputError, match="has the effect 'alignment' already"):
        extend(trial, dataclasses.replace(options, findings=findings), say_nothing)
    with pytest.raises(InputError, match="no effect 'allignment'"):
        extend(trial, ExtendOptions(names=("allignment",), calibration=quick), say_nothing)


@pytest.mark.parametrize("name", ["allignment", "generic:heading:nothing"])
def test_an_unknown_name_is_told_before_anything_is_diagnosed(trial, found, quick, name):
    """A slip of the hand does not cost the minutes that a diagnosis takes."""
    with pytest.raises(InputError, match=f"no effect '{name}'"):
        extend(trial, ExtendOptions(names=(name,), calibration=quick), say_nothing)
    assert not found.asked
    assert not (trial / "diagnosis").exists()


@pytest.mark.slow
def test_an_effect_in_the_model_is_told_before_anything_is_diagnosed(trial, found, options, quick):
    """Though its findings are stale, and would be made anew first."""
    path = extend(trial, options, say_nothing)
    findings = diagnose(trial, DiagnoseOptions(model=path), say_nothing)
    path.write_text(path.read_text() + "\n")
    asked = len(found.asked)
    again = ExtendOptions(names=("alignment",), findings=findings, calibration=quick)
    with pytest.raises(InputError, match="has the effect 'alignment' already"):
        extend(trial, again, say_nothing)
    assert len(found.asked) == asked


def test_findings_may_be_named_by_their_folder(trial, found, options, heard, tmp_path):
    """None are made in the folder above it: what is missing is the model alone."""
    folder = tmp_path / "elsewhere"
    diagnose(trial, DiagnoseOptions(out_dir=folder), say_nothing)
    dry = Task(dry_run=True)
    extend(trial, dataclasses.replace(options, findings=folder), heard.append, task=dry)
    assert [each.path.name for each in of_type(heard, Planned)] == ["extended.toml"]


def test_findings_under_another_name_are_refused(trial, found, options):
    """They would not be read: others would be made beside them."""
    kept = diagnose(trial, DiagnoseOptions(), say_nothing).rename(trial / "kept.json")
    with pytest.raises(InputError, match="from a file named findings"):
        extend(trial, dataclasses.replace(options, findings=kept), say_nothing)
    assert not (trial / "findings.json").exists()


def test_findings_of_another_trial_are_not_written_over(make_trial, trial, found, options):
    """They would be stale here, and be made anew in their place."""
    other = make_trial(seconds=300, name="other", seed=9)
    findings = diagnose(other, DiagnoseOptions(), say_nothing)
    before = findings.read_bytes()
    with pytest.raises(InputError, match="belongs to another trial"):
        extend(trial, dataclasses.replace(options, findings=findings), say_nothing)
    assert findings.read_bytes() == before


@pytest.mark.slow
def test_an_extended_model_is_extended_beside_itself(trial, found, options, quick):
    """Never over the file that it starts from; the first effect stays as it was fitted."""
    first = extend(trial, options, say_nothing)
    diagnose(trial, DiagnoseOptions(model=first), say_nothing)
    again = ExtendOptions(
        names=("turning-bias",),
        findings=trial / "diagnosis" / "extended" / "findings.json",
        calibration=quick,
    )
    second = extend(trial, again, say_nothing)
    assert second == trial / "models" / "extended-2.toml"
    effects = read_model(second).effects
    assert list(effects) == ["alignment", "turning-bias"]
    assert effects["alignment"] == read_model(first).effects["alignment"]


def test_a_model_with_an_effect_on_speed_keeps_its_own_speeds(trial, found, quick):
    """Calibration must not overwrite them with measured ones, which hold the effect."""
    options = ExtendOptions(names=("fatigue",), calibration=quick)
    path = extend(trial, options, say_nothing)
    own = read_model(path)
    lineage = read_lineage(path)
    start = trial / "models" / "000000.toml"
    write_model(start, own, dataclasses.replace(lineage, command="init"))
    from zfcal.calibrate.group import with_measured_speeds
    from zfcal.stages.calibrate.holdout import pooled_fish
    from zfcal.stages.segments import Segments

    segments = Segments()
    control, _ = pooled_fish(segments.open(trial), segments, (0, 300))
    assert with_measured_speeds(own, control) == own
    plain = dataclasses.replace(own, effects={})
    assert with_measured_speeds(plain, control) != plain


def test_one_at_a_time(trial, found, options):
    """The second of the same command exits with 75."""
    with lock(trial, "extend"), pytest.raises(LockedError):
        extend(trial, options, say_nothing)


def test_a_trial_of_two_minutes_cannot_be_halved(make_trial, found, options):
    """One clear error."""
    with pytest.raises(InputError, match="expected at least 2 of each"):
        extend(make_trial(seconds=120), options, say_nothing)


def test_a_single_fish_can_be_extended(make_trial, found, quick):
    """Distances between fish are null then, and stand so."""
    root = make_trial(seconds=240, n_fish=1)
    options = ExtendOptions(names=("turning-bias",), calibration=quick)
    extend(root, options, say_nothing)
    gap = {each["measure"]: each for each in read_json(root / "diagnosis/findings.json")["gap"]}
    assert gap["D"]["before"] is None
    assert np.isfinite(gap["W"]["before"])


@pytest.mark.slow
def test_a_budget_ends_each_calibration(trial, found, quick, heard):
    """What was run stands in the file, the budget does not."""
    settings = dataclasses.replace(quick.settings, generations=None)
    calibration = CalibrateOptions(settings=settings, budget_s=0.5)
    path = extend(trial, ExtendOptions(calibration=calibration), heard.append)
    assert "budget_s" not in read_lineage(path).options
    heard.clear()
    extend(trial, ExtendOptions(calibration=calibration), heard.append)
    assert not of_type(heard, Made)
