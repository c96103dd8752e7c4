"""The page in a real browser: what it shows, how it follows, plays, and comes back."""

import re
import time
from urllib.parse import urlsplit

import pytest

from zfcal.view.process import Page

pytestmark = [pytest.mark.apt, pytest.mark.slow]

DRAWN = "document.documentElement.dataset.agents"
SECOND = "Number(document.documentElement.dataset.second)"
LINK = "document.getElementById('link').textContent"


@pytest.fixture
def browser(debian, browsing, tmp_path):
    """Return a page of Chromium that a test drives."""
    with browsing.Browser(
        [debian.need("chromium"), *debian.HEADLESS], tmp_path / "profile"
    ) as opened:
        opened.show()
        yield opened


def text_of(name):
    """Return what asks for the text of an element."""
    return f"document.getElementById('{name}').innerText"


def test_it_shows_the_trial_and_asks_for_nothing_elsewhere(browser, trial, tmp_path):
    """Tank, S of its ceiling, parameters with intervals, stages; no error, no other address."""
    with Page(trial, 0) as page:
        browser.go(page.url)
        browser.until(f"{DRAWN} === '4'")
        browser.value("document.getElementById('play').click()")
        browser.press("End")
        assert browser.until("document.getElementById('s').innerText === '0.800'")
        assert browser.value(text_of("s-of")) == "ceiling 0.900"
        assert "within what windows of the model" in browser.value(text_of("s-note"))
        levels = browser.value("document.getElementById('rounds').textContent")
        assert levels.startswith("0.00.20.40.60.81.0")
        assert "1.00 to 9.00" in browser.value(text_of("parameters"))
        assert "published by the rule nearest" in browser.value(text_of("parameters-note"))
        assert browser.value(text_of("stage-rows")).split() == [
            *("Track", "not", "here", "3:00", "Analyse", "not", "here", "–"),
            *("Calibrate", "not", "here", "3:00"),
        ]
        label = "document.getElementById('tank').ariaLabel"
        assert re.search(
            r"at \d:\d\d: 3 fish; .*the robot in", browser.until(f"{label}.length > 30 && {label}")
        )
        assert "3:00: 0.80 (ceiling 0.90, within" in browser.value(
            "document.getElementById('rounds').ariaLabel"
        )
        assert browser.problems() == []
        hosts = {urlsplit(address).netloc for address in browser.asked_for()}
        assert hosts <= {urlsplit(page.url).netloc, ""}


def test_a_score_above_the_range_of_its_ceiling_is_hollow(browser, trial, made, tmp_path):
    """That mark alone; the key and the text in place of the picture say what it means."""
    said = "above the range of its ceiling: fits chance"
    hollow = "[...document.querySelectorAll('#rounds .above')]"
    label = "document.getElementById('rounds').ariaLabel"
    with Page(trial, 0) as page:
        browser.go(page.url)
        browser.until(f"{DRAWN} === '4'")
        browser.until("document.querySelectorAll('#score-keys li').length")
        assert browser.value(f"{hollow}.length") == 0
        assert said not in browser.value(text_of("score-keys"))
        assert "Hollow" not in browser.value(label)
        made["round"](trial, 180, 0.98)
        browser.until(f"{hollow}.length === 1")
        fill, ground, line = (
            browser.value(f"getComputedStyle({each}")
            for each in (
                f"{hollow}[0]).fill",
                "document.getElementById('score')).backgroundColor",
                f"{hollow}[0]).stroke",
            )
        )
        assert fill == ground != line
        assert said in browser.value(text_of("score-keys"))
        assert "above the range of its ceiling: it fits chance" in browser.value(label)
        assert "Hollow marks are above the range of the ceiling." in browser.value(label)
        assert browser.problems() == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_it_fits_the_window_in_the_colours_that_a_person_prefers(browser, trial, width, scheme):
    """Nothing sticks out; ground and ink are those of the report; fingers hit the buttons."""
    with Page(trial, 0) as page:
        browser.show(width, 800, scheme=scheme)
        browser.go(page.url)
        browser.until(f"{DRAWN} === '4'")
        assert browser.value("document.documentElement.scrollWidth") <= width
        ground = browser.value("getComputedStyle(document.body).backgroundColor")
        assert ground == {"light": "rgb(255, 255, 255)", "dark": "rgb(22, 25, 29)"}[scheme]
        sizes = (
            "[...document.querySelectorAll('button')].map(b => b.getBoundingClientRect().height)"
        )
        assert min(browser.value(sizes)) >= 40
        painted = (
            "(() => { const c = document.getElementById('tank');"
            "const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
            "return new Set(new Uint32Array(d.buffer)).size })()"
        )
        assert browser.value(painted) > 20


def test_it_follows_a_trial_that_grows(browser, empty, made):
    """Positions five times a second and more; a minute and a round as they come."""
    with Page(empty, 0) as page, made["poses"](empty, 0) as writer:
        browser.go(page.url)
        browser.until(f"{LINK} === 'Replay'")
        writer.add(made["poses_at"](0.0))
        seen, n = set(), 0
        began_s = time.monotonic()
        while time.monotonic() - began_s < 8:
            n += 1
            writer.add(made["poses_at"](n / 10))
            seen.add(browser.value(SECOND))
            time.sleep(0.1)
        assert browser.value(LINK) == "Live"
        # The first second or two pass before it knows that this is live.
        assert len(seen) > 5 * 4
        assert browser.value(DRAWN) == "3"
        made["round"](empty, 120, 0.75)
        made_it = "document.querySelectorAll('#marks rect').length"
        browser.until(f"{made_it} >= 2")
        browser.press("ArrowLeft")
        assert browser.until(f"{LINK} === 'Replay'")
        browser.press("l")
        assert browser.until("document.documentElement.dataset.mode === 'live'")


def test_it_says_that_the_server_is_gone_and_comes_back_by_itself(browser, trial, made):
    """What was seen stays; the next server at the same place is found, with what is new."""
    with Page(trial, 0) as page:
        port = urlsplit(page.url).port
        browser.go(page.url)
        browser.until(f"{DRAWN} === '4'")
    browser.until(f"{LINK} === 'Server gone, tries again'")
    assert browser.value("document.getElementById('alarm').hidden") is False
    assert "has ended" in browser.value(text_of("alarm"))
    assert browser.value(DRAWN) == "4"
    made["round"](trial, 240, 0.85)
    with Page(trial, port):
        browser.until("document.documentElement.dataset.link === 'open'")
        browser.until("document.getElementById('alarm').hidden")
        browser.press("End")
        browser.until("document.getElementById('rounds').ariaLabel.includes('4:00: 0.85')")


def test_after_ten_minutes_without_a_server_it_asks_for_a_reload(browser, trial):
    """Whoever has the port by then shall not hear the secret."""
    with Page(trial, 0) as page:
        port = urlsplit(page.url).port
        browser.go(page.url)
        browser.until(f"{DRAWN} === '4'")
    browser.until(f"{LINK} === 'Server gone, tries again'")
    later = "(() => { const now = performance.now(); performance.now = () => now + 6e5 })()"
    browser.value(later)
    browser.until(f"{LINK} === 'Server gone, reload'")
    assert "reload the page" in browser.value(text_of("alarm"))
    with Page(trial, port):
        time.sleep(3)
        assert browser.value("document.documentElement.dataset.link") == "gone"


def test_a_minute_that_was_played_while_it_grew_is_played_to_where_it_is(browser, empty, made):
    """What was fetched of it once is not all."""
    second = "document.getElementById('time')"
    go = f"(s => {{ {second}.value = s; {second}.dispatchEvent(new Event('input')) }})"
    with Page(empty, 0) as page, made["poses"](empty, 0) as writer:
        for n in range(10):
            writer.add(made["poses_at"](n / 5))
        browser.go(page.url)
        browser.until(f"{LINK} === 'Replay' && {DRAWN} === '3'")
        browser.value(f"{go}(1)")
        browser.until(f"{SECOND} === 1 && {DRAWN} === '3'")
        for n in range(10, 220):
            writer.add(made["poses_at"](n / 5))
        browser.until(f"{second}.max === '44'")
        browser.value(f"{go}(20)")
        browser.until(f"{SECOND} === 20 && {DRAWN} === '3'")
        for n in range(220, 290):
            writer.add(made["poses_at"](n / 5))
        browser.until(f"{second}.max === '58'")
        browser.value(f"{go}(50)")
        browser.until(f"{SECOND} === 50 && {DRAWN} === '3'")


def test_it_plays_and_every_key_does_what_it_says(browser, trial):
    """Space, arrows, with shift, the ends, speeds; at the end it stops."""
    with Page(trial, 0) as page:
        browser.go(page.url)
        browser.until(f"{DRAWN} === '4'")
        playing = "document.documentElement.dataset.playing === 'true'"
        browser.press(" ")
        browser.until(f"{playing} && {SECOND} > 0.5")
        browser.press(" ")
        browser.until(f"!({playing})")
        browser.press("Home")
        browser.until(f"{SECOND} === 0")
        browser.press("ArrowRight")
        browser.until(f"{SECOND} === 5")
        browser.ask("Input.dispatchKeyEvent", type="keyDown", key="ArrowRight", modifiers=8)
        browser.until(f"{SECOND} === 65")
        browser.press("ArrowLeft")
        browser.until(f"{SECOND} === 60")
        for speed in ("2", "5", "10"):
            browser.press("+")
            assert browser.value("document.getElementById('speed').value") == speed
        browser.press("-")
        assert browser.value("document.getElementById('speed').value") == "5"
        browser.press("End")
        browser.until(f"{SECOND} === 180 && {DRAWN} === '4'")
        bar = "document.getElementById('time')"
        assert browser.value(f"{bar}.getAttribute('aria-valuetext')") == "3:00 of 3:00"
        browser.value(f"{bar}.value = 90; {bar}.dispatchEvent(new Event('input'))")
        browser.until(f"{SECOND} === 90")
        assert browser.problems() == []


def test_who_wants_little_motion_gets_little(browser, trial):
    """Nothing plays by itself, and what plays is drawn at most about twice a second."""
    with Page(trial, 0) as page:
        browser.show(motion="reduce")
        browser.go(page.url)
        browser.until(f"{DRAWN} === '4'")
        assert browser.value("document.documentElement.dataset.playing") != "true"
        browser.press(" ")
        seen = set()
        began_s = time.monotonic()
        while time.monotonic() - began_s < 3:
            seen.add(browser.value(SECOND))
        assert 3 <= len(seen) <= 8
