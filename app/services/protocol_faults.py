"""What is wrong with a protocol, in sentences for its author: where it is and what to write.

The schema's own messages are a program's ("Input should be greater than or equal to 5"); here each
kind of them is said in words, with the line of the file where there is one.
"""

import difflib
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from app.schemas.protocol import Protocol
from app.schemas.yaml_reader import MAX_DEPTH, Place

_SHOWN = 60  # characters of what somebody wrote


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong.

    Attributes:
        place: Where, as ``tasks.0.labels``; empty for the whole.
        says: What is wrong and what to write, without the place or a full stop.
        line: Of the file, from 1, if it came from one.
    """

    place: str
    says: str
    line: int | None = None

    @property
    def sentence(self) -> str:
        """The whole of it."""
        line = "" if self.line is None else f"line {self.line}: "
        place = f"{self.place}: " if self.place else ""
        return f"{line}{place}{self.says}."


def of_schema(error: ValidationError, lines: Mapping[Place, int]) -> list[Fault]:
    """Everything the schema refuses."""
    found = error.errors(include_url=False)
    return [_fault(each, lines) for each in found if not _follows(each, found)]


def at(place: Place, says: str, lines: Mapping[Place, int]) -> Fault:
    """A fault of the rules that no schema knows."""
    return Fault(".".join(map(str, place)), says, _line(place, lines))


def of_words(content: Any, place: Place = ()) -> Iterator[tuple[Place, str]]:
    """Words that look empty, or like something they are not, wherever they stand in JSON-like data.

    Yields:
        The place of each, and what is wrong with it.
    """
    if len(place) > MAX_DEPTH:
        yield place[:3], "this is nested too deeply"
    elif isinstance(content, Mapping):
        for key, value in content.items():
            yield from of_words(value, (*place, key))
    elif isinstance(content, list | tuple):
        for index, value in enumerate(content):
            yield from of_words(value, (*place, index))
    elif isinstance(content, str):
        says = _of_text(content)
        if says is not None:
            yield place, says


def look(text: str) -> str:
    """What a text looks like to who reads it: the same for texts that nobody can tell apart."""
    return " ".join(unicodedata.normalize("NFKC", text).casefold().split())


def _of_text(text: str) -> str | None:
    for letter in text:
        category = unicodedata.category(letter)
        is_layout = letter in "\r\n\t"
        # Cs: half a letter. What turns the direction makes one text look like another.
        if (category == "Cc" and not is_layout) or category == "Cs" or letter in _TURNING:
            return f"there is an invisible control character (U+{ord(letter):04X}); leave it out"
    if text and not any(_is_seen(letter) for letter in text):
        return "this looks empty; write something, or leave the setting out"
    return None


_TURNING = "\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\ufeff"


def _is_seen(letter: str) -> bool:
    return unicodedata.category(letter) not in ("Cc", "Cf", "Zs", "Zl", "Zp", "Mn", "Me")


def _follows(error: ErrorDetails, others: list[ErrorDetails]) -> bool:
    """Whether a list is said to be too short because what is in it is wrong."""
    place = error["loc"]
    inside = (each["loc"] for each in others if len(each["loc"]) > len(place))
    return error["type"] == "too_short" and any(at[: len(place)] == place for at in inside)


def _fault(error: ErrorDetails, lines: Mapping[Place, int]) -> Fault:
    place = tuple(error["loc"])
    return Fault(".".join(map(str, place)), _says(error, place), _line(place, lines))


def _line(place: Place, lines: Mapping[Place, int]) -> int | None:
    """Of that place or, where it is missing, of what it should be in."""
    while place and place not in lines:
        place = place[:-1]
    return lines.get(place)


def _says(error: ErrorDetails, place: Place) -> str:
    limits, given, kind = error.get("ctx", {}), error["input"], error["type"]
    if kind == "value_error":
        return str(limits["error"])
    if kind == "extra_forbidden":
        return _unknown(place)
    if kind in _SAYS:
        return _SAYS[kind]
    if kind in _WITH_LIMIT:
        limit = next(iter(limits.values()))
        limit = f"{limit:g}" if isinstance(limit, float) else limit
        return _WITH_LIMIT[kind].format(_PATTERNS.get(limit, limit)) + _not(given)
    return f"write {_TYPES.get(kind, 'something else')}{_hint(given, kind)}{_not(given)}"


_SAYS = {
    "missing": "this is needed and is missing",
    "string_too_short": "write something, or leave the setting out",
}
_WITH_LIMIT = {
    "literal_error": "write one of {}",
    "greater_than_equal": "write a number of at least {}",
    "less_than_equal": "write a number of at most {}",
    "greater_than": "write a number above {}",
    "less_than": "write a number below {}",
    "string_too_long": "write at most {} characters",
    "string_pattern_mismatch": "write {}",
}
_PATTERNS = {
    r"^[a-z][a-z0-9-]{0,39}$": "a name of small letters a to z, digits and hyphens, "
    "beginning with a letter, 40 at most",
    r"^https://": "a whole address that begins with https://",
}
_TYPES = {
    "string_type": "text",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "finite_number": "a number",
    "int_parsing": "a whole number",
    "float_parsing": "a number",
    "bool_parsing": "true or false",
    "bool_type": "true or false",
    "tuple_type": "a list, such as [a, b]",
    "list_type": "a list, such as [a, b]",
    "too_short": "at least one",
    "too_long": "fewer",
    "model_type": "settings, such as {name: value}",
    "model_attributes_type": "settings, such as {name: value}",
}


def _hint(given: Any, kind: str) -> str:
    if kind == "string_type" and isinstance(given, bool | int | float):
        return " in quotes"
    if kind in ("int_type", "float_type", "bool_type") and isinstance(given, str):
        return " without quotes"
    return ""


def _not(given: Any) -> str:
    """What was written instead, cut to a length that can be read."""
    if isinstance(given, Mapping | list | tuple):
        return ""
    if given is None:
        return " (there is nothing)"
    text = str(given).lower() if isinstance(given, bool) else str(given)
    if isinstance(given, float):
        text = f"{given:g}"
    if isinstance(given, str):
        text = f"'{text}'"
    return f" (not {text if len(text) <= _SHOWN else text[:_SHOWN] + '…'})"


def _unknown(place: Place) -> str:
    """A setting that there is not, and the one that was perhaps meant."""
    known = _settings_at(Protocol, place[:-1])
    near = difflib.get_close_matches(str(place[-1]), known, n=1)
    meant = f"; did you mean '{near[0]}'?" if near else f"; there are {', '.join(known)}"
    return f"there is no such setting{meant}".removesuffix("?")


def _settings_at(part: type[BaseModel], place: Place) -> list[str]:
    for step in place:
        if isinstance(step, str):
            part = _part_of(part.model_fields[step].annotation)
    return list(part.model_fields)


def _part_of(annotation: Any) -> type[BaseModel]:
    """The part of a protocol that a field holds, or a list of them."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(
        _part_of(each) for each in annotation.__args__ if each is not type(None) and each is not ...
    )
