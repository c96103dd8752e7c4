"""The page of a diagnosis: what it says, when it is drawn, how a browser shows it."""

import dataclasses
import html
import json
import math
import multiprocessing
import os
import re
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from zfcal.diagnose import case, selection
from zfcal.diagnose.document import Sheet, findings_document, gap_document, read_document
from zfcal.diagnose.findings import FeatureCurve, Gap, Note, Screened, Verdict
from zfcal.parameters import natural
from zfcal.report.diagnosis import page as diagnosis_page
from zfcal.report.diagnosis import words as diagnosis_words
from zfcal.report.diagnosis.figures import finding_picture, shown_places, slug
from zfcal.report.diagnosis.overview import gap_picture, screened_picture
from zfcal.report.diagnosis.render_pool import RenderPool
from zfcal.report.diagnosis.tables import tables
from zfcal.report.diagnosis.words import statements, verdict_sentence
from zfcal.report.figures import theme
from zfcal.report.figures.panels import compose
from zfcal.report.options import Printing

LOADED = "--virtual-time-budget=5000"
# Chromium's words for the two colour schemes.
SCHEMES = {"dark": 0, "light": 1}

MEASURE = """
const frame = document.querySelector('iframe');
frame.onload = () => {
  const page = frame.contentDocument, seen = {};
  const style = (e, p) => frame.contentWindow.getComputedStyle(e)[p];
  seen.width = page.documentElement.scrollWidth;
  seen.ground = style(page.body, 'backgroundColor');
  const panels = [...page.querySelectorAll('figure > svg')];
  seen.panels = panels.length;
  seen.widest = Math.max(...panels.map(p => p.getBoundingClientRect().right));
  const texts = panels.flatMap(p => [...p.querySelectorAll('text')]);
  const scale = m => Math.hypot(m.a, m.b);
  seen.letters = Math.min(...texts.map(
    t => parseFloat(style(t, 'fontSize')) * scale(t.getScreenCTM())));
  // A letter's box is larger than its ink by some pixels.
  const leaves = (a, b) => a.left < b.left - 4 || a.right > b.right + 4 || a.top < b.top - 4;
  seen.outside = panels.flatMap(p => [...p.querySelectorAll('text')].filter(
    t => leaves(t.getBoundingClientRect(), p.getBoundingClientRect())).map(t => t.textContent));
  seen.verdict = page.querySelector('h1').textContent;
  document.title = JSON.stringify(seen);
};
frame.srcdoc = document.getElementById('page').content.textContent;
"""


def gap_of(**closed):
    """Return a gap with these shares closed."""
    return [
        Gap(
            measure=measure,
            before=0.3,
            after=0.1,
            floor=0.05,
            closed=share,
            interval=(share - 0.1, share + 0.1),
            placebo=0.02,
        )
        for measure, share in closed.items()
    ]


@pytest.fixture(scope="module")
def make_sheet(two_rooms, make_diagnosis):
    """Return what makes all that a page shows; keywords replace parts of the diagnosis."""
    model = natural(tuple((z.name, z.follows_walls) for z in two_rooms.zones), dt_s=0.2)

    def make(*, gap=(), arena=two_rooms, **changes):
        document = findings_document(make_diagnosis(arena, model, **changes), arena)
        document["gap"] = gap_document(gap)
        return Sheet(
            trial="trial <1>",
            model="models/000000.toml",
            arena=arena,
            findings=read_document(json.loads(json.dumps(document))),
            provenance={"findings": "f" * 64, "lineage": {"inputs": {"trial.toml": "a" * 64}}},
        )

    return make


@pytest.fixture
def undrawn(monkeypatch):
    """Draw nothing: for tests of what is written when, and of words."""
    monkeypatch.setattr(
        "zfcal.report.diagnosis.drawing.png_of", lambda picture: picture.title.encode()
    )
    monkeypatch.setattr("zfcal.report.render.panel_svg", lambda *_: "<svg></svg>")


@pytest.mark.parametrize(
    ("verdict", "names", "says"),
    [
        (Verdict.NAMED, ("alignment",), "The model lacks alignment"),
        (Verdict.NAMED, ("a", "b", "c"), "The model lacks a, b and c"),
        (Verdict.UNEXPLAINED, (), "Model and fish disagree, and no known effect explains it"),
        (Verdict.NO_EFFECT, (), "The model lacks nothing that 10 min of tracks could show"),
        (Verdict.UNTESTABLE, (), "10 min of tracks are too little to say what the model lacks"),
    ],
)
def test_the_verdict_in_a_sentence(make_sheet, verdict, names, says):
    """It is the heading of the page."""
    assert verdict_sentence(make_sheet(verdict=verdict, names=names).findings) == says


def test_a_tie_names_all_that_it_may_be(make_sheet):
    """In the heading and on the card."""
    sheet = make_sheet()
    effect = replace(sheet.findings.effects[0], ties=("group-cohesion",))
    findings = replace(sheet.findings, verdict=Verdict.TIE, effects=(effect,))
    assert verdict_sentence(findings) == (
        "The model lacks alignment or group-cohesion: "
        "they cannot be distinguished in this recording"
    )
    assert "cannot be distinguished from group-cohesion" in statements(findings)[0].answer


@pytest.mark.parametrize(
    ("ties", "says"),
    [
        (
            [("b",), (), ("e", "f")],
            (
                "either a or b, which cannot be distinguished in this recording, "
                "c and either d or e or f, "
                "which cannot be distinguished in this recording"
            ),
        ),
        ([("b",), ()], "either a or b, which cannot be distinguished in this recording, and c"),
        ([(), ("d",)], "a and either c or d, which cannot be distinguished in this recording"),
    ],
)
def test_a_tie_does_not_hide_the_other_effects(make_sheet, ties, says):
    """Each effect is named, with what it cannot be told from."""
    effect = make_sheet().findings.effects[0]
    effects = tuple(
        replace(effect, name=name, ties=tied) for name, tied in zip("acd", ties, strict=False)
    )
    verdict = Verdict.TIE if ties[0] else Verdict.NAMED
    findings = replace(make_sheet().findings, verdict=verdict, effects=effects)
    assert verdict_sentence(findings) == f"The model lacks {says}"


def noted(make_sheet, names=("alignment",), **values):
    """Return findings with these numbers in their notes, such as ``omnibus={"p": 0.1}``."""
    notes = tuple(Note(name=name, says="Says.", values=each) for name, each in values.items())
    return make_sheet(names=names, notes=notes).findings


def card(findings, question):
    """Return the card with a question; None without it."""
    return next((each for each in statements(findings) if each.question == question), None)


FULL, QUICK = {"replicates": 39.0}, {"replicates": 6.0}
SHARP, NOISY = {"noise_m": 1e-5}, {"noise_m": 5e-4}


@pytest.mark.parametrize(
    ("p", "null", "noise", "says"),
    [
        (0.2, FULL, NOISY, "With it in the model, nothing is left that the ranks of headings"),
        (0.2, FULL, {}, "(by chance alone in 20 % of recordings)"),
        (1e-5, FULL, NOISY, "model and fish still disagree (by chance alone in less than 0.01 %"),
        (1e-3, {"replicates": 0.0}, SHARP, "nothing is left"),
        (9e-4, {"replicates": 0.0}, SHARP, "its fitted size is then that of our form"),
        (0.2, QUICK, NOISY, "without --quick"),
        (1e-5, QUICK, {}, "A quick look cannot show"),
        (1e-5, {}, NOISY, "A quick look cannot show"),
    ],
)
def test_whether_the_model_with_the_effect_still_fails(make_sheet, p, null, noise, says):
    """By the omnibus test where it was held against something, right after the effects."""
    findings = noted(make_sheet, omnibus={"z": 3.0, "p": p}, null=null, noise=noise)
    assert statements(findings)[1] == card(findings, "Is anything left?")
    assert says in card(findings, "Is anything left?").answer


def test_what_is_left_beside_several_effects_or_none(make_sheet):
    """They are several there; without an effect the verdict says it already."""
    values = {"omnibus": {"z": 9.0, "p": 1e-9}, "null": FULL}
    both = card(noted(make_sheet, names=("a", "b"), **values), "Is anything left?")
    assert both.answer.startswith("Yes: with them in the model")
    assert "another effect is beside them" in both.answer
    assert card(noted(make_sheet, names=(), **values), "Is anything left?") is None
    unknown = noted(make_sheet, omnibus={"z": math.nan, "p": math.nan}, null=FULL)
    assert card(unknown, "Is anything left?") is None


def test_a_quick_look_is_told_by_what_makes_it_one():
    """The page does not import the engine, which takes seconds, for three numbers."""
    assert diagnosis_words.QUICK_REPLICATES == case.QUICK_REPLICATES
    assert diagnosis_words.SHARP_M == case._SHARP_M
    assert diagnosis_words.UNLIKE == selection.UNNAMED_LEVEL


def test_a_control_that_fires_is_the_first_card(make_sheet):
    """With the engine's words; controls that are silent have none."""
    says = "NEGATIVE CONTROL FIRES: a shuffled turn. Do not trust this diagnosis."
    fired = make_sheet(notes=(Note(name="controls", says=says, values={"z": 9.0}),)).findings
    first = statements(fired)[0]
    assert first.question == "Warning"
    assert first.answer.startswith(says)
    assert first.warns
    assert not any(each.warns for each in statements(fired)[1:])
    silent = "Negative controls are silent, as they must be."
    findings = make_sheet(notes=(Note(name="controls", says=silent, values={}),)).findings
    assert card(findings, "Warning") is None


def test_the_engine_says_that_a_control_fires_in_the_words_that_are_looked_for(repository):
    """It would be silent on the page otherwise."""
    engine = (repository / "zfcal" / "diagnose" / "notes.py").read_text(encoding="utf-8")
    assert f'"{diagnosis_words.FIRES}: ' in engine


@pytest.mark.parametrize(
    ("strength", "says"),
    [
        ({"strength": 0.2, "direction_rad": 1.0}, "goes toward 57° on the map"),
        ({"strength": 0.2, "direction_rad": -0.5}, "goes toward 331° on the map"),
        ({"strength": -0.2, "direction_rad": 1.0}, "goes toward 237° on the map"),
        (
            {"strength": 0.2, "x_m": 0.113, "y_m": 0.861, "reach_m": 0.25},
            "The place is at x = 0.11 m, y = 0.86 m, and it reaches 0.25 m.",
        ),
        ({"strength": 0.2, "x_m": 0.113, "y_m": 0.861}, "x = 0.11 m, y = 0.86 m."),
    ],
)
def test_a_card_says_which_way_and_where(make_sheet, strength, says):
    """For whoever stands at the tank; maps have x to the right and y upwards."""
    findings = make_sheet(names=("alignment",)).findings
    (effect,) = findings.effects
    placed = dataclasses.replace(effect, strength=strength)
    there = dataclasses.replace(findings, effects=(placed,))
    assert says in statements(there)[0].answer
    assert "°" not in statements(findings)[0].answer


def test_cards_say_what_is_missing_how_much_and_what_else_was_asked(make_sheet):
    """The gap's card names the placebo."""
    cards = statements(make_sheet(gap=gap_of(nats_per_step=0.8)).findings)
    assert cards[0].figure[0] == "+0.0123 nats"
    assert "less than 0.01 %" in cards[0].answer
    assert "80 % (70 to 90)" in cards[1].answer
    assert "a wrong effect with as many parameters, 2 %" in cards[1].answer
    assert "a diagnosis chooses its effects on all" in cards[1].answer
    assert "4 candidates were tested" in cards[2].answer
    assert "robot-avoidance (a robot)" in cards[2].answer


def test_the_card_of_the_gap_says_what_was_added(make_sheet):
    """It need not be what was found: anything can be added by its name."""
    says = "Added: turning-bias. Wrong effect for comparison: boldness."
    notes = (Note(name="extended", says=says, values={}),)
    findings = make_sheet(gap=gap_of(nats_per_step=0.8), notes=notes).findings
    found = card(findings, "How much better is the model with what was added?")
    assert found.answer.startswith(f"{says} On minutes that neither fit has seen, what was added")
    assert "80 % (70 to 90)" in found.answer


def test_what_was_fitted_and_what_was_calibrated_is_said(make_sheet):
    """Two of the measures are of the models before they were calibrated."""
    gap = gap_of(nats_per_step=0.8)
    (table,) = (each for each in tables(make_sheet(gap=gap)) if each.name == "gap-numbers")
    assert "as fitted, before they are calibrated" in table.note
    assert "as fitted; the other rows are of the same three after" in gap_picture(gap).note


def test_what_a_recording_is_too_short_for_is_not_called_not_missing(make_sheet):
    """However loud; the effect that needs least says how many minutes would do."""
    asked = (
        Screened(name="alignment", z=14.2, p=1e-12),
        Screened(name="boldness", z=2.4, p=0.9, minutes_needed=145.0),
        Screened(name="fatigue", z=0.1, p=1.0, minutes_needed=45.0),
        Screened(name="crowding", z=-1.4, p=1.0),
    )
    answer = card(make_sheet(screened=asked).findings, "What else was tested?").answer
    assert "Of those not missing the loudest is crowding, z = -1.4." in answer
    assert (
        "This recording is too short to show these where they are faint: boldness and fatigue; "
        "45 min would do for fatigue."
    ) in answer


def test_an_effect_that_was_found_does_not_wait_for_more_minutes(make_sheet):
    """Beside another it may have been faint at first."""
    asked = (Screened(name="alignment", z=1.0, p=0.9, minutes_needed=45.0),)
    answer = card(make_sheet(screened=asked).findings, "What else was tested?").answer
    assert "too short" not in answer


def test_tables_hold_every_number(make_sheet):
    """The loudest candidate first, tracks by their ids, no empty table."""
    sheet = make_sheet(gap=gap_of(nats_per_step=0.8, T=math.nan))
    by_name = {table.name: table for table in tables(sheet)}
    assert by_name["candidates"].rows[0][:2] == ["alignment", "14"]
    assert by_name["where"].rows[0][1:4] == ["corridor", "0 to 300", "1, 3"]
    assert by_name["gap-numbers"].rows[1][4:6] == ["–", "–"]
    assert by_name["notes"].rows[0][2] == "sd_mm = 0.5"
    assert "gap-numbers" not in {table.name for table in tables(make_sheet())}


def test_a_recording_that_nobody_makes_is_not_counted_in_minutes(make_sheet):
    """Fish of one speed would show a burst after years: that is no advice."""
    asked = [Screened(name="freezing", z=0.1, p=1.0, minutes_needed=2.5e8)]
    by_name = {table.name: table for table in tables(make_sheet(screened=tuple(asked)))}
    assert by_name["candidates"].rows[0][3] == "over 10,080"
    answer = card(make_sheet(screened=tuple(asked)).findings, "What else was tested?").answer
    assert answer.endswith("faint: freezing; a week would not do.")


def test_the_two_ends_of_a_gap_differ_in_the_table(make_sheet):
    """A thousandth of a nat a step is a clear effect."""
    gap = [
        dataclasses.replace(each, before=1.04179, after=1.04356)
        for each in gap_of(nats_per_step=0.7)
    ]
    by_name = {table.name: table for table in tables(make_sheet(gap=gap))}
    assert by_name["gap-numbers"].rows[0][1:3] == ["1.0418", "1.0436"]


def test_page_and_pictures_are_written_and_found_again(make_sheet, tmp_path, undrawn):
    """The page says which findings it shows, and holds nothing from elsewhere."""
    sheet = make_sheet(gap=gap_of(nats_per_step=0.8), names=("alignment", "generic:heading:wall"))
    written = diagnosis_page.write(tmp_path, sheet)
    assert [path.name for path in written] == [
        "report.html",
        "1-alignment.png",
        "2-generic-heading-wall.png",
        "gap.png",
        "screened.png",
    ]
    assert diagnosis_page.reason(tmp_path, "f" * 64) is None
    assert diagnosis_page.files(tmp_path) == written
    text = written[0].read_text(encoding="utf-8")
    assert not re.findall(r'(?:src|href)="(?!#|data:|[\w-]+\.png")', text)
    assert "trial &lt;1&gt;" in text


def test_why_a_page_is_drawn_again(make_sheet, tmp_path, undrawn):
    """Missing, other findings, a picture gone or changed, or a page of something else."""
    assert diagnosis_page.reason(tmp_path, "f" * 64) == "missing"
    diagnosis_page.write(tmp_path, make_sheet())
    assert diagnosis_page.reason(tmp_path, "0" * 64) == "the findings changed"
    (tmp_path / "screened.png").write_text("other")
    assert diagnosis_page.reason(tmp_path, "f" * 64) == "screened.png was changed"
    (tmp_path / "screened.png").unlink()
    assert diagnosis_page.reason(tmp_path, "f" * 64) == "screened.png is missing"
    (tmp_path / "report.html").write_text("<p>hello")
    assert "does not say what it shows" in diagnosis_page.reason(tmp_path, "f" * 64)


@pytest.mark.slow
def test_pictures_in_other_formats_and_at_a_width(make_sheet, tmp_path):
    """PDF alone, 85 mm wide on paper; the PNGs of before go, and the page names the new files."""
    sheet = make_sheet(names=())
    diagnosis_page.write(tmp_path, sheet)
    assert (tmp_path / "screened.png").exists()
    form = Printing(formats=("pdf", "svg"), width_mm=85.0)
    assert "format or width" in diagnosis_page.reason(tmp_path, "f" * 64, form)
    page, *pictures = diagnosis_page.write(tmp_path, sheet, printing=form)
    assert [path.name for path in pictures] == ["screened.pdf", "screened.svg"]
    assert not (tmp_path / "screened.png").exists()
    box = re.search(rb"/MediaBox \[ ?0 0 ([\d.]+)", pictures[0].read_bytes())
    assert float(box.group(1)) == pytest.approx(85.0 / 25.4 * 72, abs=0.5)
    assert "<code>screened.pdf</code>, <code>screened.svg</code>" in page.read_text()
    assert diagnosis_page.reason(tmp_path, "f" * 64, form) is None
    assert "format or width" in diagnosis_page.reason(tmp_path, "f" * 64, Printing())


def test_whoever_names_no_form_keeps_that_of_the_page(make_sheet, tmp_path):
    """An extension draws the page anew, and the figures of a paper stay."""
    sheet = make_sheet(names=())
    diagnosis_page.write(tmp_path, sheet, printing=Printing(formats=("svg",), width_mm=174.0))
    before = (tmp_path / "screened.svg").read_bytes()
    assert diagnosis_page.reason(tmp_path, "f" * 64) is None
    (tmp_path / "screened.svg").unlink()
    written = diagnosis_page.write(tmp_path, sheet)
    assert [path.name for path in written] == ["report.html", "screened.svg"]
    assert (tmp_path / "screened.svg").read_bytes() == before


def test_pictures_of_older_findings_go(make_sheet, tmp_path, undrawn):
    """They would pass for current; other files stay."""
    diagnosis_page.write(tmp_path, make_sheet())
    (tmp_path / "mine.png").write_text("mine")
    diagnosis_page.write(tmp_path, make_sheet(names=()))
    assert not (tmp_path / "1-alignment.png").exists()
    assert (tmp_path / "mine.png").exists()


@pytest.mark.slow
def test_a_pool_draws_what_is_drawn_without(make_sheet, tmp_path):
    """Processes of its own give the same bytes, stand back, and are gone afterwards."""
    sheet = make_sheet(names=())
    with RenderPool() as pool:
        pool.prepare()
        hands = multiprocessing.active_children()
        drawn = {path.name: path.read_bytes() for path in pool.write(tmp_path / "a", sheet)}
        nice = [os.getpriority(os.PRIO_PROCESS, hand.pid) for hand in hands]
    assert nice == [min(os.getpriority(os.PRIO_PROCESS, 0) + 10, 19)] * 2
    assert not multiprocessing.active_children()
    without = diagnosis_page.write(tmp_path / "b", sheet)
    assert drawn == {path.name: path.read_bytes() for path in without}


def is_deaf(pid):
    """Return whether a process holds back interrupts from the keyboard."""
    (held,) = re.findall(r"SigBlk:\s*(\w+)", Path(f"/proc/{pid}/status").read_text())
    return bool(int(held, 16) >> (signal.SIGINT - 1) & 1)


def test_hands_are_deaf_to_the_keyboard_and_dropped_after_an_error():
    """An interrupt is for whoever began them; then nobody waits until they are ready."""
    hands = {}

    def interrupted():
        with RenderPool() as pool:
            pool.prepare()
            for hand in multiprocessing.active_children():
                hands[hand] = is_deaf(hand.pid)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert list(hands.values()) == [True, True]
    assert [hand.exitcode for hand in hands] == [-signal.SIGTERM] * 2
    assert not signal.pthread_sigmask(signal.SIG_BLOCK, ())


ALONE = """
import multiprocessing, os, signal
from zfcal.report.diagnosis.render_pool import RenderPool
from zfcal.report.options import Printing
with RenderPool() as pool:
    pool.prepare()
    print(*(hand.pid for hand in multiprocessing.active_children()), flush=True)
    input()
"""


def test_the_first_hands_are_deaf_and_end_with_a_parent_that_is_killed():
    """They would wait for good. In a process that has not spawned any before."""
    parent = subprocess.Popen(
        [sys.executable, "-c", ALONE],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    hands = parent.stdout.readline().split()
    deaf = [is_deaf(pid) for pid in hands]
    parent.kill()
    assert deaf == [True, True]
    # They hold its output open: that ends when they do.
    assert parent.communicate(timeout=60)[0] == ""


def test_a_pool_that_can_have_no_processes(make_sheet, tmp_path, undrawn, monkeypatch):
    """Where they are not allowed, the page is drawn without."""

    def refused(*_, **__):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr("zfcal.report.diagnosis.render_pool.ProcessPoolExecutor", refused)
    with RenderPool() as pool:
        pool.prepare()
        pool.prepare()
        written = pool.write(tmp_path, make_sheet())
    assert written[0].name == "report.html"


def test_a_pool_whose_process_was_killed(make_sheet, tmp_path, undrawn):
    """The page is drawn all the same."""
    with RenderPool() as pool:
        pool.prepare()
        for hand in multiprocessing.active_children():
            hand.kill()
        written = pool.write(tmp_path, make_sheet())
    assert [path.name for path in written] == ["report.html", "1-alignment.png", "screened.png"]
    # Drawn here, where drawing is replaced by a line.
    assert not written[1].read_bytes().startswith(b"\x89PNG")
    assert pool.reason(tmp_path, "f" * 64) is None
    assert pool.files(tmp_path) == written


@pytest.mark.slow
def test_the_same_findings_give_the_same_bytes(make_sheet, tmp_path):
    """Pictures and page hold nothing of the day."""
    sheet = make_sheet(gap=gap_of(nats_per_step=0.8))
    first, second = (
        {path.name: path.read_bytes() for path in diagnosis_page.write(tmp_path / name, sheet)}
        for name in ("a", "b")
    )
    assert first == second


def test_a_square_with_few_steps_stays_empty(make_sheet):
    """Its mean is chance."""
    pictured = make_sheet().findings.pictured[0]
    shown = shown_places(pictured)
    assert np.isnan(shown[pictured.place_n < 10]).all()
    assert not np.isnan(shown[pictured.place_n >= 10]).any()


@pytest.mark.parametrize("name", ["two-rooms", "open-square", "ring", "own", "narrow"])
def test_texts_of_a_finding_do_not_cover_each_other(make_sheet, arenas, covered_texts, name):
    """Whatever the tank, also with long words for what the fish respond to."""
    arena = arenas[name]
    sheet = make_sheet(arena=arena)
    pictured = sheet.findings.pictured[0]
    curve = replace(
        pictured.curve, response_name="score of the effect (standard deviations a step)"
    )
    picture = finding_picture("alignment", 1, replace(pictured, curve=curve), arena)
    assert not covered_texts(picture)


@pytest.mark.parametrize("name", ["two-rooms", "narrow"])
def test_the_curve_of_a_feature_is_drawn_beside_the_form(make_sheet, arenas, covered_texts, name):
    """With its interval, what it gains and what is no part of it; without knots there is none."""
    pictured = make_sheet().findings.pictured[0]
    curve = FeatureCurve(
        label="leaning", nats=84.0, form_nats=76.3, cue="distance to the other (m)",
        strength_name="preference (nats)", at=np.array([0.0, 0.1, 0.4]),
        strength=np.array([0.2, 0.05, 0.0]), low=np.array([0.1, 0.0, 0.0]),
        high=np.array([0.3, 0.1, 0.02]), form=np.array([0.15, 0.06, 0.0]),
        besides={"the nearest, wherever it is": (0.1, 0.05, 0.15)},
    )  # fmt: skip
    picture = finding_picture("alignment", 1, pictured, arenas[name], curve)
    panel = picture.panels[-1]
    assert panel.title == "How strong, by distance to the other"
    assert "largest, 0.2, at 0" in panel.alt
    assert "gains 84 nats" in picture.note
    assert "form gains 76" in picture.note
    assert "Besides, the nearest, wherever it is: 0.1 (0.05 to 0.15)." in picture.note
    assert [entry.label for entry in picture.key][-1] == "fish, 95 % interval"
    assert not covered_texts(picture)
    with theme.style():
        axes = compose(picture).axes[4]
    fish, form = (line for line in axes.lines if line.get_marker() in {"o", "D"})
    assert list(fish.get_ydata()) == [0.2, 0.05, 0.0]
    assert list(form.get_ydata()) == [0.15, 0.06, 0.0]
    none = finding_picture("alignment", 1, pictured, arenas[name], replace(curve, at=np.zeros(0)))
    assert len(none.panels) == len(picture.panels) - 1
    assert "Besides" not in none.note


def test_the_map_says_where_in_words(make_sheet, two_rooms):
    """For those who cannot see it: place and size of the largest score."""
    pictured = make_sheet().findings.pictured[0]
    place = np.full(pictured.place.shape, 0.1)
    place[3, 4] = -0.7
    marked = replace(pictured, place=place, place_n=np.full(place.shape, 50))
    panel = finding_picture("alignment", 1, marked, two_rooms).panels[0]
    x_m = pictured.origin_m[0] + 4.5 * pictured.cell_m
    assert f"-0.70, at x = {x_m:.2f} m" in panel.alt


def test_positive_and_negative_scores_have_opposite_colours_of_one_depth(make_sheet, two_rooms):
    """Zero is in the middle of the scale."""
    pictured = make_sheet().findings.pictured[0]
    picture = finding_picture("alignment", 1, pictured, two_rooms)
    with theme.style():
        (image,) = compose(picture).axes[0].images
    assert image.norm.vmin == -image.norm.vmax
    assert image.norm(0.0) == 0.5


@pytest.mark.slow
def test_overviews_do_not_cover_their_texts(make_sheet, covered_texts):
    """With one candidate, with thirty, and with gaps beyond the scale."""
    many = [Screened(name=f"effect-number-{i}", z=3.0 * i - 20, p=0.1) for i in range(30)]
    assert not covered_texts(screened_picture(many, ["effect-number-3"]))
    assert not covered_texts(screened_picture(many[:1], []))
    waiting = replace(many[1], minutes_needed=45.0)
    assert not covered_texts(screened_picture([*many, waiting], ["effect-number-3"]))
    gap = gap_of(nats_per_step=0.9, S_over_ceiling=-3.0, D=7.0, W=0.5, O=0.1, T=0.2, effect=1.0)
    assert not covered_texts(gap_picture(gap))


def test_a_candidate_that_needs_more_minutes_is_hollow(make_sheet):
    """It is not said to be not missing; without one the key has no such mark."""
    asked = [
        Screened(name="a", z=9.0, p=1e-9),
        Screened(name="b", z=0.4, p=1.0),
        Screened(name="c", z=0.2, p=1.0, minutes_needed=45.0),
    ]
    picture = screened_picture(asked, ["a"])
    assert [entry.label for entry in picture.key] == [
        "missing",
        "not missing",
        "too short to say",
        "within chance",
    ]
    with theme.style():
        points = compose(picture).axes[0].lines[2::2]
        inside = {line.get_ydata()[0]: line.get_markerfacecolor() for line in points}
    assert inside == {0: theme.GROUND, 1: theme.MUTED, 2: theme.MODEL}
    assert "too short to say" not in {entry.label for entry in screened_picture(asked[:2], []).key}


@pytest.mark.slow
@pytest.mark.parametrize(
    "cue",
    [
        "distance to the nearest neighbour (cm)",
        "distance to the wall (cm)",
        "speed of the step before (cm/s)",
        "time (min)",
        "the last turn (degrees to the left)",
    ],
)
def test_the_curve_is_called_after_what_it_goes_by(make_sheet, two_rooms, covered_texts, cue):
    """An effect may respond to something else."""
    pictured = make_sheet().findings.pictured[0]
    response = "score of the effect (standard deviations a step)"
    curve = replace(pictured.curve, cue_name=cue, response_name=response)
    picture = finding_picture("alignment", 1, replace(pictured, curve=curve), two_rooms)
    assert picture.panels[2].title == f"By {cue.partition(' (')[0]}"
    assert not covered_texts(picture)
    # As on the page, where each panel has a place of its own.
    assert not covered_texts(replace(picture, panels=picture.panels[2:3], key=()))


def test_all_panels_show_one_score_in_the_same_marks(make_sheet, two_rooms):
    """By what the effect responds to as by minute: what is left, near zero for a right model."""
    pictured = make_sheet().findings.pictured[0]
    curve = pictured.curve
    picture = finding_picture("alignment", 1, pictured, two_rooms)
    figure = compose(picture)
    by_minute, by_cue = figure.axes[1], figure.axes[2]

    for axes in (by_minute, by_cue):
        assert axes.get_ylabel() == "score"
        assert [line.get_marker() for line in axes.get_lines()][-2:] == ["^", "D"]
        assert axes.collections
    without, with_it = by_cue.get_lines()[-2:]
    assert without.get_ydata() == pytest.approx(curve.observed - curve.before)
    assert with_it.get_ydata() == pytest.approx(curve.observed - curve.after)
    assert not [entry for entry in picture.key if entry.label == "measured"]


@pytest.mark.parametrize(
    ("interval", "says", "figure"),
    [
        ((-7.1, 18.6), "anything from -710 to 1860 %", "unknown"),
        ((0.0, 1.0), "anything from 0 to 100 %", "unknown"),
        ((0.1, 1.2), "closes 80 % (10 to 120)", "80 %"),
        ((-0.2, 0.9), "closes 80 % (-20 to 90)", "80 %"),
    ],
)
def test_a_share_that_may_be_none_or_all_is_no_figure(make_sheet, interval, says, figure):
    """A gap next to nothing is not said to be closed by so many hundred per cent."""
    gap = [dataclasses.replace(each, interval=interval) for each in gap_of(nats_per_step=0.8)]
    found = card(make_sheet(gap=gap).findings, "How much better is the model with it?")
    assert says in found.answer
    assert found.figure[0] == figure


def test_without_candidates_and_gap_there_are_no_overviews():
    """Nothing to show is no picture."""
    assert screened_picture([Screened(name="x", z=math.nan, p=math.nan)], []) is None
    assert gap_picture(gap_of(D=math.nan)) is None


def test_names_become_file_names():
    """Colons and capitals are not for every file system."""
    assert slug("generic:heading:wall") == "generic-heading-wall"


@pytest.fixture(scope="module")
def drawn_page(tmp_path_factory, make_sheet):
    """A page with two findings and a gap."""
    sheet = make_sheet(
        gap=gap_of(nats_per_step=0.8, D=0.5, effect=0.9), names=("alignment", "turning-bias")
    )
    return diagnosis_page.write(tmp_path_factory.mktemp("diagnosis"), sheet)[0]


@pytest.mark.slow
@pytest.mark.apt
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_fits_and_can_be_read(debian, drawn_page, tmp_path, width, scheme):
    """Nothing sticks out or is cut, letters are 8 pixels or more, colours follow the scheme."""
    wrapper = tmp_path / "wrapper.html"
    # A document in a frame can be narrower than a window may be.
    wrapper.write_text(
        "<!DOCTYPE html><title></title>"
        f'<iframe style="width:{width}px;height:9000px;border:0"></iframe>'
        f'<template id="page">{html.escape(drawn_page.read_text(encoding="utf-8"))}</template>'
        f"<script>{MEASURE}</script>",
        encoding="utf-8",
    )
    words = [
        debian.need("chromium"),
        *debian.HEADLESS,
        LOADED,
        f"--user-data-dir={tmp_path / 'profile'}",
        f"--blink-settings=preferredColorScheme={SCHEMES[scheme]}",
        "--window-size=1400,1000",
        "--dump-dom",
        wrapper.as_uri(),
    ]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=True)
    title = re.search(r"<title>(\{.*?\})</title>", done.stdout)
    assert title, done.stderr[-2000:]
    seen = json.loads(html.unescape(title.group(1)))
    ground = theme.THEME[theme.GROUND][1 if scheme == "light" else 2]
    assert seen["width"] <= width
    assert seen["widest"] <= width
    assert seen["panels"] == 10
    assert seen["outside"] == []
    assert seen["letters"] >= 8
    assert seen["verdict"] == "The model lacks alignment and turning-bias"
    assert seen["ground"] == "rgb({}, {}, {})".format(*bytes.fromhex(ground[1:]))
