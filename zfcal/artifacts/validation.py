"""Documents that people write, checked at the door against the schemas.

A message says what is wrong, where (a dotted path), what was expected and what
was got. What the values mean together is checked where they are used.
"""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator, TypeChecker
from jsonschema.exceptions import ValidationError, best_match
from jsonschema.validators import extend
from referencing import Registry, Resource

from zfcal.artifacts.reading.contents import read_bytes
from zfcal.artifacts.reading.parsing import json_of, toml_of
from zfcal.errors import DamagedError, InputError, SchemaError

_TYPE_NAMES = {
    "object": "a table",
    "array": "a list",
    "string": "text in quotes",
    "number": "a number",
    "integer": "a whole number",
    "boolean": "true or false",
    "null": "null",
}
_LONGEST_SHOWN = 60


def read_toml(path: Path) -> dict[str, Any]:
    """Return a TOML file as a dictionary.

    Raises
    ------
    InputError
        It is missing or cannot be opened.
    DamagedError
        It is empty or not TOML, and where.
    """
    try:
        return toml_of(_text_of(path))
    except ValueError as error:
        raise DamagedError(
            f"{path}: is not valid TOML: {_lower(str(error))}.",
            hint="Text stands in quotes, true and false in small letters, one key a line.",
        ) from error


def read_json(path: Path) -> dict[str, Any]:
    """Return a JSON file whose top is an object; NaN and Infinity are errors.

    Raises
    ------
    InputError
        It is missing or cannot be opened.
    DamagedError
        It is empty or not JSON, and where, or holds something else than an object.
    """
    try:
        document = json_of(_text_of(path))
    except ValueError as error:
        raise DamagedError(
            f"{path}: is not valid JSON: {_lower(str(error))}.",
            hint="Copy the file again, or open it at that line: a comma or a bracket is missing.",
        ) from error
    if not isinstance(document, dict):
        raise DamagedError(f"{path}: expected an object in braces, got {_shown(document)}.")
    return document


@contextmanager
def written_by_people() -> Iterator[None]:
    """Turn damage into a mistake in a file that people edit: it stops the command."""
    try:
        yield
    except DamagedError as error:
        raise InputError(str(error), hint=error.hint) from error


def check(document: Mapping[str, Any], schema: str, where: Path | str) -> None:
    """Check a document against one of the JSON schemas.

    Parameters
    ----------
    document
        What a TOML or JSON file holds.
    schema
        Its name without version, such as ``trial``.
    where
        Its file, for the message.

    Raises
    ------
    SchemaError
        It says that it has another schema, or another version.
    InputError
        Anything else is wrong: the most telling of what is, and how much more.
    """
    wanted = _schema(schema)["properties"].get("schema", {}).get("const")
    found = document.get("schema", wanted)
    if wanted is not None and found != wanted:
        raise SchemaError(where, found=str(found), wanted=wanted)
    errors = list(_validator(schema).iter_errors(document))
    if errors:
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        message, hint = _explain(_most_telling(errors))
        raise InputError(f"{where}: {message}{more}.", hint=hint)


def descriptions_of(schema: str, part: str = "") -> dict[str, str]:
    """Return what a JSON schema says of each key, of the document or of a part under ``$defs``."""
    whole = _schema(schema)
    properties = (whole["$defs"][part] if part else whole)["properties"]
    return {key: item.get("description", "") for key, item in properties.items()}


def nearest(word: str, known: Iterable[str]) -> str:
    """Return ``Did you mean 'x'? `` if a known word is near, and nothing otherwise."""
    close = difflib.get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f"Did you mean {close[0]!r}? " if close else ""


def _is_whole(_: TypeChecker, value: object) -> bool:
    """Return whether a value is a whole number and written as one: 3.0 and 1e308 are none."""
    return isinstance(value, int) and not isinstance(value, bool)


_Validator = extend(  # type: ignore[no-untyped-call] # jsonschema states no types here
    Draft202012Validator,
    type_checker=Draft202012Validator.TYPE_CHECKER.redefine("integer", _is_whole),
)


@cache
def _schemas() -> dict[str, Any]:
    """Return the JSON schemas by their ``$id``."""
    texts = (
        file.read_text(encoding="utf-8")
        for file in files("zfcal.schemas").iterdir()
        if file.name.endswith(".schema.json")
    )
    return {document["$id"]: document for document in map(json.loads, texts)}


def _schema(name: str) -> Any:
    return next(item for key, item in _schemas().items() if key.split(":")[2] == name)


@cache
def _validator(schema: str) -> Draft202012Validator:
    registry: Registry[Any] = Registry().with_resources(
        [(key, Resource.from_contents(document)) for key, document in _schemas().items()]
    )
    return _Validator(_schema(schema), registry=registry)


def _text_of(path: Path) -> str:
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise DamagedError(
            f"{path}: is no UTF-8 text (byte {error.start}).",
            hint="Save it as UTF-8, or copy the right file there.",
        ) from error
    if not text.strip("\0 \t\r\n"):
        raise DamagedError(f"{path}: the file is empty.", hint="Copy it again, or make it again.")
    return text


def _most_telling(errors: list[ValidationError]) -> ValidationError:
    """Prefer a key that nobody knows: a misspelt key is missing as well, and that is the cause."""
    for error in errors:
        if error.validator == "additionalProperties":
            return error
    chosen = best_match(errors)
    return chosen if chosen is not None else errors[0]


def _explain(error: ValidationError) -> tuple[str, str]:
    place = _dotted(error)
    expected = _EXPLANATIONS.get(str(error.validator), _other)(error)
    if error.validator == "additionalProperties":
        return _unknown_key(error, place)
    if error.validator == "required":
        return _missing_key(error, place)
    message = f"{place} must be {expected}, got {_shown(error.instance)}"
    return message, _near_value(error) + _description(error)


def _near_value(error: ValidationError) -> str:
    """Return which of the values that may stand there is near the one that does."""
    if error.validator != "enum" or not isinstance(error.instance, str):
        return ""
    return nearest(error.instance, [each for each in _values(error) if isinstance(each, str)])


def _unknown_key(error: ValidationError, place: str) -> tuple[str, str]:
    schema: Any = error.schema
    instance: Any = error.instance
    known = schema.get("properties", {})
    patterns = schema.get("patternProperties", {})
    key = next(
        key
        for key in instance
        if key not in known and not any(re.search(pattern, key) for pattern in patterns)
    )
    inside = f" in {place}" if error.absolute_path else ""
    allowed = f"Known keys{inside}: {', '.join(known)}."
    return f"unknown key {key!r}{inside}", nearest(key, known) + allowed


def _missing_key(error: ValidationError, place: str) -> tuple[str, str]:
    schema: Any = error.schema
    wanted: Any = error.validator_value
    instance: Any = error.instance
    key = next(key for key in wanted if key not in instance)
    inside = f" in {place}" if error.absolute_path else ""
    says = schema.get("properties", {}).get(key, {}).get("description", "")
    return f"{key!r} is missing{inside}", f"{key}: {says}" if says else ""


def _dotted(error: ValidationError) -> str:
    text = ""
    for step in error.absolute_path:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else str(step)
    return text or "the document"


def _description(error: ValidationError) -> str:
    says = error.schema.get("description", "") if isinstance(error.schema, Mapping) else ""
    return f"{_dotted(error)}: {says}" if says else ""


def _type(error: ValidationError) -> str:
    kinds: Any = error.validator_value
    kinds = [kinds] if isinstance(kinds, str) else kinds
    return " or ".join(_TYPE_NAMES[kind] for kind in kinds)


def _values(error: ValidationError) -> Iterable[object]:
    values: Any = error.validator_value
    return list(values)


def _known(error: ValidationError) -> str:
    values = ", ".join(map(_shown, _values(error)))
    return f"one of {values}" if ", " in values else values


def _other(error: ValidationError) -> str:
    return f"such that {error.validator} {_shown(error.validator_value)} holds"


_EXPLANATIONS: dict[str, Callable[[ValidationError], str]] = {
    "type": _type,
    "const": lambda error: _shown(error.validator_value),
    "enum": _known,
    "minimum": lambda error: f"at least {error.validator_value}",
    "maximum": lambda error: f"at most {error.validator_value}",
    "exclusiveMinimum": lambda error: f"more than {error.validator_value}",
    "minLength": lambda _: "a text that is not empty",
    "minItems": lambda error: f"a list of at least {error.validator_value}",
    "maxItems": lambda error: f"a list of at most {error.validator_value}",
    "minProperties": lambda error: f"a table with at least {error.validator_value} key",
    "uniqueItems": lambda _: "a list without repetition",
    "pattern": lambda error: f"text of the form {error.validator_value}",
}


def _shown(value: object) -> str:
    if isinstance(value, str | int | float | bool | list | dict) or value is None:
        text = json.dumps(value, default=str)
    else:
        text = str(value)
    return text if len(text) <= _LONGEST_SHOWN else text[:_LONGEST_SHOWN] + " ..."


def _lower(text: str) -> str:
    """Return a sentence as part of another one; a word such as NaN stays as it is."""
    text = text.strip().rstrip(".")
    first = text.partition(" ")[0]
    return text[:1].lower() + text[1:] if first[1:].islower() else text
