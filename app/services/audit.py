"""What experimenters did, in the transaction in which they did it."""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy.orm import Session

from app.storage.tables import AuditRow


def note(
    db: Session, who: str | None, action: str, subject: str | None = None, **detail: Any
) -> None:
    """Write down an action, such as "study.create", of an experimenter; null: of the server."""
    now = datetime.now(UTC)
    db.add(AuditRow(at=now, experimenter_id=who, action=action, subject=subject, detail=detail))
