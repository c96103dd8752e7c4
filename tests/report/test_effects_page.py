"""The documentation's page of effects."""

from __future__ import annotations

from pathlib import Path

from zfcal.model.effects import all_effects, generic_effects
from zfcal.report.effects_page import effects_page

PAGE = Path(__file__).parents[2] / "docs" / "effects.md"


def test_the_page_is_up_to_date():
    """Make it anew with `make effects-page`."""
    assert PAGE.read_text(encoding="utf-8") == effects_page()


def test_the_page_says_everything():
    """Name, sentences, source, and each parameter with its range and its meaning."""
    page = effects_page()
    for effect in (*all_effects(), *generic_effects()):
        section = page.partition(f"# `{effect.name}`\n")[2].partition("\n#")[0]
        assert effect.says in section
        assert effect.opposite in section
        assert effect.reference in section
        for own in effect.parameters:
            assert f"`{own.name}`" in section
            assert f"| {own.low:g} to {own.high:g} | {own.default:g} | {own.says} |" in section
        assert section.count("**") == 2
