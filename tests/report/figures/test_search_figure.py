"""What the search of each round has reached."""

from dataclasses import replace

import numpy as np
import pytest

from zfcal.report.figures.panels import compose
from zfcal.report.figures.search import search_picture


def test_each_round_has_its_first_and_last_generation(two_rooms, rounds_of):
    """Begun at 0.2, ended at 0.40, 0.41 and 0.42; the starting model has none."""
    picture = search_picture(rounds_of(two_rooms, 3))
    last, first = compose(picture).axes[0].get_lines()

    assert last.get_xdata() == pytest.approx([2, 3, 4])
    assert last.get_ydata() == pytest.approx([0.40, 0.41, 0.42])
    assert np.asarray(first.get_ydata()) == pytest.approx(0.2)
    assert "from 0.20 to 0.42 in the last one" in picture.panels[0].alt


def test_rounds_that_do_not_say_are_left_out(two_rooms, rounds_of):
    """Older files hold none: then there is no picture."""
    silent = [replace(each, hypervolume=()) for each in rounds_of(two_rooms, 3)]

    assert search_picture(silent) is None
    assert search_picture([]) is None


@pytest.mark.parametrize("n_rounds", [1, 29])
def test_no_text_covers_another(two_rooms, rounds_of, covered_texts, n_rounds):
    """Of one round as of many, on the screen and on paper."""
    picture = search_picture(rounds_of(two_rooms, n_rounds))

    assert covered_texts(picture) == covered_texts(picture, 85.0) == []
