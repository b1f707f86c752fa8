"""How routes describe themselves in OpenAPI: their names, and what they refuse."""

from typing import Any

from fastapi.routing import APIRoute

from app.schemas.refusal import RefusalOut

Responses = dict[int | str, dict[str, Any]]


def _refused(status_code: int, why: str) -> Responses:
    return {status_code: {"model": RefusalOut, "description": why}}


REFUSED = (
    _refused(401, "Who asks is not logged in, or the key is none.")
    | _refused(403, "Whose login or key this is may not do that, or another site asks.")
    | _refused(422, "What was sent makes no sense; the sentence says where and why.")
    | _refused(429, "That was too often; Retry-After says when to come again.")
)
MISSING = _refused(404, "There is no such thing.")
KEPT = _refused(409, "What there is already stands against it; nothing was changed.")
CHANGED = _refused(412, "It is not what was seen any more; nothing was changed.")


def name_of(route: APIRoute) -> str:
    """The route's name to programs: its function's, which stays when an address changes."""
    return route.name


def example(answer: dict[str, Any]) -> Responses:
    """What the route answers, for example."""
    return {200: {"content": {"application/json": {"example": answer}}}}
