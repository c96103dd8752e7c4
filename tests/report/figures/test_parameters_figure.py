"""Parameters over the rounds, and which of them mean something."""

from dataclasses import replace

import pytest

from zfcal.parameters import from_genes, to_genes
from zfcal.report.figures import theme
from zfcal.report.figures.panels import compose
from zfcal.report.figures.parameters import parameters_picture, values_of


def test_gamma_is_shown_with_a_maximum_of_one(rounds_of, two_rooms):
    """Only ratios matter: 0.6, 0.9 and 0.9 become 2/3, 1 and 1."""
    values = values_of(rounds_of(two_rooms, 1)[-1])

    assert values["corridor.gamma.corridor"] == pytest.approx(2 / 3)
    assert values["corridor.gamma.walls"] == pytest.approx(1.0)
    assert values["corridor.kappa_0"] == pytest.approx(9.0)


def test_scaling_a_row_of_gamma_changes_nothing(rounds_of, two_rooms):
    """The model is the same, and so is its picture."""
    last = rounds_of(two_rooms, 1)[-1]
    genes = to_genes(last.parameters)
    genes[9:12] /= 2
    halved = replace(last, parameters=from_genes(genes, last.parameters))

    assert values_of(halved) == pytest.approx(values_of(last))


def test_the_starting_model_alone_is_no_calibration(rounds_of, two_rooms):
    """Before the first round there is nothing to show."""
    assert parameters_picture(rounds_of(two_rooms, 0)) is None
    assert parameters_picture([]) is None


@pytest.mark.parametrize("n_rounds", [1, 3])
def test_what_is_not_identified_is_hollow(rounds_of, two_rooms, n_rounds):
    """corridor.kappa_0 is open in every round, walls.kappa_0 neither, centre.kappa_0 too."""
    figure = compose(parameters_picture(rounds_of(two_rooms, n_rounds)))
    axes = figure.axes[0]
    faces = {
        line.get_marker(): line.get_markerfacecolor()
        for line in axes.get_lines()
        if line.get_marker() not in {"", "None"} and len(line.get_xdata())
    }

    # Every third name is unidentified: kappa_0 of each zone is the first of three.
    assert faces == {"o": theme.GROUND, "s": theme.GROUND, "D": theme.GROUND}
    others = [
        line.get_markerfacecolor()
        for line in figure.axes[1].get_lines()
        if line.get_marker() not in {"", "None"} and len(line.get_xdata())
    ]
    assert theme.GROUND not in others


def test_intervals_of_several_rounds_are_those_that_mean_something(rounds_of, two_rooms):
    """An interval over the whole axis would only hide the others."""
    figure = compose(parameters_picture(rounds_of(two_rooms, 3)))
    drawn = [sum(len(part.get_segments()) for part in axes.collections) for axes in figure.axes[:3]]

    assert drawn == [0, 9, 9]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two-rooms", "circular", "own"])
@pytest.mark.parametrize("n_rounds", [1, 4, 29])
def test_no_text_covers_another(arenas, rounds_of, covered_texts, name, n_rounds):
    """For any arena and number of rounds."""
    assert covered_texts(parameters_picture(rounds_of(arenas[name], n_rounds))) == []
