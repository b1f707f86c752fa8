"""Every column of every table of an export: its name, type, unit, meaning and levels."""

from dataclasses import dataclass
from typing import Any

from app import texts
from models.strategies import STRATEGIES
from models.tasks import TASKS

_JOINTS, _LATENTS, _XYZ, _WXYZ = range(1, 8), range(1, 3), "xyz", "wxyz"
# The most beads that any task has.
BEADS = max(task.props.beads.count for task in TASKS.values() if task.props.beads is not None)


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        name: As in the files.
        kind: "text", "time", "integer", "number" or "boolean".
        unit: Of a number, or how a time is written; "" if there is none.
        says: What it is.
        levels: All that it can hold, with what that means; empty: anything of its kind.
    """

    name: str
    kind: str
    unit: str
    says: str
    levels: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Table:
    """A table of an export.

    Attributes:
        row: What one row of it is.
        columns: In order.
    """

    row: str
    columns: tuple[Column, ...]


def _text(name: str, says: str, **levels: str) -> Column:
    return Column(name, "text", "", says, tuple(levels.items()))


def _time(name: str, says: str) -> Column:
    return Column(name, "time", "UTC, ISO 8601", says)


def _integer(name: str, says: str, unit: str = "") -> Column:
    return Column(name, "integer", unit, says)


def _number(name: str, unit: str, says: str) -> Column:
    return Column(name, "number", unit, says)


def _boolean(name: str, says: str) -> Column:
    return Column(name, "boolean", "", says, (("true", "yes"), ("false", "no")))


_WHO = _text("participant", "pseudonym of the participant, made for this export")
_TASK = Column(
    "task", "text", "", "the robot task", tuple((name, texts.title_of(name)) for name in TASKS)
)
_STRATEGY = Column(
    "strategy",
    "text",
    "",
    "how the alignment was come by",
    tuple((name, texts.STRATEGIES[name]) for name in STRATEGIES),
)
_DRIVE = _text("drive", "pseudonym of the drive")
_WAY = _integer("way", "which way of steering it is about, from 1; empty: none in particular")
_TICK = (
    _WHO,
    _DRIVE,
    _TASK,
    _STRATEGY,
    _text("step", "the key of the protocol's step"),
    _integer("tick", "the number of the tick in its drive, from 0"),
)

# In the order of app.storage.ticks.COLUMNS.
SAMPLE_COLUMNS = (
    _number("monotonic_s", "s", "the server's monotonic clock"),
    _number("raw_x", "1", "stick as the page sent it, right is positive, in [-1, 1]"),
    _number("raw_y", "1", "stick as the page sent it, up is positive, in [-1, 1]"),
    _number("h_x", "1", "human input h: the stick after the filter, to the right, in [-1, 1]"),
    _number("h_y", "1", "human input h: the stick after the filter, up, in [-1, 1]"),
    *(_number(f"z_{i}", "1", f"latent action z, component {i}") for i in _LATENTS),
    *(_number(f"a_{j}", "rad/s", f"action a: velocity asked of joint {j}") for j in _JOINTS),
    *(_number(f"q_{j}", "rad", f"position of joint {j}") for j in _JOINTS),
    *(_number(f"hand_{x}", "m", f"position of the hand along the base's {x}") for x in _XYZ),
    *(_number(f"hand_q{i}", "1", f"orientation of the hand: unit quaternion, {i}") for i in _WXYZ),
    Column(
        "hold",
        "integer",
        "",
        "why the arm did not follow the stick",
        (
            ("0", "it followed"),
            ("1", "the stick was released"),
            ("2", "the page was silent"),
            ("3", "the edge of the workspace"),
            ("4", "the arm moved home"),
            ("5", "the arm moved by itself"),
        ),
    ),
    Column(
        "touching",
        "integer",
        "",
        "whether arm or hand touch the obstacle; empty: not recorded",
        (("0", "no"), ("1", "yes")),
    ),
)
# In the order of a row of props.
CUP_COLUMNS = (
    *(_number(f"cup_{x}", "m", f"position of the cup along the base's {x}") for x in _XYZ),
    *(_number(f"cup_q{i}", "1", f"orientation of the cup: unit quaternion, {i}") for i in _WXYZ),
)
BEAD_COLUMNS = tuple(
    _number(f"bead_{k}_{x}", "m", f"position of bead {k} along the base's {x}; empty: no beads")
    for k in range(1, BEADS + 1)
    for x in _XYZ
)
# The fields of app.analysis.measures.Measures.
MEASURES = (
    _number("completion_time_s", "s", "from the first tick to the end of the last"),
    _number("path_length_m", "m", "sum of the hand's steps from tick to tick"),
    _number("undo_share", "1", "share of the pushed time with the stick turned against its past"),
    _number("idle_time_s", "s", "time with the stick at rest"),
    _number("evenness", "1", "how evenly the stick's eight directions were used, from 0 to 1"),
    _integer("touches", "times the arm came to touch the obstacle; empty: there is none"),
    _integer("spills", "beads beside cup and bowls, over all fillings; empty: no beads"),
    _text("counts", "what the task itself counted at the end, JSON"),
    _boolean("is_success", "whether the task was achieved; empty: it has no goal, or was cut off"),
)

TABLES: dict[str, Table] = {
    "participants": Table(
        "somebody enrolled who has not withdrawn",
        (
            _WHO,
            _text(
                "state",
                "how far they are",
                active="takes part",
                completed="did everything",
                abandoned="silent for so long that their place was freed",
            ),
            _text("excluded", "why their data are to be left out; empty: they are not"),
            _integer("protocol_version", "the version of the protocol they take part under"),
            _integer("cell", "which of the design's orders they got, from 0"),
            _text("order", "the strategies in their order, joined by >"),
            _text("step", "the key of the protocol's step they are on"),
            _integer("place", "the number of that step, from 0"),
            _time("enrolled_at", "when they were enrolled"),
            _time("ended_at", "when they had done everything; empty: not yet"),
            _text("stick_settings", "how their stick was set, JSON; empty: as it comes"),
        ),
    ),
    "consents": Table(
        "a consent given",
        (
            _WHO,
            _time("agreed_at", "when they agreed"),
            _integer("protocol_version", "the version whose text they agreed to"),
            _text("text_version", "names the text exactly: the first half of its SHA-256"),
        ),
    ),
    "events": Table(
        "something a participant did",
        (
            _WHO,
            _text("event", "the key of the step they left; or stick, moved-cell"),
            _time("at", "when, by the server's clock"),
            _text("detail", "what was kept with it, JSON"),
        ),
    ),
    "queries": Table(
        "a move drawn for a participant; those past the labels wanted may never have been shown",
        (
            _WHO,
            _text("query", "pseudonym of the query"),
            _TASK,
            _integer("position", "the order of asking, from 1"),
            _text("repeats", "the query that it asks once more; empty: it is new"),
            *(_number(f"s_{j}", "rad", f"state s: joint {j} before the move") for j in _JOINTS),
            *(_number(f"z_{i}", "1", f"latent action z, component {i}, held") for i in _LATENTS),
            *(_number(f"s_star_{j}", "rad", f"next state s*: joint {j} 0.1 s on") for j in _JOINTS),
            _text("hand_path", "the hand during the move as shown, [[x, y, z], …] in m, JSON"),
        ),
    ),
    "answers": Table(
        "an answer given, also those given anew later",
        (
            _WHO,
            _text("query", "pseudonym of the query"),
            _TASK,
            _integer("position", "the query's place in the order of asking, from 1"),
            _number("h_x", "1", "stick to the right, in [-1, 1]; empty: they could not say"),
            _number("h_y", "1", "stick up, in [-1, 1]; empty: they could not say"),
            _number(
                "thinking_time_s",
                "s",
                "from the question to the answer, by the page's clock; 86400: a day or longer",
            ),
            _time("answered_at", "when, by the server's clock"),
            _boolean("counts", "whether it is the last one given for its query"),
        ),
    ),
    "trainings": Table(
        "a training of a participant's alignments",
        (
            _WHO,
            _text("training", "pseudonym of the training"),
            _TASK,
            _text(
                "state",
                "how far it is",
                queued="waits",
                running="runs",
                succeeded="gave alignments",
                failed="gave none",
            ),
            _integer("attempts", "how often a worker began it"),
            _number("training_s", "s", "how long it took"),
            _text(
                "curves",
                "by strategy, [[step of the optimiser, supervised loss], …], JSON; "
                "empty for what is not learned step by step",
            ),
            _text("data_hash", "SHA-256 of all that it learned from"),
            _time("queued_at", "when it was wanted"),
            _time("ended_at", "when it ended; empty: not yet"),
        ),
    ),
    "alignments": Table(
        "an alignment learned",
        (
            _WHO,
            _text("alignment", "pseudonym of the alignment"),
            _text("training", "pseudonym of the training that gave it"),
            _TASK,
            _STRATEGY,
            _text("settings", "of the learning, JSON"),
            _text("data_hash", "SHA-256 of all that it was learned from"),
            _text("controller_hash", "of the controller it was learned for"),
            _text("weights_sha256", "SHA-256 of its weights"),
            _text("code_version", "of the program that learned it"),
            _time("trained_at", "when"),
        ),
    ),
    "drives": Table(
        "a drive, with its measures; without ticks they are empty",
        (
            _WHO,
            _DRIVE,
            _TASK,
            _text("step", "the key of the protocol's step"),
            _WAY,
            _STRATEGY,
            _text("alignment", "pseudonym of the alignment driven with; empty: none was needed"),
            _time("started_at", "when it began, by the server's clock"),
            _time("ended_at", "when it ended; empty: not yet"),
            Column(
                "end",
                "text",
                "",
                "how it ended; empty: not yet",
                (
                    ("done", "the attempt was over"),
                    ("given up", "by the participant"),
                    ("time limit", "the protocol's"),
                    ("switched", "to another strategy"),
                    ("left", "the page did not come back"),
                    ("server stopped", "and cut it off"),
                ),
            ),
            _integer("ticks", "how many samples were recorded"),
            _number("fraction", "1", "how far the task was at the end, from 0 to 1"),
            *MEASURES,
        ),
    ),
    "responses": Table(
        "what was said to one item of a questionnaire",
        (
            _WHO,
            _text("step", "the key of the protocol's step"),
            _TASK,
            _WAY,
            _STRATEGY,
            _text("questionnaire", "its name"),
            _text("item", "the item's key"),
            _text("value", "as it was given; empty: declined"),
            _integer("number", "the value, of an item on a scale; empty otherwise"),
            _text("chosen", "the strategy of the way chosen, of an item that asks for one"),
            _boolean("is_declined", "whether they would rather not say"),
            _time("answered_at", "when, by the page's clock"),
            _time("received_at", "when, by the server's clock"),
        ),
    ),
    "scores": Table(
        "a published score of a questionnaire whose items were all answered",
        (
            _WHO,
            _text("step", "the key of the protocol's step"),
            _TASK,
            _WAY,
            _STRATEGY,
            _text("questionnaire", "its name"),
            _text("score", "its name", tlx_raw="load, raw NASA-TLX", sus="usability, SUS"),
            _number("value", "1", "from 0 to 100"),
        ),
    ),
    "notes": Table(
        "what an experimenter noted of a participant",
        (
            _WHO,
            _text("author", "pseudonym of the experimenter"),
            _text("text", "as it was written"),
            _time("written_at", "when"),
        ),
    ),
    "samples": Table("a tick of a drive, sixty a second", (*_TICK, *SAMPLE_COLUMNS)),
    "props": Table(
        "where cup and beads were at a tick, to 0.1 µm; tasks without a cup have none",
        (*_TICK, *CUP_COLUMNS, *BEAD_COLUMNS),
    ),
}


def as_json() -> dict[str, Any]:
    """The codebook for programs: what a row and what each column is, by the table's name."""
    return {
        name: {
            "row": table.row,
            "columns": [
                {
                    "name": column.name,
                    "type": column.kind,
                    "unit": column.unit,
                    "description": column.says,
                    "levels": dict(column.levels),
                }
                for column in table.columns
            ],
        }
        for name, table in TABLES.items()
    }


def as_text() -> str:
    """The codebook for people, as Markdown."""
    parts = ["# Codebook\n"]
    for name, table in TABLES.items():
        parts.append(f"\n## {name}\n\nA row is {table.row}.\n\n")
        parts.append("| column | type | unit | what it is |\n|---|---|---|---|\n")
        for each in table.columns:
            levels = "; ".join(f"`{level}` {says}" for level, says in each.levels)
            says = f"{each.says}: {levels}" if levels else each.says
            parts.append(f"| {each.name} | {each.kind} | {each.unit} | {says} |\n")
    return "".join(parts)
