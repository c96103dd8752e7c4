"""The robot among the fish, and the fish among themselves."""

from dataclasses import replace

import numpy as np
import pytest

from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.validation import check
from zfcal.behaviour.located import locate
from zfcal.report.integration import NOT_COMPARED, integration_document, measure_integration
from zfcal.report.seen import see
from zfcal.report.views import FEATURE_NAMES, ROBOT


@pytest.fixture
def courses(course):
    """Robot against fish in three windows, a null at the end."""
    return {
        (ROBOT, feature, None): course([0.5, 0.6, np.nan], ceiling=0.9, n=4)
        for feature in FEATURE_NAMES
    }


def test_the_newest_scores_are_taken(courses):
    """The last window with a score is the one that ends at 180 s."""
    found = measure_integration(courses, None, has_robot=True, start_s=300)

    assert found.end_s == 180
    assert found.start_s == 300
    assert found.robot["S"].value == 0.6
    assert found.robot["S"].n == 4
    assert set(found.robot) == set(FEATURE_NAMES)


def test_a_trial_without_robot_says_so(courses):
    """Neither a score nor a suggestion to make one."""
    found = measure_integration({}, None, has_robot=False, start_s=0)

    assert found.robot == {}
    assert found.missing[0] == "There is no robot in this trial."


def test_scores_that_are_not_there_yet_are_named():
    """Before analyse nothing has been compared."""
    assert NOT_COMPARED in measure_integration({}, None, has_robot=True, start_s=0).missing


def test_a_young_trial_is_judged_with_a_reserve(courses):
    """Before 300 s fish are getting used to the robot: it is said that this time is in."""
    young, old = (
        measure_integration(courses, None, has_robot=True, start_s=start).missing
        for start in (60, 300)
    )

    assert any("too young" in line for line in young)
    assert not any("too young" in line for line in old)


def test_a_ceiling_that_is_missing_is_named(course):
    """With two fish none can stand in the robot's place."""
    courses = {(ROBOT, feature, None): course([0.5]) for feature in FEATURE_NAMES}
    missing = measure_integration(courses, None, has_robot=True, start_s=300).missing

    assert any("three fish" in line for line in missing)


def test_halves_of_the_same_behaviour_are_alike(two_rooms, wander):
    """Ten minutes that repeat each other minute by minute: every similarity is near one."""
    minute = wander(two_rooms, n_samples=300, robot=False)
    again = np.concatenate([minute.xy_m] * 10)
    samples = replace(
        minute, k=np.arange(3000), xy_m=again, confidence=np.ones(again.shape[:2], np.float32)
    )
    found = measure_integration({}, see([locate(samples, two_rooms)]), has_robot=False, start_s=0)

    assert found.halves == pytest.approx(dict.fromkeys("DWOTS", 1.0), abs=1e-9)


def test_the_robot_is_in_neither_half(two_rooms, wander):
    """Fish that repeat themselves are alike, whatever the robot does."""
    minute = wander(two_rooms, n_samples=300)
    xy_m = np.concatenate([minute.xy_m] * 10)
    xy_m[300:, -1] = (0.2, 0.8)
    samples = replace(
        minute, k=np.arange(3000), xy_m=xy_m, confidence=np.ones(xy_m.shape[:2], np.float32)
    )

    found = measure_integration({}, see([locate(samples, two_rooms)]), has_robot=True, start_s=0)

    assert found.halves["S"] == pytest.approx(1.0, abs=1e-9)


def test_a_short_recording_has_no_halves(two_rooms, wander):
    """Two minutes: what is needed and what there is are both named."""
    seen = see([locate(wander(two_rooms), two_rooms)])

    found = measure_integration({}, seen, has_robot=True, start_s=0)

    assert found.halves == {}
    assert any("120 s" in line and "600 s" in line for line in found.missing)


def test_the_document_fits_its_schema_and_nan_is_null(make_view, course):
    """JSON has no NaN: a missing ceiling is null."""
    courses = {(ROBOT, "S", None): course([0.5])}
    found = measure_integration(courses, None, has_robot=True, start_s=300)
    lineage = Lineage(schema="zfcal.integration/1", command="report")

    document = integration_document(
        [make_view(), make_view("bare", integration=found)], lineage, {"index.html": "0" * 64}
    )

    check(document, "integration", "here")
    assert document["trials"][1]["robot_vs_fish"]["features"]["S"]["ceiling"] is None
    assert document["trials"][0]["robot_vs_fish"]["features"]["S"]["against_ceiling"] == (
        pytest.approx(0.6 / 0.9)
    )
    assert document["trials"][1]["halves"] is None
