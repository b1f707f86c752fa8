"""Answers that name themselves, so that what the asker has already is not sent again."""

import hashlib

from fastapi import Request, Response
from pydantic import BaseModel


def unless_known(request: Request, found: BaseModel) -> Response:
    """The answer with its ETag; 304 to who says that they have it."""
    content = found.model_dump_json()
    tag = f'"{hashlib.sha256(content.encode()).hexdigest()[:32]}"'
    known = {each.strip().removeprefix("W/") for each in _known(request)}
    if tag in known or "*" in known:
        return Response(status_code=304, headers={"ETag": tag})
    return Response(content, media_type="application/json", headers={"ETag": tag})


def _known(request: Request) -> list[str]:
    return request.headers.get("if-none-match", "").split(",")
