"""Protocols: from YAML or a form, kept version after version, frozen by the first enrolment."""

import json
import uuid
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from types import MappingProxyType
from typing import Any

from pydantic import ValidationError
from sqlalchemy.orm import Session

from app.errors import JoymapError
from app.schemas import yaml_reader
from app.schemas.protocol import Protocol
from app.schemas.yaml_reader import NotReadable, Place
from app.services import protocol_faults, protocol_rules
from app.services.protocol_faults import Fault, of_words
from app.settings import Settings
from app.storage import studies
from app.storage.tables import ParticipantRow, ProtocolRow, StudyRow

_FROZEN: dict[str, tuple[Protocol, int]] = {}
_FROZEN_KEPT = 256
_NO_LINES: Mapping[Place, int] = MappingProxyType({})
DEMO = "demo"
# What can be tried without a study, best first.
DEMO_STRATEGIES = ("all-priors", "task-space", "no-priors", "no-align")


class BadProtocol(JoymapError):
    """A protocol that cannot be run; says where and why."""

    status_code = 422
    kind = "bad-protocol"

    def __init__(self, faults: Sequence[Fault]) -> None:
        """The first fault is the one that is said where there is room for one."""
        self.faults = tuple(faults)
        super().__init__(self.faults[0].sentence)


def parse(content: Any, lines: Mapping[Place, int] = _NO_LINES) -> Protocol:
    """A new protocol from JSON-like data.

    Args:
        content: What was sent.
        lines: Where in a file it stood, to be told with what is wrong.

    Raises:
        BadProtocol: With everything that is wrong.
    """
    if not isinstance(content, dict):
        says = "A protocol is a list of settings, such as 'title: My study'"
        raise BadProtocol([protocol_faults.at((), says, lines)])
    _refuse(of_words(content), lines)
    protocol = _read(content, lines)
    _refuse(protocol_rules.broken(protocol), lines)
    return protocol


def _read(content: Any, lines: Mapping[Place, int]) -> Protocol:
    try:
        # Strict JSON takes an array for a tuple, and nothing else for what it is not.
        return Protocol.model_validate_json(json.dumps(content))
    except ValidationError as error:
        raise BadProtocol(protocol_faults.of_schema(error, lines)) from error


def _refuse(broken: Iterable[tuple[Place, str]], lines: Mapping[Place, int]) -> None:
    faults = [protocol_faults.at(place, says, lines) for place, says in broken]
    if faults:
        raise BadProtocol(faults)


def parse_yaml(text: str | bytes) -> Protocol:
    """A new protocol from YAML.

    Raises:
        BadProtocol: If it is not YAML (with the line), or not a protocol.
    """
    try:
        document = yaml_reader.read(text)
    except NotReadable as error:
        raise BadProtocol([Fault("", error.says, error.line)]) from error
    return parse(document.content, document.lines)


def as_yaml(protocol: Protocol) -> str:
    """A protocol as YAML that reads back the same."""
    return yaml_reader.write(as_json(protocol))


def as_json(protocol: Protocol) -> dict[str, Any]:
    """A protocol as it is stored."""
    content: dict[str, Any] = protocol.model_dump(mode="json")
    return content


def of_participant(db: Session, participant: ParticipantRow) -> tuple[Protocol, int]:
    """The protocol a participant was enrolled under, and its version."""
    # Whoever takes part does so under a frozen version, which is the same for ever.
    known = _FROZEN.get(participant.protocol_id)
    if known is None:
        row = studies.protocol(db, participant.protocol_id)
        known = of_row(row), row.version
        if len(_FROZEN) >= _FROZEN_KEPT:
            _FROZEN.clear()
        _FROZEN[row.id] = known
    return known


def of_row(row: ProtocolRow) -> Protocol:
    """The protocol that a version holds: checked when it was kept, by the rules of that day.

    Raises:
        BadProtocol: If it cannot be read any more, as when a package that brought a strategy is
            gone.
    """
    return _read(row.content, _NO_LINES)


def keep(db: Session, study: StudyRow, protocol: Protocol) -> ProtocolRow:
    """Make this the study's protocol: in place of the latest version, or after it if frozen."""
    now = datetime.now(UTC)
    latest = studies.latest(db, study.id)
    content = as_json(protocol)
    study.title = protocol.title
    if latest is not None and latest.frozen_at is None:
        latest.content, latest.created_at = content, now
        return latest
    if latest is not None and as_json(of_row(latest)) == content:
        return latest
    row = ProtocolRow(
        id=str(uuid.uuid4()),
        study_id=study.id,
        version=1 if latest is None else latest.version + 1,
        content=content,
        created_at=now,
        frozen_at=None,
    )
    db.add(row)
    db.flush()
    return row


def demo(db: Session, settings: Settings) -> StudyRow:
    """The study of those who only try Joymap out, as this server's settings have it."""
    study = studies.study(db, DEMO)
    if study is None:
        study = StudyRow(
            id=DEMO,
            title="Try it out",
            state="open",
            link_hash=None,
            created_at=datetime.now(UTC),
            created_by=None,
        )
        db.add(study)
        db.flush()
    keep(db, study, demo_protocol(settings))
    return study


# Which setting each part of it comes from.
DEMO_SETTINGS = {
    "tasks.0.task": "task",
    "tasks.0.labels": "labels_wanted",
    "tasks.0.questions": "queries",
    "tasks.0.enough_error": "enough_error",
    "tasks.0.unlabelled": "unlabelled_states",
    "tasks.0.time_limit_s": "drive_limit_s",
    "tasks.0.auto_grasp": "auto_grasp",
    "tasks.0": "task",
    "practice_s": "practice_s",
    "arrows": "arrows",
    "drive_waits_s": "drive_waits_s",
}


def demo_protocol(settings: Settings) -> Protocol:
    """What is tried out: one task, driven freely under whatever strategy.

    Raises:
        BadProtocol: If a setting is outside of what a protocol may say.
    """
    return parse(
        {
            "title": "Teach a robot arm how you steer",
            "tasks": [
                {
                    "task": settings.task,
                    "labels": settings.labels_wanted,
                    "questions": settings.queries,
                    "enough_error": settings.enough_error,
                    "unlabelled": settings.unlabelled_states,
                    "time_limit_s": settings.drive_limit_s,
                    "auto_grasp": settings.auto_grasp,
                }
            ],
            "strategies": DEMO_STRATEGIES,
            "order": "fixed",
            "practice_s": settings.practice_s,
            "arrows": settings.arrows,
            "drive_waits_s": settings.drive_waits_s,
            "is_free": True,
        }
    )
