"""Pictures as files: PNG, SVG and PDF, for the screen or at the width of a journal's column.

At a width the letters have 7 to 8 points on paper, panels have letters in place of a common
title, and a PNG has 300 dots an inch. SVG and PDF hold their fonts, and text stays text.
"""

from __future__ import annotations

import base64
import functools
import re
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

from fontTools.subset import Options, Subsetter
from fontTools.ttLib import TTFont
from matplotlib import font_manager

from zfcal.report.figures import theme
from zfcal.report.figures.panels import Picture, compose
from zfcal.report.options import Printing

_MM_PER_IN = 25.4
_TEXT = re.compile(r"<text\b[^>]*>(.*?)</text>", re.DOTALL)


def write_printed(picture: Picture, kind: str, path: Path, printing: Printing) -> None:
    """Write a picture in one format.

    Parameters
    ----------
    picture
        With its panels and its key.
    kind
        One of `FORMATS`.
    path
        Where it goes, whatever its ending.
    printing
        Gives the width.
    """
    path.write_bytes(printed(picture, kind, width_mm=printing.width_mm))


def printed(picture: Picture, kind: str, *, width_mm: float | None = None) -> bytes:
    """Return a picture in one format; the same bytes every time.

    Parameters
    ----------
    picture, kind
        As for `write_printed`.
    width_mm
        Width on paper, in millimetres; None for the screen.
    """
    made = BytesIO()
    with theme.style(on_paper=width_mm is not None):
        width_in = None if width_mm is None else width_mm / _MM_PER_IN
        figure = compose(picture, width_in=width_in)
        dpi = theme.PNG_DPI if width_mm is None else theme.PAPER_DPI
        theme.save(figure, made, kind, dpi=dpi, said=_said_of(picture, kind))
    return _with_fonts(made.getvalue()) if kind == "svg" else made.getvalue()


def _said_of(picture: Picture, kind: str) -> dict[str, Any]:
    """Return what a file says of itself: its title and what is to be seen, but no day."""
    alt = " ".join(panel.alt for panel in picture.panels)
    if kind == "pdf":
        return {"Title": picture.title, "Subject": alt, "CreationDate": None, "Producer": None}
    if kind == "svg":
        unsaid = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        return {"Title": picture.title, "Description": alt, **unsaid}
    return {"Software": None, "Title": picture.title, "Description": alt}


def _with_fonts(svg: bytes) -> bytes:
    """Return an SVG with the letters that it uses in it: it looks alike wherever it is opened."""
    text = svg.decode("utf-8")
    used = set("".join(re.sub(r"<[^>]*>", "", found) for found in _TEXT.findall(text)))
    # What is written as an entity is one of these.
    used |= set("&<>\"'")
    faces = "".join(_faces("".join(sorted(used))))
    at = text.index(">", text.index("<svg")) + 1
    return f"{text[:at]}\n<style>{faces}</style>{text[at:]}".encode()


def _faces(letters: str) -> Iterator[str]:
    for weight in ("normal", "bold"):
        data = base64.b64encode(_subset(letters, weight)).decode("ascii")
        yield (
            f"@font-face{{font-family:'{theme.FONT}';font-weight:{weight};"
            f"src:url(data:font/woff;base64,{data})format('woff')}}"
        )


@functools.lru_cache(maxsize=32)
def _subset(letters: str, weight: str) -> bytes:
    """Return the figures' font with some letters alone."""
    wanted = font_manager.FontProperties(family=theme.FONT, weight=weight)
    font = TTFont(font_manager.findfont(wanted), recalcTimestamp=False)
    options = Options(flavor="woff", layout_features=["kern"], hinting=False)
    # The editor's own notes, of which nobody who draws letters knows.
    options.drop_tables += ["FFTM"]
    subsetter = Subsetter(options)
    subsetter.populate(text=letters)
    subsetter.subset(font)
    font.flavor = "woff"
    made = BytesIO()
    font.save(made)
    return made.getvalue()
