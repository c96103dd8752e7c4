"""Which pictures a report has, and who is on them."""

from zfcal.report.pictures import pictures_of_trial, pictures_of_trials


def names(pictures):
    """Return the names of pictures in their order."""
    return [picture.name for picture in pictures]


def test_a_whole_trial_is_told_from_the_scores_to_the_arena(make_view):
    """What matters most comes first."""
    assert names(pictures_of_trial(make_view())) == [
        "scores",
        "integration",
        "social",
        "following",
        "statistics",
        "presence",
        "parameters",
        "search",
        "tracks",
        "arena",
    ]


def test_several_trials_share_scores_and_arena(make_view):
    """What is of one trial alone stands in its own report."""
    views = [make_view("a"), make_view("b")]

    assert names(pictures_of_trials(views)) == ["scores", "integration", "social", "arena"]


def test_a_model_stands_beside_its_own_window_only(make_view):
    """Another window's fish are no match for it: they are shown alone with the robot."""
    view = make_view()
    same, other = (
        next(p for p in pictures_of_trial(make_view(rounds=rounds)) if p.name == "statistics")
        for rounds in (view.rounds, view.rounds[:-1])
    )

    assert same.title == "Fish and model and robot, 420 to 540 s"
    assert other.title == "Fish and robot, 420 to 540 s"


def test_control_trials_are_called_so(make_view):
    """Where other trials are the control group, they are the fish of the picture."""
    picture = next(
        p for p in pictures_of_trial(make_view(has_control_trials=True)) if p.name == "statistics"
    )

    assert picture.title.startswith("Fish of the control trials and model")
