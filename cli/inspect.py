"""`zfcal inspect`: what a file is, where it comes from and what it holds."""

from __future__ import annotations

import functools
from pathlib import Path

import click

from .options import EXISTING, PLACE, speaks
from .output import EXIT_DAMAGED, Output


@click.command("inspect")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=EXISTING)
@click.option("--png", type=PLACE, help="Draw an arena (.geojson) into this file.")
@speaks
def command(out: Output, files: tuple[Path, ...], *, png: Path | None) -> None:
    r"""Show an artifact's schema, contents and lineage.

    \b
    Example:
        zfcal inspect trial/scores/000120.parquet
        zfcal inspect trial/models/000120.toml --json
        zfcal inspect tank.geojson --png tank.png
    """
    from zfcal.artifacts.inspecting import as_lines, describe

    if png is not None and (len(files) > 1 or files[0].suffix != ".geojson"):
        raise click.UsageError("--png draws one arena: give one .geojson file.")

    def show(path: Path) -> None:
        description = describe(path)
        out.result(description, text="\n".join(as_lines(description)))
        if description["problem"]:
            out.left_out(path, f"{path}: {str(description['problem']).rstrip('.')}.")

    for path in files:
        out.attempt(functools.partial(show, path))
    if png is not None and out.exit_code != EXIT_DAMAGED:
        out.attempt(lambda: _draw(out, files[0], png))


def _draw(out: Output, path: Path, png: Path) -> None:
    from zfcal.artifacts.arenas import read_arena
    from zfcal.artifacts.atomic import write_whole
    from zfcal.report.figures.arena import draw_arena
    from zfcal.stages.events import Made

    arena = read_arena(path)
    write_whole(png, lambda part: draw_arena(arena, part))
    out.tell(Made(path=png, reason="requested"))
