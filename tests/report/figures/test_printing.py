"""Pictures as files, for the screen and at the width of a journal's column."""

import base64
import re
from io import BytesIO
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from fontTools.ttLib import TTFont
from matplotlib.image import imread
from matplotlib.text import Text

from zfcal.report.figures import theme
from zfcal.report.figures.arena import arena_picture
from zfcal.report.figures.panels import compose
from zfcal.report.figures.printing import printed
from zfcal.report.figures.scores import scores_picture
from zfcal.report.figures.statistics import statistics_picture
from zfcal.report.options import FORMATS, WIDTHS_MM
from zfcal.report.views import MODEL


@pytest.fixture
def scores(make_view):
    """The scores of a trial."""
    return scores_picture([make_view()], MODEL, name="scores", title="Model", short="Model")


@pytest.fixture
def statistics(make_view):
    """The statistics of a window of fish, model and robot."""
    view = make_view()
    cases = {"fish": view.statistics[540, "control"], "model": view.model_statistics}
    return statistics_picture(cases, view.arena, title="Fish and model")


@pytest.mark.parametrize("width_mm", WIDTHS_MM.values())
def test_a_png_on_paper_has_300_dots_an_inch(scores, width_mm):
    """85 mm are 1004 dots, 174 mm are 2055."""
    made = printed(scores, "png", width_mm=width_mm)

    assert imread(BytesIO(made)).shape[1] == pytest.approx(300 * width_mm / 25.4, abs=1)


@pytest.mark.parametrize("width_mm", [60.0, *WIDTHS_MM.values(), 400.0])
def test_letters_on_paper_have_seven_to_eight_points(scores, statistics, width_mm):
    """At every width: it is the panels that shrink."""
    for picture in (scores, statistics):
        with theme.style(on_paper=True):
            figure = compose(picture, width_in=width_mm / 25.4)
        sizes = [t.get_fontsize() for t in figure.findobj(Text) if t.get_text().strip()]
        assert 7 <= min(sizes) <= max(sizes) <= 8


@pytest.mark.parametrize(("width_mm", "columns"), [(60.0, 1), (85.0, 2), (174.0, 3)])
def test_panels_have_room_and_a_letter(scores, width_mm, columns):
    """As many beside each other as the width has room for; no common title."""
    with theme.style(on_paper=True):
        figure = compose(scores, width_in=width_mm / 25.4)

    assert figure.axes[0].get_gridspec().ncols == columns
    letters = [axes.get_title(loc="left").split()[0] for axes in figure.axes]
    assert letters == ["a", "b", "c", "d", "e"]
    assert figure.get_suptitle() == ""


@pytest.mark.parametrize("width_mm", WIDTHS_MM.values())
def test_no_text_covers_another_on_paper(scores, covered_texts, width_mm):
    """Titles are broken, and keys stand below each other."""
    assert covered_texts(scores, width_mm) == []


def test_ticks_of_a_narrow_histogram_do_not_meet(statistics, covered_texts):
    """What lies beyond has a long name; numbers near it are left out."""
    found = covered_texts(statistics, 85.0)

    assert [pair for pair in found if any("≥" in text for text in pair)] == []


def test_svg_has_text_as_text_and_its_letters_in_it(scores):
    """Sound XML; both weights of the font hold every letter that is used."""
    svg = printed(scores, "svg", width_mm=85.0).decode()
    ET.fromstring(svg)  # noqa: S314 - made here
    words = set("".join(re.findall(r"<text[^>]*>([^<]*)</text>", svg)))
    fonts = re.findall(r"data:font/woff;base64,([^)]*)\)", svg)

    assert "similarity" in svg
    assert len(words) > 20
    assert len(fonts) == 2
    for font in fonts:
        letters = TTFont(BytesIO(base64.b64decode(font))).getBestCmap()
        assert {ord(letter) for letter in words if letter.strip()} <= set(letters)
    assert len(svg) < 200_000


def test_pdf_has_its_fonts_in_it(scores):
    """As TrueType, of which text can be searched and copied; and it says what is to be seen."""
    pdf = printed(scores, "pdf", width_mm=85.0)

    assert b"/FontFile2" in pdf
    assert b"/Subtype /Type3" not in pdf
    assert b"CreationDate" not in pdf
    assert b"/Subject" in pdf


@pytest.mark.parametrize("kind", FORMATS)
def test_files_are_the_same_every_time(two_rooms, kind):
    """Nothing of the day or of chance is in them."""
    picture = arena_picture(two_rooms)

    assert printed(picture, kind, width_mm=85.0) == printed(picture, kind, width_mm=85.0)


def test_a_png_says_what_is_to_be_seen(scores):
    """The texts of its panels stand in it."""
    made = printed(scores, "png")

    assert b"Description" in made
    assert scores.panels[0].alt.encode() in made


def test_the_screen_has_the_picture_as_it_was_drawn(scores):
    """Three panels of 3.75 inches at 150 dots."""
    assert imread(BytesIO(printed(scores, "png"))).shape[1] == pytest.approx(1687.5, abs=1)
    assert np.isfinite(imread(BytesIO(printed(scores, "png")))).all()
