"""Studies: made, changed, opened and closed by experimenters."""

from datetime import UTC, datetime

from sqlalchemy.orm import Session

from app.errors import IdReused, JoymapError
from app.schemas.experimenter import (
    CheckedOut,
    ProtocolIn,
    StepOut,
    StudyLineOut,
    StudyOut,
    VersionOut,
)
from app.schemas.protocol import Protocol
from app.services import audit, enrolment, external_ids, plan, protocols, visit
from app.services.accounts import Experimenter
from app.services.external_ids import NobodysId
from app.storage import participants, studies
from app.storage.tables import ParticipantRow, ProtocolRow, StudyRow

# What a step takes, roughly, in [s]: for the estimate before anyone has taken part.
_SECONDS = {"consent": 60, "training": 5, "questions": 45, "end": 5}
_ANSWER_S, _DRIVE_S = 8, 45
_STATES = ("active", "completed", "abandoned", "withdrawn")


class NoSuchStudy(JoymapError):
    """A study that nobody made."""

    status_code = 404
    kind = "no-such-study"

    def __init__(self) -> None:
        """Say so."""
        super().__init__("There is no such study.")


class ChangedMeanwhile(JoymapError):
    """A change made to what is not there any more."""

    status_code = 412
    kind = "changed-meanwhile"

    def __init__(self) -> None:
        """Say what to do."""
        super().__init__("Somebody changed this study meanwhile; please reload and change it anew.")


class KnownAlready(JoymapError):
    """A second participant of the same name elsewhere."""

    status_code = 409
    kind = "known-already"

    def __init__(self) -> None:
        """Say so."""
        super().__init__("There is a participant with this external id already in this study.")


class DemoStaysAsItIs(JoymapError):
    """A change to what the server's settings decide."""

    status_code = 409
    kind = "demo"

    def __init__(self) -> None:
        """Say where it is changed."""
        super().__init__("This one is for trying Joymap out; the server's settings say how.")


def read(content: ProtocolIn) -> Protocol:
    """The protocol that was sent.

    Raises:
        BadProtocol: If it is none.
    """
    if content.yaml is not None:
        return protocols.parse_yaml(content.yaml)
    return protocols.parse(content.protocol)


def check(content: ProtocolIn) -> CheckedOut:
    """A protocol both ways, and what participants would do; nothing is kept."""
    protocol = read(content)
    steps = plan.steps_of(protocol, 0)
    return CheckedOut(
        protocol=protocol,
        yaml=protocols.as_yaml(protocol),
        steps=[step_out(step) for step in steps],
        minutes=round(sum(_seconds(step, protocol) for step in steps) / 60),
    )


def step_out(step: plan.Step) -> StepOut:
    """A step in words."""
    return StepOut(key=step.key, kind=step.kind, title=visit.title_of(step))


def create(db: Session, who: Experimenter, study_id: str, protocol: Protocol) -> StudyRow:
    """Make a study that people can take part in.

    Raises:
        IdReused: If the id was used for another protocol.
    """
    found = studies.study(db, study_id)
    if found is not None:
        latest = studies.latest(db, study_id)
        if latest is None or protocols.as_json(protocols.of_row(latest)) != protocols.as_json(
            protocol
        ):
            raise IdReused
        return found
    study = StudyRow(
        id=study_id,
        title=protocol.title,
        state="open",
        link_hash=None,
        created_at=datetime.now(UTC),
        created_by=who.id,
    )
    db.add(study)
    db.flush()
    protocols.keep(db, study, protocol)
    audit.note(db, who.id, "study.create", study_id, title=protocol.title)
    return study


def find(db: Session, study_id: str) -> StudyRow:
    """The study of that id.

    Raises:
        NoSuchStudy: If there is none.
    """
    study = studies.study(db, study_id)
    if study is None:
        raise NoSuchStudy
    return study


def change(
    db: Session, who: Experimenter, study_id: str, protocol: Protocol, seen: str | None
) -> StudyRow:
    """Give a study another protocol: a new version once somebody has enrolled.

    Raises:
        NoSuchStudy: If there is none.
        DemoStaysAsItIs: If it is the one for trying out.
        ChangedMeanwhile: If the protocol seen is not the one that stands.
    """
    study = find(db, study_id)
    if study_id == protocols.DEMO:
        raise DemoStaysAsItIs
    before = _latest(db, study)
    if protocols.as_json(protocols.of_row(before)) == protocols.as_json(protocol):
        return study  # such as the same change, sent again
    if seen is not None and seen.strip('"') != tag(before):
        raise ChangedMeanwhile
    row = protocols.keep(db, study, protocol)
    audit.note(db, who.id, "study.protocol", study_id, version=row.version)
    return study


def tag(row: ProtocolRow) -> str:
    """Names exactly this protocol, for whoever changes what they saw."""
    return f"{row.version}-{row.created_at.timestamp():.6f}"


def tag_of(db: Session, study: StudyRow) -> str:
    """The tag of the protocol that stands."""
    return tag(_latest(db, study))


def set_state(db: Session, who: Experimenter, study_id: str, state: str) -> StudyRow:
    """Let people in, or nobody any more; those who are in go on."""
    study = find(db, study_id)
    if study.state != state:
        study.state = state
        audit.note(db, who.id, f"study.{state}", study_id)
    return study


def new_link(db: Session, who: Experimenter, study_id: str) -> str:
    """The token of a new shared link; the former ends."""
    study, token = find(db, study_id), enrolment.new_token()
    study.link_hash = enrolment.hash_of(token)
    audit.note(db, who.id, "study.link", study_id)
    return token


def end_link(db: Session, who: Experimenter, study_id: str) -> None:
    """End the shared link."""
    study = find(db, study_id)
    if study.link_hash is not None:
        study.link_hash = None
        audit.note(db, who.id, "study.end-link", study_id)


def lines(db: Session) -> list[StudyLineOut]:
    """All studies, in the order in which they were made, by a fixed number of statements."""
    latest, counts = studies.all_latest(db), studies.state_counts(db)
    return [_line(study, latest[study.id], counts) for study in studies.everything(db)]


def _line(study: StudyRow, latest: ProtocolRow, counts: dict[tuple[str, str], int]) -> StudyLineOut:
    return StudyLineOut(
        id=study.id,
        title=study.title,
        state=study.state,  # type: ignore[arg-type]
        created_at=study.created_at.isoformat(timespec="seconds"),
        version=latest.version,
        participants={state: counts.get((study.id, state), 0) for state in _STATES},
        wanted=latest.content.get("participants"),
    )


def whole(db: Session, study: StudyRow) -> StudyOut:
    """A study with its protocol."""
    row = _latest(db, study)
    protocol = protocols.of_row(row)
    under = studies.version_counts(db, study.id)
    return StudyOut(
        **_line(study, row, studies.state_counts(db, study.id)).model_dump(),
        protocol=protocol,
        yaml=protocols.as_yaml(protocol),
        is_frozen=row.frozen_at is not None,
        versions=[
            VersionOut(
                version=each.version,
                created_at=each.created_at.isoformat(timespec="seconds"),
                frozen_at=None
                if each.frozen_at is None
                else each.frozen_at.isoformat(timespec="seconds"),
                participants=under.get(each.id, 0),
            )
            for each in studies.versions(db, study.id)
        ],
        has_link=study.link_hash is not None,
    )


def add_participants(
    db: Session, who: Experimenter, study_id: str, ids: list[str], external_id: str | None
) -> list[tuple[ParticipantRow, str]]:
    """Enrol people, each with the token of their link.

    Raises:
        NoSuchStudy: If there is none.
        NobodysId: If the external id cannot be anybody's.
        KnownAlready: If somebody in the study has this external id.
        StudyClosed: If it takes nobody in.
        StudyFull: If there are not places enough; then nobody is enrolled.
        IdReused: If an id was used before.
    """
    study = find(db, study_id)
    name = external_ids.read(external_id)
    if external_id is not None and name is None:
        raise NobodysId(external_id)
    before = None if name is None else participants.by_external_id(db, study_id, name)
    if before is not None:
        raise IdReused if before.id in ids else KnownAlready
    made = []
    for participant_id in ids:
        token = enrolment.new_token()
        row = enrolment.enrol(
            db,
            study,
            token,
            participant_id=participant_id,
            origin=enrolment.EXPERIMENTER,
            external_id=name,
        )
        made.append((row, token))
    audit.note(db, who.id, "participants.add", study_id, count=len(ids))
    return made


def _latest(db: Session, study: StudyRow) -> ProtocolRow:
    row = studies.latest(db, study.id)
    assert row is not None, "a study is made with its protocol"
    return row


def _seconds(step: plan.Step, protocol: Protocol) -> float:
    if step.kind == "practice":
        return protocol.practice_s
    if step.kind == "queries":
        task = next(task for task in protocol.tasks if task.task == step.task)
        return _ANSWER_S * (task.labels + task.repeats)
    if step.kind in ("block", "driving"):
        return _DRIVE_S * protocol.drives
    return _SECONDS[step.kind]
