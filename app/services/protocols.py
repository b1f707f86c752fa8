"""Protocols: from YAML or a form, kept version after version, frozen by the first enrolment."""

import uuid
from datetime import UTC, datetime
from typing import Any

import yaml
from pydantic import ValidationError
from sqlalchemy.orm import Session

from app.errors import JoymapError
from app.schemas.protocol import Protocol, Questionnaire
from app.services import questionnaires
from app.settings import Settings
from app.storage import studies
from app.storage.tables import ParticipantRow, ProtocolRow, StudyRow

_FROZEN: dict[str, tuple[Protocol, int]] = {}
_FROZEN_KEPT = 256
DEMO = "demo"
# What can be tried without a study, best first.
DEMO_STRATEGIES = ("all-priors", "task-space", "no-priors", "no-align")


class BadProtocol(JoymapError):
    """A protocol that cannot be run; says where and why."""

    status_code = 422
    kind = "bad-protocol"


def parse(content: Any) -> Protocol:
    """A protocol from JSON-like data.

    Raises:
        BadProtocol: With the place of the first thing wrong, and what it is.
    """
    protocol = _read(content)
    asked = protocol.questionnaires
    for where, names in asked.model_dump().items():
        for name in names:
            if names.count(name) > 1:
                raise BadProtocol(f"'{name}' is there twice in questionnaires.{where}.")
            if find_questionnaire(protocol, name) is None:
                known = ", ".join(
                    [*questionnaires.LIBRARY, *(own.name for own in protocol.own_questionnaires)]
                )
                raise BadProtocol(
                    f"questionnaires.{where}: there is no questionnaire '{name}'; "
                    f"choose from {known}, or write your own under own_questionnaires."
                )
    return protocol


def parse_yaml(text: str) -> Protocol:
    """A protocol from YAML.

    Raises:
        BadProtocol: If it is not YAML (with the line), or not a protocol.
    """
    try:
        content = yaml.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f"line {mark.line + 1}: " if mark is not None else ""
        raise BadProtocol(
            f"{line}{getattr(error, 'problem', None) or 'this is not YAML'}."
        ) from error
    except RecursionError as error:
        raise BadProtocol("This is nested too deeply to be a protocol.") from error
    if not isinstance(content, dict):
        raise BadProtocol("A protocol is a list of settings, such as 'title: My study'.")
    return parse(content)


def as_yaml(protocol: Protocol) -> str:
    """A protocol as YAML that reads back the same."""
    text: str = yaml.safe_dump(as_json(protocol), sort_keys=False, allow_unicode=True, width=100)
    return text


def as_json(protocol: Protocol) -> dict[str, Any]:
    """A protocol as it is stored."""
    content: dict[str, Any] = protocol.model_dump(mode="json")
    return content


def find_questionnaire(protocol: Protocol, name: str) -> Questionnaire | None:
    """One of the protocol's own questionnaires, or one of the library's."""
    own = {each.name: each for each in protocol.own_questionnaires}
    return own.get(name) or questionnaires.LIBRARY.get(name)


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
    """The protocol that a version holds: checked when it was kept, by the rules of that day."""
    return _read(row.content)


def _read(content: Any) -> Protocol:
    try:
        return Protocol.model_validate(content)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        place = ".".join(str(part) for part in first["loc"]) or "protocol"
        raise BadProtocol(f"{place}: {first['msg'].removeprefix('Value error, ')}.") from error


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


def demo_protocol(settings: Settings) -> Protocol:
    """What is tried out: one task, driven freely under whatever strategy."""
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
