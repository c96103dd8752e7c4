"""The page as text: summary, figures and tables, with nothing outside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from zfcal.artifacts.lineage import Lineage, to_json
from zfcal.report.contents import Section
from zfcal.report.figures import theme
from zfcal.report.figures.panels import Entry, Picture, entry_svg, panel_svg
from zfcal.report.intervals import interval_tables
from zfcal.report.numbers import lineage_table, tables, trials_table
from zfcal.report.summary import gaps, statements
from zfcal.report.trials_summary import gaps_of_trials, statements_of_trials
from zfcal.report.views import TrialView


def render_page(
    views: Sequence[TrialView],
    pictures: Sequence[Picture],
    lineage: Lineage,
    formats: Sequence[str] = ("png",),
    links: Sequence[str] = (),
) -> str:
    """Return the page of a trial, or of several, as HTML.

    Parameters
    ----------
    views
        At least one trial.
    pictures
        In the order in which they are shown.
    lineage
        Of the report, which stands in the page as well.
    formats
        Endings of the files that the pictures are beside the page.
    links
        Where the pages of several trials are, each its own.
    """
    content = _of_one(views[0]) if len(views) == 1 else _of_several(views, links)
    content["left_out"] = [line for view in views for line in view.left_out]
    return render(content, list(map(section_of, pictures)), lineage.as_dict(), formats)


def render(
    content: Mapping[str, Any],
    sections: Sequence[Section],
    provenance: Mapping[str, Any],
    formats: Sequence[str] = ("png",),
) -> str:
    """Return a page as HTML.

    Parameters
    ----------
    content
        ``title``, ``facts``, ``statements``, ``gaps``, ``left_out`` and ``tables``.
    sections
        Pictures, in the order in which they are shown.
    provenance
        Where the page comes from, with the ``version`` that made it; it stands in the
        page as JSON.
    formats
        As for `render_page`.
    """
    environment = Environment(
        loader=PackageLoader("zfcal.report"), autoescape=True, undefined=StrictUndefined
    )
    environment.filters["hold"] = _hold
    text = environment.get_template("page.html.j2").render(
        **content,
        sections=sections,
        formats=formats,
        version=provenance["version"],
        lineage=_embedded(provenance),
        light=_colours(1),
        dark=_colours(2),
    )
    return text.rstrip() + "\n"


def _of_one(view: TrialView) -> dict[str, Any]:
    return {
        "title": f"Trial {view.name}",
        "facts": _facts(view),
        "statements": statements(view),
        "gaps": gaps(view),
        "tables": tables(view),
    }


def _of_several(views: Sequence[TrialView], links: Sequence[str]) -> dict[str, Any]:
    arena = views[0].arena
    return {
        "title": f"{len(views)} trials in the arena {arena.name}",
        "facts": ", ".join(view.name for view in views),
        "statements": statements_of_trials(views),
        "gaps": gaps_of_trials(views),
        "tables": [trials_table(views, links), *interval_tables(views), lineage_table(views)],
    }


def _facts(view: TrialView) -> str:
    trial = view.trial
    robots = {0: "no robot", 1: "1 robot"}.get(trial.n_robots, f"{trial.n_robots} robots")
    parts = [
        f"Arena {view.arena.name}",
        f"{trial.n_fish} fish, {robots}",
        f"{view.tracked_s / 60:.1f} min of tracks at {trial.fps:g} Hz"
        if view.tracked_s
        else "no tracks",
        f"model step {trial.dt_s:g} s",
        *([f"source: {trial.source}"] if trial.source else []),
        *(["control: the fish of other trials"] if view.has_control_trials else []),
        *(["legacy scoring"] if view.scoring == "legacy" else []),
    ]
    return "; ".join(parts) + "."


def section_of(picture: Picture) -> Section:
    """Return a picture as the page shows it, its panels drawn."""
    return Section(
        name=picture.name,
        title=picture.title,
        short=picture.short,
        note=picture.note,
        panels=[
            panel_svg(panel, f"{picture.name}-{number}")
            for number, panel in enumerate(picture.panels)
        ],
        keys=[_key(entry) for entry in picture.key],
    )


def _key(entry: Entry) -> dict[str, str]:
    return {"svg": entry_svg(entry), "label": entry.label}


def _hold(text: str) -> str:
    """Keep a number on one line with its name and its unit."""
    return (
        text.replace(" = ", "\u00a0=\u00a0")
        .replace(" %", "\u00a0%")
        .replace(" ± ", "\u00a0±\u00a0")
    )


def _embedded(provenance: Mapping[str, Any]) -> str:
    """Return JSON that cannot end the element that it stands in."""
    return to_json(provenance).replace("<", "\\u003c")


def _colours(column: int) -> str:
    return " ".join(f"--{row[0]}: {row[column]};" for row in theme.THEME.values())
