"""Plain words: every S with its ceiling, the worst first, and what to type."""

from dataclasses import replace

import numpy as np
import pytest

from zfcal.report.integration import NOT_COMPARED
from zfcal.report.summary import gaps, statements, worst_features
from zfcal.report.trials_summary import gaps_of_trials, statements_of_trials
from zfcal.report.views import FEATURE_NAMES, MODEL, Integration, Mark, Published


def answer_to(view, start):
    """Return the answer to the question that starts so."""
    (found,) = (s for s in statements(view) if s.question.startswith(start))
    return found


def test_s_never_stands_alone(make_view):
    """Mean 0.79, ceiling 0.85: both are in the sentence, and their ratio stands out."""
    said = answer_to(make_view(), "Does the model")

    assert "S = 0.79" in said.answer
    assert "0.85" in said.answer
    assert said.figure == ("93 %", "of what a perfect model would score")


def test_windows_within_the_ceiling_are_counted(make_view, course):
    """Of 0.5, 0.74, 0.75, 0.9 two are no lower than 0.75, the ceiling's low end."""
    courses = {(MODEL, "S", None): course([0.5, 0.74, 0.75, 0.9], ceiling=0.85)}

    assert "In 2 of 4 windows" in answer_to(make_view(courses=courses), "Does the model").answer


def test_a_feature_that_s_hides_is_named(make_view, course):
    """S within its ceiling in all windows, W below its own in two of three."""
    courses = {
        (MODEL, "S", None): course([0.84] * 3, ceiling=0.85),
        (MODEL, "W", None): course([0.6, 0.7, 0.9], ceiling=0.85),
        (MODEL, "O", None): course([0.6, 0.9, 0.9], ceiling=0.85),
    }

    said = answer_to(make_view(courses=courses), "Does the model").answer

    assert "the distances to the wall lie below their own such range in 2 of 3 windows" in said
    assert "in each zone" not in said


def test_a_score_of_other_statistics_is_not_called_s(make_view):
    """It stands with what it is of, beside its ceiling; without one nothing is said."""
    view = make_view()
    assert not [s for s in statements(view) if "calibrated on" in s.question]
    score = Mark(value=0.6, low=0.7, high=0.9, ceiling=0.8)
    last = replace(view.rounds[-1], score=score, score_of=("D", "curvature"))

    said = answer_to(replace(view, rounds=[*view.rounds[:-1], last]), "What was the model")

    assert said.answer.startswith("On the score of D, curvature, which is not S")
    assert "it is 0.60; a perfect model would score 0.80" in said.answer
    assert said.figure == ("75 %", "of what a perfect model would score")


def test_a_single_window_is_spoken_of_as_one(make_view, course):
    """No mean over one window, and its interval is named."""
    courses = {(MODEL, "S", None): course([0.8], ceiling=0.85)}
    said = answer_to(make_view(courses=courses), "Does the model").answer

    assert said.startswith("In the only window")
    assert "0.75 and 0.95" in said
    assert "windows S" not in said


def test_the_worst_is_what_lies_farthest_below_its_ceiling(make_view, course):
    """0.1 below with an interval of 0.05 is worse than 0.2 below with one of 0.4."""
    view = make_view()
    courses = {
        (MODEL, "D", "corridor"): course([0.6], ceiling=0.8, half_width=0.4),
        (MODEL, "W", "centre"): course([0.7], ceiling=0.8, half_width=0.05),
        (MODEL, "T", "walls"): course([0.2]),
    }

    ranked = worst_features(replace(view, courses=courses))

    assert [(feature, zone) for feature, zone, _ in ranked] == [("W", "centre"), ("D", "corridor")]


def test_a_zone_in_which_a_perfect_model_may_score_nothing_is_not_accused(make_view, course):
    """0.00 where the ceiling is 0.01 (0.00 to 0.02): hardly anybody was there."""
    empty = {(MODEL, "D", "corridor"): course([0.0], ceiling=0.01, half_width=0.01)}
    seen = {(MODEL, "D", "centre"): course([0.69], ceiling=0.8, half_width=0.2)}
    view = make_view()

    ranked = worst_features(replace(view, courses=empty | seen))

    assert [(feature, zone) for feature, zone, _ in ranked] == [("D", "centre")]
    assert not worst_features(replace(view, courses=empty))
    assert "centre" in answer_to(replace(view, courses=empty | seen), "What differs").answer


@pytest.mark.parametrize("feature", ["D", "W", "T"])
def test_the_worst_says_which_way_it_differs(make_view, course, feature):
    """With the last window's statistics at hand, fish and model are both named."""
    courses = {
        (MODEL, feature, "walls"): course([0.3], ceiling=0.8),
        (MODEL, "S", None): course([0.5], ceiling=0.8),
    }
    view = make_view(courses=courses, n_windows=8)

    said = answer_to(view, "What differs").answer

    assert "in the zone walls" in said
    assert "In the last window" in said
    assert "model's" in said


def test_too_few_observations_are_no_direction(make_view, course):
    """A zone where no pair of fish was seen says so instead of a number."""
    view = make_view(courses={(MODEL, "D", "corridor"): course([0.3], ceiling=0.8)})
    nobody = replace(view.model_statistics, distance=np.zeros((3, 10), dtype=np.int64))

    said = answer_to(replace(view, model_statistics=nobody), "What differs").answer

    assert said.endswith("too few observations to say which way.")


def test_a_good_model_has_nothing_that_differs(make_view, course):
    """At the ceiling nothing is accused."""
    courses = {(MODEL, "O", None): course([0.84], ceiling=0.85)}

    assert answer_to(make_view(courses=courses), "What differs").answer.startswith("Nothing stands")


def test_the_robot_is_judged_by_a_fish_in_its_place(make_view):
    """0.60 where a fish scores 0.90 (0.80 to 0.95): it stands out; at 0.85 it does not."""
    view = make_view()
    good = {feature: Mark(value=0.85, low=0.8, high=0.95, ceiling=0.9, n=4) for feature in "DWOTS"}
    blended = replace(view, integration=replace(view.integration, robot=good))

    assert "stands out" in answer_to(view, "Does the robot").answer
    assert "0.90 on average (0.80 to 0.95, 4 fish)" in answer_to(view, "Does the robot").answer
    assert "within what fish differ" in answer_to(blended, "Does the robot").answer
    assert answer_to(view, "Does the robot").figure[0] == "67 %"


def test_a_robot_without_ceiling_is_not_judged(make_view):
    """No ceiling, no verdict: the reason stands instead."""
    bare = Integration(
        start_s=300,
        end_s=540,
        robot={feature: Mark(value=0.6) for feature in FEATURE_NAMES},
        missing=("There is no ceiling.",),
    )
    said = answer_to(make_view(integration=bare), "Does the robot")

    assert said.answer.endswith("There is no ceiling.")
    assert "no ceiling" in said.figure[1]


def test_parameters_that_mean_nothing_are_counted(make_view):
    """6 of 18 are open: 12 are pinned down."""
    assert answer_to(make_view(), "Which parameters").figure[0] == "12 of 18"


def test_all_parameters_known_is_said_without_reserve(make_view):
    """No warning where nothing is open."""
    view = make_view()
    known = replace(view.rounds[-1], unidentified=frozenset())

    said = answer_to(replace(view, rounds=[known]), "Which parameters").answer

    assert said == "The last window pins down 18 of 18 parameters."


def test_an_empty_trial_says_where_to_begin(make_view):
    """No tracks: import them, and nothing else is asked for."""
    empty = make_view(
        seen=None,
        statistics={},
        courses={},
        rounds=[],
        integration=Integration(start_s=0, end_s=0),
        following=None,
    )
    found = gaps(empty)

    assert [gap.command for gap in found] == ["zfcal import TRACKS.csv trial --format csv"]
    assert statements(empty) == []


@pytest.mark.parametrize(
    ("changes", "command"),
    [
        ({"statistics": {}, "courses": {}, "rounds": []}, "zfcal analyse trial"),
        ({"rounds": [], "model_statistics": None}, "zfcal calibrate trial"),
        ({"courses": {}}, "zfcal calibrate trial --force"),
        (
            {"integration": Integration(start_s=0, end_s=0, missing=(NOT_COMPARED,))},
            "zfcal analyse trial --force",
        ),
        (
            {
                "integration": Integration(start_s=0, end_s=0, missing=(NOT_COMPARED,)),
                "scoring": "legacy",
            },
            "zfcal analyse trial --scoring paper",
        ),
    ],
    ids=["no statistics", "no model", "no scores", "robot not compared", "legacy scoring"],
)
def test_what_is_missing_comes_with_its_command(make_view, changes, command):
    """Each gap says what to type next."""
    assert command in [gap.command for gap in gaps(make_view(**changes))]


def test_a_whole_trial_lacks_nothing(make_view):
    """No gap where every part is there."""
    assert gaps(make_view()) == []


def test_one_window_is_called_one(make_view):
    """A course of one point is no course."""
    assert any("single window" in gap.what for gap in gaps(make_view(n_windows=1)))


def test_several_trials_by_hand(make_view):
    """Windows from 360 s on: the last four of 0.74 to 0.84 in steps of 1/70, mean 0.819."""
    views = [make_view("a"), make_view("b")]

    said = statements_of_trials(views)[0].answer

    assert "In 2 of 2 trials, from 6 min on" in said
    assert "S = 0.82 ± 0.00" in said
    assert "published" not in said
    beside = [replace(view, published=True) for view in views]
    assert "0.850" in statements_of_trials(beside)[0].answer


def test_robots_of_several_trials_are_counted(make_view):
    """Of two robots one is within its fish."""
    view = make_view("a")
    good = {feature: Mark(value=0.85, low=0.8, high=0.95, ceiling=0.9, n=4) for feature in "DWOTS"}
    other = make_view("b", integration=replace(view.integration, robot=good))

    assert "In 1 of them" in statements_of_trials([view, other])[1].answer


def test_gaps_of_several_trials_name_the_trial(make_view):
    """One complete trial says nothing, the other is named."""
    found = gaps_of_trials([make_view("a"), make_view("b", rounds=[], model_statistics=None)])

    assert [gap.what.split(":")[0] for gap in found] == ["b"]


def test_trials_that_are_too_short_have_no_common_score(make_view):
    """No window from 360 s on: nothing is claimed."""
    views = [make_view(name, n_windows=2) for name in "ab"]

    assert [s.question for s in statements_of_trials(views)] == ["Do the robots move like fish?"]


def test_more_than_a_perfect_model_is_overfitting(make_view, course):
    """Three windows of 0.97 where the ceiling's range ends at 0.9; none of them is praised."""
    courses = {(MODEL, "S", None): course([0.97] * 3, ceiling=0.8)}
    said = answer_to(make_view(courses=courses), "Does the model")

    assert "In 3 of 3 windows S lies above it" in said.answer
    assert "overfitting" in said.answer
    assert "In 0 of 3 windows S lies where" in said.answer
    assert said.figure == (
        "0.97",
        "above the range of a perfect model: it fits chance (overfitting)",
    )
    assert "%" not in said.answer.split(" In the last window")[0]


def test_no_score_is_said_to_reach_more_than_its_ceiling(make_view, course):
    """0.9 where the ceiling is 0.8 (0.65 to 0.95): as good as can be, and no 113 %."""
    courses = {(MODEL, "S", None): course([0.9] * 3, ceiling=0.8, half_width=0.15)}
    view = make_view(courses=courses)
    said = answer_to(view, "Does the model")

    assert said.figure == ("100 %", "of what a perfect model would score")
    assert "S cannot distinguish the two" in said.answer
    assert "112 %" not in said.answer
    assert "113 %" not in said.answer


def test_several_trials_above_their_ceilings_are_no_praise(make_view, course):
    """The score stands out, not a percentage."""
    courses = {(MODEL, "S", None): course([0.97] * 8, ceiling=0.8)}
    views = [make_view(name, courses=courses) for name in "ab"]

    assert statements_of_trials(views)[0].figure[0] == "0.97"
    assert "fits chance" in statements_of_trials(views)[0].figure[1]


def test_few_pairs_and_pairs_beyond_the_bins_are_said(make_view):
    """12 pairs in the corridor, and 740 of 1000 in the last bin of the walls."""
    view = make_view()
    fish = view.statistics[540, "control"]
    distance = np.zeros_like(fish.of("D"))
    distance[0, 0] = 12
    distance[1, 2], distance[1, -1] = 260, 740
    distance[2, 3] = 500
    fish = replace(fish, distance=distance)
    said = answer_to(replace(view, statistics={(540, "control"): fish}), "How much do distances")

    assert said.figure == ("74 %", "of the pairs in walls are in one bin of D")
    assert "few pairs in corridor (12)" in said.answer
    assert "Farther apart than 0.198 m" in said.answer
    assert "zfcal analyse trial --features separation" in said.answer
    assert "is not S" in said.answer


def test_enough_pairs_within_the_bins_need_no_word(make_view):
    """Nothing is said of D where it is of many pairs that it can tell apart."""
    view = make_view()
    fish = view.statistics[540, "control"]
    fish = replace(fish, distance=np.full_like(fish.of("D"), 50))
    found = statements(replace(view, statistics={(540, "control"): fish}))

    assert not [s for s in found if "distances" in s.question]


def test_a_model_of_another_window_does_not_overfit(make_view, course):
    """Of three windows above the range one has a model of its own; two have that of the first."""
    courses = {(MODEL, "S", None): course([0.97] * 3, ceiling=0.8)}
    view = make_view(n_windows=3, courses=courses)
    kept = [
        replace(each, published=Published(rule="nearest", of_s=120))
        for each in view.rounds
        if each.second
    ]
    said = answer_to(replace(view, rounds=kept), "Does the model")

    assert "In 1 of 3 windows S lies above it" in said.answer
    assert (
        "In 2 of 3 windows S of a model that was made of another window lies above" in said.answer
    )
    assert said.figure == ("0.97", "above the range of a perfect model, by chance")


def test_a_published_value_outside_the_interval_of_the_likelihood_is_named(make_view):
    """All intervals are moved below zero but one."""
    last = make_view().rounds[-1]
    moved = dict.fromkeys(last.intervals, (-2.0, -1.0)) | {"walls.kappa_0": (0.0, 30.0)}
    by_likelihood = replace(last, intervals=moved, intervals_by="likelihood")
    said = answer_to(replace(make_view(), rounds=[by_likelihood]), "Which parameters").answer

    assert "by its likelihood" in said
    assert "The published values of 17 lie outside their intervals." in said
