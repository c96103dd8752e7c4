"""The page as a browser shows it: light and dark, on a desk and on a phone."""

import html
import json
import re
import subprocess

import pytest

from zfcal.report.figures import theme

LOADED = "--virtual-time-budget=5000"
# Chromium's words for the two colour schemes.
SCHEMES = {"dark": 0, "light": 1}

pytestmark = pytest.mark.apt

MEASURE = """
const frame = document.querySelector('iframe');
frame.onload = () => {
  const page = frame.contentDocument, seen = {};
  const style = (e, p) => frame.contentWindow.getComputedStyle(e)[p];
  seen.width = page.documentElement.scrollWidth;
  seen.ground = style(page.body, 'backgroundColor');
  const panels = [...page.querySelectorAll('figure > svg')];
  seen.panels = panels.length;
  seen.narrowest = Math.min(...panels.map(p => p.getBoundingClientRect().width));
  seen.widest = Math.max(...panels.map(p => p.getBoundingClientRect().right));
  const texts = panels.flatMap(p => [...p.querySelectorAll('text')]);
  const scale = m => Math.hypot(m.a, m.b);
  seen.letters = Math.min(...texts.map(
    t => parseFloat(style(t, 'fontSize')) * scale(t.getScreenCTM())));
  seen.ink = style(texts[0], 'fill');
  seen.columns = panels.filter(p => Math.abs(
    p.getBoundingClientRect().bottom - panels[0].getBoundingClientRect().bottom) < 2).length;
  document.title = JSON.stringify(seen);
};
frame.srcdoc = document.getElementById('page').content.textContent;
"""


def rgb(colour):
    """Return a colour as browsers write it."""
    return "rgb({}, {}, {})".format(*(int(colour[i : i + 2], 16) for i in (1, 3, 5)))


@pytest.fixture
def look(debian, drawn_trial, tmp_path):
    """Return what shows the page at a width in a colour scheme and measures what is seen."""
    chromium = debian.need("chromium")
    page = (drawn_trial / "report" / "index.html").read_text(encoding="utf-8")

    def show(width, scheme):
        wrapper = tmp_path / "wrapper.html"
        # A document in a frame can be narrower than a window may be.
        wrapper.write_text(
            "<!DOCTYPE html><title></title>"
            f'<iframe style="width:{width}px;height:9000px;border:0"></iframe>'
            f'<template id="page">{html.escape(page)}</template><script>{MEASURE}</script>',
            encoding="utf-8",
        )
        done = subprocess.run(
            [
                chromium,
                *debian.HEADLESS,
                LOADED,
                f"--user-data-dir={tmp_path / 'profile'}",
                f"--blink-settings=preferredColorScheme={SCHEMES[scheme]}",
                "--window-size=1400,1000",
                "--dump-dom",
                wrapper.as_uri(),
            ],
            capture_output=True,
            text=True,
            timeout=120,
            check=True,
        )
        title = re.search(r"<title>(\{.*?\})</title>", done.stdout)
        assert title, done.stderr[-2000:]
        return json.loads(html.unescape(title.group(1)))

    return show


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize(("width", "columns"), [(1280, 3), (390, 1)])
def test_the_page_fits_and_can_be_read(look, width, columns, scheme):
    """Nothing sticks out, panels flow, letters are 8 pixels or more, colours follow the scheme."""
    seen = look(width, scheme)
    mode = 1 if scheme == "light" else 2

    assert seen["width"] <= width
    assert seen["widest"] <= width
    assert seen["panels"] > 20
    assert seen["narrowest"] > 250
    assert seen["columns"] == columns
    assert seen["letters"] >= 8
    assert seen["ground"] == rgb(theme.THEME[theme.GROUND][mode])
    assert seen["ink"] in {rgb(theme.THEME[c][mode]) for c in (theme.INK, theme.MUTED)}
