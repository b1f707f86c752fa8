"""What people say in questionnaires: as they gave it, item by item, once."""

import json
from datetime import UTC, datetime

from sqlalchemy.orm import Session

from app.errors import JoymapError
from app.schemas.participants import QuestionnaireIn
from app.services import flow, questionnaires
from app.storage.tables import ParticipantRow, ResponseRow


class BadResponse(JoymapError):
    """A questionnaire that is not filled in as it asks."""

    status_code = 422
    kind = "bad-response"


def record(
    db: Session, participant: ParticipantRow, at: flow.Here, given: QuestionnaireIn
) -> flow.Here | None:
    """Keep a questionnaire and take the step; the same id again changes nothing.

    Returns:
        Where they are now; None if it was kept before.

    Raises:
        IdReused: If the id was used for something else.
        WrongStep: If the participant is not at this questionnaire.
        BadResponse: If an item is missing, unknown, answered twice, or answered with something
            it does not allow.
    """
    after = flow.advance(db, participant, at, str(given.id), "questions", given.key)
    if after is None:
        return None
    questionnaire = questionnaires.find(at.protocol, at.step.questionnaire or "")
    assert questionnaire is not None, "a protocol's questionnaires are checked when it is kept"
    answers = {response.item: response for response in given.responses}
    if len(answers) < len(given.responses):
        raise BadResponse("An item is answered twice.")
    unknown = answers.keys() - {item.key for item in questionnaire.items}
    if unknown:
        raise BadResponse(f"There is no item '{min(unknown)}' in this questionnaire.")
    now = datetime.now(UTC)
    for item in questionnaire.items:
        response = answers.get(item.key)
        if response is None:
            raise BadResponse(f"Please answer '{item.text}', or say that you would rather not.")
        value = response.value
        if value is not None and not questionnaires.fits(item, value, len(at.order)):
            raise BadResponse(f"This is no answer to '{item.text}'.")
        db.add(
            ResponseRow(
                participant_id=participant.id,
                step=given.key,
                questionnaire=questionnaire.name,
                item=item.key,
                value=None if value is None else json.dumps(value),
                answered_at=response.answered_at,
                received_at=now,
            )
        )
    return after
