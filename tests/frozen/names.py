"""The names that others rely on, as today's code has them, and the file of those that are frozen.

Programs, scripts and stored data know them: a column, a key, an option, a setting. What is in
``names.json`` has to stay; what is new has to be put there, on purpose, by::

    python -m tests.frozen.names --add
"""

import argparse
import json
import re
import sqlite3
import sys
import tempfile
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from fastapi.routing import APIWebSocketRoute
from pydantic import BaseModel, TypeAdapter
from safetensors.numpy import load_file

from app.errors import JoymapError
from app.routers import ROUTERS  # which loads every refusal, too
from app.schemas.messages import PAGE_MESSAGE, SentenceOut, StatusOut
from app.schemas.replay import REPLAY_MESSAGE, ReplayStatusOut
from app.settings import ROOT, STATIC_DIR, Settings
from models.checkpoints import PRETRAINED
from tests.frozen import learning, made, today
from tests.frozen.exported import FORMATS, Export
from tests.frozen.schemas import names_in, operations
from tests.frozen.today import TodaysServer, joymap

FILE = made.HERE / "names.json"

Names = dict[str, dict[str, list[str]]]


def frozen() -> Names:
    """Names by what they are of, such as ``export``, and by where, such as the table."""
    found: Names = json.loads(FILE.read_text())
    return found


def write(names: Names) -> None:
    FILE.write_text(json.dumps(names, indent=1, sort_keys=True, ensure_ascii=False) + "\n")


def missing(wanted: Names, there: Names) -> list[str]:
    """Names of the first that the second does not have, a line for each."""
    return [
        f"{kind}: {place}: {name}"
        for kind, places in wanted.items()
        for place, names in places.items()
        for name in names
        if name not in there.get(kind, {}).get(place, [])
    ]


def joined(one: Names, other: Names) -> Names:
    """All names of both."""
    return {
        kind: {
            place: sorted({*one.get(kind, {}).get(place, []), *other.get(kind, {}).get(place, [])})
            for place in {*one.get(kind, {}), *other.get(kind, {})}
        }
        for kind in {*one, *other}
    }


def collect(
    export: Export,
    figures: Path,
    simulation: Path,
    server: TodaysServer,
    told: list[dict[str, Any]],
    scratch: Path,
) -> Names:
    """The names that today's code uses.

    Args:
        export: Made of the old study.
        figures: Made of the old export.
        simulation: The old run's folder, gone on with.
        server: That runs on the old data, on which there was a drive.
        told: What the page heard of that drive.
        scratch: An empty folder.
    """
    found: dict[str, dict[str, Iterator[str] | list[str]]] = {
        "browser storage": {"keys": _storage_keys()},
        "checkpoint": dict(_checkpoints(scratch)),
        "command": dict(_commands()),
        "console": {"serve": _links(server.server.log())},
        "database": dict(_tables(server.server.data_dir / "joymap.db")),
        "environment": {"variables": _settings()},
        "export": dict(_export(export)),
        "figures": {
            "files": [path.name for path in figures.iterdir()],
            **{path.name: _columns(path) for path in figures.glob("*.csv")},
            "figures.json": _keys(json.loads((figures / "figures.json").read_text())),
        },
        "file": {"data directory": _files(server.server.data_dir)},
        "http": {
            **dict(_by_operation(server.get("openapi.json"))),
            "cookies": list(server.office.cookies),
        },
        "refusal": {"kinds": [each.kind for each in _subclasses(JoymapError)]},
        "simulation": dict(_simulation(simulation)),
        "websocket": dict(_messages(told)),
    }
    return {
        kind: {place: sorted(set(names)) for place, names in places.items()}
        for kind, places in found.items()
    }


def _storage_keys() -> list[str]:
    """What the pages' keys in the browser's storage begin with."""
    texts = [path.read_text() for path in STATIC_DIR.rglob("*.js")]
    return [key for text in texts for key in re.findall(r"""['"`](joymap [a-z]+) """, text)]


def _checkpoints(scratch: Path) -> Iterator[tuple[str, list[str]]]:
    strategies = ("all-priors", "task-space")
    stems = learning.train_as_worker(scratch, learning.TASKS[1], strategies, 1, 2)
    affine = learning.fit_as_simulation(learning.TASKS[0], "manual-align", 2)
    yield "manual-align", list(affine.to_arrays())
    for strategy, stem in stems.items():
        yield strategy, list(load_file(stem.with_suffix(".safetensors")))
        about = json.loads(stem.with_suffix(".json").read_text())
        yield f"description of {strategy}", _keys(about)
    for form in ("", "-linear", "-principal", "-warped"):
        stem = PRETRAINED / f"plane{form}"
        yield f"controller{form}", list(load_file(stem.with_suffix(".safetensors")))
    yield "description of a controller", _keys(json.loads((PRETRAINED / "plane.json").read_text()))


def _commands() -> Iterator[tuple[str, list[str]]]:
    """Commands, their options, and the names of what they take without one."""
    found = re.search(r"\{([a-z,-]+)\}", joymap("--help").out)
    assert found is not None
    for command in found[1].split(","):
        says = joymap(command, "--help", COLUMNS="200").out
        yield (
            command,
            [
                *re.findall(r"^  (?:-\w(?: \S+)?, )?(--[a-z-]+)", says, re.MULTILINE),
                *re.findall(r", (--[a-z-]+)", says),
                *re.findall(r"^  ([a-z]+) ", says, re.MULTILINE),
                *(
                    f"{option} = {word}"
                    for option, words in re.findall(r"(--[a-z-]+) \{([a-z_,-]+)\}", says)
                    for word in words.split(",")
                ),
            ],
        )


def _links(log: str) -> list[str]:
    """The lines by which programs find a server that has started."""
    lines = re.findall(r"^(?:  \w+ +|Joymap is ready on )http://.*$", log, re.MULTILINE)
    lines = [re.sub(r"http://[\w.:]+", "URL", line) for line in lines]
    return [re.sub(r"(?<=\w) +(?=\S)", " ", re.sub(r"/[\w-]{20,}", "/TOKEN", e)) for e in lines]


def _tables(database: Path) -> Iterator[tuple[str, list[str]]]:
    with closing(sqlite3.connect(database)) as db:
        tables = db.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()
        for (table,) in tables:
            if not table.startswith("sqlite_"):
                columns = db.execute("SELECT name FROM pragma_table_info(?)", (table,))
                yield table, [name for (name,) in columns]


def _settings() -> list[str]:
    sources = [path for folder in ("app", "models") for path in (ROOT / folder).rglob("*.py")]
    named = re.findall(r"\bJOYMAP_[A-Z_]*[A-Z]\b", "".join(path.read_text() for path in sources))
    return [*named, *(f"JOYMAP_{name.upper()}" for name in Settings.model_fields)]


def _export(export: Export) -> Iterator[tuple[str, list[str]]]:
    participant = r"#\d+"
    yield (
        "files",
        [
            re.sub(participant, "PARTICIPANT", name.replace(export.slug, "TITLE"))
            for name in export.files
        ],
    )
    for table in export.tables:
        columns = [export.columns(table, kind) for kind in FORMATS]
        yield f"table {table}", [name for name in columns[0] if all(name in e for e in columns)]
    yield "tensors", [name for tensors in export.tensors().values() for name in tensors]
    about = export.about()
    yield "dataset_description.json", _keys(about["dataset_description.json"], depth=1)
    yield "codebook.json", _keys(next(iter(about["codebook.json"].values())), depth=1)
    column = next(iter(about["codebook.json"]["drives"]["columns"].values()))
    yield "codebook.json column", list(column)
    for name, content in export.lerobot().items():
        yield name, _keys(content[0] if isinstance(content, list) else content)


def _simulation(folder: Path) -> Iterator[tuple[str, list[str]]]:
    yield "files", [path.name for path in folder.iterdir()]
    for path in folder.glob("*.csv"):
        yield path.name, _columns(path)
    for name in ("run.json", "all.json"):
        yield name, _keys(json.loads((folder / name).read_text()))
    with (folder / "rows.jsonl").open() as lines:
        yield "rows.jsonl", _keys(json.loads(next(lines)))


def _files(data_dir: Path) -> list[str]:
    paths = [
        path.relative_to(data_dir).as_posix() for path in data_dir.rglob("*") if path.is_file()
    ]
    names = {re.sub(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}-\d+", "JOB", e) for e in paths}
    return sorted(names - {"server.log"})  # which the tests write


def _by_operation(description: dict[str, Any]) -> Iterator[tuple[str, list[str]]]:
    places: dict[str, list[str]] = {}
    for name in operations(description):
        method, path, *rest = name.split(" ", 2)
        places.setdefault(f"{method} {path}", []).extend(rest)
    yield from places.items()


def _messages(told: list[dict[str, Any]]) -> Iterator[tuple[str, list[str]]]:
    for name, kind in (
        ("live, to the server", PAGE_MESSAGE),
        ("live, status", StatusOut),
        ("live, error", SentenceOut),
        ("replay, to the server", REPLAY_MESSAGE),
        ("replay, status", ReplayStatusOut),
    ):
        yield name, list(_message(kind))
    routes = [route for router in ROUTERS for route in router.routes]
    yield "addresses", [each.path for each in routes if isinstance(each, APIWebSocketRoute)]
    yield "live, as heard", [key for message in told for key in _keys(message)]


def _message(kind: TypeAdapter[Any] | type[BaseModel]) -> Iterator[str]:
    schema = kind.json_schema() if isinstance(kind, TypeAdapter) else kind.model_json_schema()
    shared = schema.get("$defs", {})
    for each in schema.get("oneOf", [schema]):
        of = names_in(each, shared)
        names = list(of)
        types = [name.removeprefix("type = ") for name in names if name.startswith("type = ")]
        yield from (f"{types[0]}: {name}" for name in names)


def _keys(content: Any, depth: int = 9, at: str = "") -> list[str]:
    """The keys of JSON with their paths; of a list those of its first element."""
    if isinstance(content, list):
        return _keys(content[0], depth, f"{at}[]") if content else []
    if not isinstance(content, dict) or not depth:
        return []
    found = []
    for key, value in content.items():
        inside = f"{at}.{key}" if at else key
        found += [inside, *_keys(value, depth - 1, inside)]
    return found


def _columns(path: Path) -> list[str]:
    with path.open() as file:
        return file.readline().strip().split(",")


def _subclasses(kind: type[JoymapError]) -> Iterator[type[JoymapError]]:
    yield kind
    for each in kind.__subclasses__():
        yield from _subclasses(each)


def names_now(folder: Path) -> Names:
    """Those of today's code, for which everything old is gone through in an empty folder."""
    old = today.old_answers()
    data_dir = today.unpack_data(folder / "data")
    commands = [
        today.migrate(data_dir),
        today.export(data_dir, old["study"], folder / "export.zip"),
        today.draw_figures(folder / "figures"),
        today.go_on_simulating(folder / "simulation"),
    ]
    for command in commands:
        assert command.code == 0, command.err
    with today.todays_server(data_dir) as server:
        told = server.drive(server.visit(today.half_way(old)))
        (folder / "alignments").mkdir()
        return collect(
            Export(folder / "export.zip"),
            folder / "figures",
            folder / "simulation",
            server,
            told,
            folder / "alignments",
        )


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.frozen.names", description=__doc__)
    parser.add_argument("--add", action="store_true", help="put what is new into names.json")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        now = names_now(Path(folder))
    kept = frozen() if FILE.exists() else {}
    new, gone = missing(now, kept), missing(kept, now)
    for line in new:
        print(f"new: {line}")
    for line in gone:
        print(f"gone: {line}", file=sys.stderr)
    if chosen.add:
        write(joined(kept, now))
    return 1 if gone or (new and not chosen.add) else 0


if __name__ == "__main__":
    sys.exit(main())
