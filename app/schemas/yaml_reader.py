"""YAML 1.2 as a protocol may use it: plain data with the line of every value, within bounds.

What YAML allows and authors do not mean (a key that is there twice, aliases, merges, tags, several
documents) is refused, as is what is too large or takes too long to read.

Source: YAML 1.2.2, section 10.3 ("Core Schema") for what a plain scalar is.
"""

import codecs
import io
import re
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

from ruamel.yaml import YAML, events
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.representer import SafeRepresenter
from ruamel.yaml.scanner import Scanner

from app.errors import JoymapError

MAX_BYTES = 200_000
MAX_CPU_S = 0.2
MAX_DEPTH = 20
_CHUNK = 1024  # characters; how much is read between two looks at the clock

_TOO_DEEP = "this is nested too deeply to be a protocol."

_ZEROS: dict[tuple[bool, ...], str] = {
    (False, True, False, True): "utf-16-le",
    (True, False, True, False): "utf-16-be",
    (False, True, True, True): "utf-32-le",
    (True, True, True, False): "utf-32-be",
}

Place = tuple[str | int, ...]

_NULL = re.compile(r"~|null|Null|NULL|")
_TRUE, _FALSE = re.compile(r"true|True|TRUE"), re.compile(r"false|False|FALSE")
_INT = re.compile(r"[-+]?[0-9]+")
_OCTAL, _HEX = re.compile(r"0o[0-7]+"), re.compile(r"0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_MAX_DIGITS = 18  # what fits 64 bits, and any database

# Longest first: UTF-32's mark begins like UTF-16's.
_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)


class NotReadable(JoymapError):
    """Text that is not the YAML a protocol is written in; says where and what to write."""

    status_code = 422
    kind = "bad-protocol"

    def __init__(self, sentence: str, line: int | None = None) -> None:
        """``line`` counts from 1."""
        self.says, self.line = sentence.removesuffix("."), line
        super().__init__(sentence if line is None else f"line {line}: {sentence}")


@dataclass(frozen=True)
class Document:
    """What was read.

    Attributes:
        content: Of ``dict``, ``list``, ``str``, ``int``, ``float``, ``bool`` and None.
        lines: The line, from 1, of each value (of its key, in a mapping), by its place.
    """

    content: Any
    lines: dict[Place, int]


def read(source: str | bytes) -> Document:
    """Read one document.

    Raises:
        NotReadable: If it is no YAML 1.2, or uses what a protocol has no need of.
    """
    text = source if isinstance(source, str) else decode(source)
    if len(text) > MAX_BYTES or len(text.encode(errors="replace")) > MAX_BYTES:
        raise NotReadable(f"This is longer than {MAX_BYTES // 1000} kB, which no protocol needs.")
    try:
        return _Composer(text).document()
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = error.problem or "this is not YAML"
        raise NotReadable(f"{_plain(problem)}.", None if mark is None else mark.line + 1) from error
    except (YAMLError, ValueError, RecursionError) as error:
        raise NotReadable(f"This is not YAML: {_plain(str(error))}.") from error


def write(content: Any) -> str:
    """JSON-like data as YAML that reads back the same."""
    yaml = YAML(typ="safe", pure=True)
    yaml.Representer = _Representer
    yaml.default_flow_style, yaml.sort_base_mapping_type_on_output = False, False  # type: ignore[assignment]
    yaml.width, yaml.allow_unicode = 100, True
    text = io.StringIO()
    yaml.dump(content, text)
    return text.getvalue()


def decode(source: bytes) -> str:
    """The text of a file in UTF-8, UTF-16 or UTF-32.

    Raises:
        NotReadable: If it is none of them.
    """
    if len(source) > 4 * MAX_BYTES:  # UTF-32 takes four bytes for a letter
        raise NotReadable(f"This is longer than {MAX_BYTES // 1000} kB, which no protocol needs.")
    marked = [(mark, encoding) for mark, encoding in _MARKS if source.startswith(mark)]
    # Without a mark, text that begins with ASCII shows by its zeros what it is.
    zeros = tuple(byte == 0 for byte in source[:4])
    mark, encoding = marked[0] if marked else (b"", _ZEROS.get(zeros, "utf-8"))
    try:
        return source[len(mark) :].decode(encoding)
    except UnicodeDecodeError as error:
        line = source.count(b"\n", 0, error.start) + 1
        raise NotReadable(
            "a letter here is not in UTF-8; save the file in that encoding.", line
        ) from error


class _Representer(SafeRepresenter):
    """Writes text of several lines as it is read."""

    def represent_str(self, text: str) -> Any:
        style = "|" if "\n" in text and "\r" not in text else None
        return self.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Representer.add_representer(str, _Representer.represent_str)


class _Clock(io.StringIO):
    """Text that stops being read once reading it has taken too long."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._until_s = time.thread_time() + MAX_CPU_S

    def read(self, size: int | None = -1, /) -> str:
        self.look()
        return super().read(_CHUNK if size is None or size < 0 else min(size, _CHUNK))

    def look(self) -> None:
        if time.thread_time() > self._until_s:
            raise NotReadable("This takes too long to read; write it more simply.")


class _BoundedScanner(Scanner):
    """Stops before brackets within brackets, or a thousand tokens in a line, cost much."""

    def __init__(self, clock: _Clock, loader: YAML) -> None:
        self._clock = clock
        super().__init__(loader)

    def fetch_more_tokens(self) -> Any:
        self._clock.look()
        if self.flow_level > MAX_DEPTH:
            raise NotReadable(_TOO_DEEP, self.reader.get_mark().line + 1)
        return super().fetch_more_tokens()


class _Composer:
    """Makes data of the parser's events, one level of nesting a call."""

    def __init__(self, text: str) -> None:
        clock = _Clock(text)
        yaml = YAML(typ="safe", pure=True)
        yaml.Scanner = partial(_BoundedScanner, clock)
        self._events: Iterator[Any] = yaml.parse(clock)
        self._lines: dict[Place, int] = {}

    def document(self) -> Document:
        content, seen = None, 0
        for event in self._events:
            if isinstance(event, events.DocumentStartEvent):
                seen += 1
                if seen > 1:
                    raise NotReadable(
                        "a second document begins here; a file has one.", _line(event)
                    )
                if event.version is not None and tuple(event.version) != (1, 2):
                    raise NotReadable("write YAML 1.2, without a %YAML line.", _line(event))
                if event.tags:
                    raise NotReadable("%TAG is not used in protocols; leave it out.", _line(event))
                content = self._value(next(self._events), (), 0)
        return Document(content, self._lines)

    def _value(self, event: Any, place: Place, depth: int) -> Any:
        self._lines.setdefault(place, _line(event))
        self._refuse_what_is_not_meant(event)
        if depth > MAX_DEPTH:
            raise NotReadable(_TOO_DEEP, _line(event))
        if isinstance(event, events.ScalarEvent):
            return _scalar(event)
        if isinstance(event, events.SequenceStartEvent):
            return self._sequence(place, depth)
        return self._mapping(place, depth)

    def _sequence(self, place: Place, depth: int) -> list[Any]:
        found: list[Any] = []
        while not isinstance(event := next(self._events), events.SequenceEndEvent):
            found.append(self._value(event, (*place, len(found)), depth + 1))
        return found

    def _mapping(self, place: Place, depth: int) -> dict[str, Any]:
        found: dict[str, Any] = {}
        while not isinstance(event := next(self._events), events.MappingEndEvent):
            key = self._key(event)
            here = (*place, key)
            if key in found:
                raise NotReadable(
                    f"'{key}' is there already, in line {self._lines[here]}; leave one out.",
                    _line(event),
                )
            self._lines[here] = _line(event)
            found[key] = self._value(next(self._events), here, depth + 1)
        return found

    def _key(self, event: Any) -> str:
        self._refuse_what_is_not_meant(event)
        if not isinstance(event, events.ScalarEvent):
            raise NotReadable("a setting's name must be a word.", _line(event))
        if event.value == "<<" and event.implicit[0]:
            raise NotReadable(
                "'<<' is not used in protocols; write the settings out.", _line(event)
            )
        key = _scalar(event)
        if not isinstance(key, str):
            raise NotReadable(
                f"a setting's name must be a word, not {event.value or 'nothing'}.", _line(event)
            )
        return key

    def _refuse_what_is_not_meant(self, event: Any) -> None:
        if isinstance(event, events.AliasEvent):
            raise NotReadable(
                f"'*{event.anchor}' is an alias; write what it stands for.", _line(event)
            )
        if getattr(event, "anchor", None) is not None:
            raise NotReadable(
                f"'&{event.anchor}' names this for aliases, which are not used in protocols; "
                "leave it out.",
                _line(event),
            )
        # A mapping or a sequence says itself what it is; so does a scalar, by how it is written.
        if getattr(event, "ctag", None) is not None and str(event.ctag) not in ("", "None"):
            raise NotReadable(
                f"the tag '{event.ctag}' is not used in protocols; leave it out.", _line(event)
            )


def _scalar(event: Any) -> Any:
    """What a scalar means in the core schema; whatever is quoted is text."""
    text = _joined(str(event.value), _line(event))
    if not event.implicit[0]:
        return text
    for pattern, value in ((_NULL, None), (_TRUE, True), (_FALSE, False)):
        if pattern.fullmatch(text):
            return value
    return _number(text, _line(event))


def _joined(text: str, line: int) -> str:
    """With letters whole that JSON escapes in two halves."""
    try:
        return text.encode("utf-16", "surrogatepass").decode("utf-16")
    except UnicodeDecodeError as error:
        raise NotReadable("half a letter stands here alone; leave it out.", line) from error


def _number(text: str, line: int) -> int | float | str:
    """A plain scalar as a number, or as the text it is if it is none."""
    if _NOT_FINITE.fullmatch(text):
        raise NotReadable(f"'{text}' is not a number that a protocol can use.", line)
    for pattern, base in ((_INT, 10), (_OCTAL, 8), (_HEX, 16)):
        if pattern.fullmatch(text):
            if len(text) > _MAX_DIGITS:
                raise NotReadable("this number has too many digits.", line)
            return int(text, base)
    if _FLOAT.fullmatch(text):
        if len(text) > 2 * _MAX_DIGITS or abs(float(text)) > 10.0**_MAX_DIGITS:
            raise NotReadable("this number is too large, or has too many digits.", line)
        return float(text)
    return text


def _line(event: Any) -> int:
    return int(event.start_mark.line) + 1


def _plain(problem: str) -> str:
    return " ".join(problem.split())[:200].removesuffix(".")
