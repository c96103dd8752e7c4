"""What the site says of the code itself, made anew each time from what runs.

A page asks for it by a line such as ``<!-- made: schemas -->``.
"""

import json
import re
from collections.abc import Callable
from pathlib import Path

import click

REPOSITORY = Path(__file__).resolve().parents[1]


def insert(_app, _page, source):
    """Replace each request in a page by Markdown; an unknown one is a `KeyError`."""
    source[0] = re.sub(r"<!-- made: ([a-z-]+) -->", lambda found: MAKERS[found[1]](), source[0])


def schemas():
    """Return a section for each kind of file: what it is, and its fields."""
    paths = sorted((REPOSITORY / "schemas").glob("*.json"))
    return "\n".join(_schema(path.name, json.loads(path.read_text("utf-8"))) for path in paths)


def _schema(name, document):
    title = document.get("title") or name.partition(".")[0]
    said = [
        f"## {title}",
        "",
        f"`schemas/{name}`",
        "",
        document.get("description", document.get("says", "")),
        "",
    ]
    rows = list(_fields(document))
    if rows:
        said += ["| field | kind | what |", "|---|---|---|", *map(_row, rows), ""]
    return "\n".join(said)


def _fields(document):
    """Yield name, kind and description of the fields of a JSON or an Arrow schema."""
    if "columns" in document:
        for column in document["columns"]:
            yield column["name"], column["type"], column.get("says", "")
        return
    needed = document.get("required", [])
    for name, field in document.get("properties", {}).items():
        kind = _kind(field) if isinstance(field, dict) else ""
        said = field.get("description", "") if isinstance(field, dict) else ""
        yield name, kind if name in needed else f"{kind} (may be left out)".strip(), said


def _kind(field):
    if "const" in field:
        return f"`{json.dumps(field['const'])}`"
    if "enum" in field:
        return ", ".join(f"`{json.dumps(value)}`" for value in field["enum"])
    if "$ref" in field:
        return field["$ref"].rpartition("/")[2]
    kind = field.get("type", "")
    return " or ".join(kind) if isinstance(kind, list) else kind


def _row(cells):
    name, kind, said = (str(cell).replace("|", "\\|").replace("\n", " ") for cell in cells)
    return f"| `{name}` | {kind} | {said} |"


def commands():
    """Return the help of every command, as it is printed."""
    from zfcal_cli.main import group

    return "\n".join(_helps(group, "zfcal", None))


def _helps(command, words, parent):
    name = words.rpartition(" ")[2]
    settings = {"max_content_width": 96, **command.context_settings}
    context = click.Context(command, info_name=name, parent=parent, **settings)
    depth = "##" if words.count(" ") < 2 else "###"
    yield f"{depth} {words}\n\n```text\n{command.get_help(context).rstrip()}\n```\n"
    if isinstance(command, click.Group):
        for below in command.list_commands(context):
            yield from _helps(command.get_command(context, below), f"{words} {below}", context)


def errors():
    """Return a table of the errors and the exit code of each."""
    from zfcal import errors as module

    classes = [
        each
        for each in vars(module).values()
        if isinstance(each, type) and issubclass(each, module.ZfcalError)
    ]
    rows = [f"| `{each.__name__}` | {each.exit_code} | {_sentence(each)} |" for each in classes]
    return "\n".join(["| error | exit code | when |", "|---|---|---|", *rows])


def statistics():
    """Return a table of the statistics that `zfcal analyse` can count."""
    from zfcal.behaviour.features.registry import statistics as known

    rows = [
        f"| `{each.name}` | {each.label} | {each.phrase} | {each.unit or '–'} |"
        for each in known().values()
    ]
    return "\n".join(["| name | in reports | counts | unit |", "|---|---|---|---|", *rows])


def effects():
    """Return a table of the effects, each with its sentence."""
    from zfcal.model.effects import all_effects

    rows = [
        f"| [`{each.name}`](../effects.md#{each.name}) | {each.says} |" for each in all_effects()
    ]
    return "\n".join(["| name | what fish do |", "|---|---|", *rows])


def _sentence(each):
    return (each.__doc__ or "").strip().partition("\n")[0]


MAKERS: dict[str, Callable[[], str]] = {
    "commands": commands,
    "schemas": schemas,
    "errors": errors,
    "statistics": statistics,
    "effects": effects,
}
"""What a page can ask for."""
