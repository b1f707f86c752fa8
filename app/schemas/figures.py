"""A study's figures, as the dashboard and programs get them."""

from datetime import datetime
from typing import Any

from pydantic import BaseModel, ConfigDict

from app.schemas.examples import AT

_FIGURE: dict[str, Any] = {
    "name": "objective",
    "title": "Time, path and undo",
    "says": "For each task and strategy the mean over people.",
}


class FigureOut(BaseModel):
    """A figure: its name, which its address ends with, and what it shows."""

    model_config = ConfigDict(json_schema_extra={"examples": [_FIGURE]})

    name: str
    title: str
    says: str


class FiguresOut(BaseModel):
    """What was drawn last, and whether newer figures are being drawn."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "is_drawing": False,
                    "has_failed": False,
                    "is_current": True,
                    "drawn_at": AT,
                    "drives": 90,
                    "test": "Wilcoxon's signed-rank test, exact, two-sided",
                    "findings": ["No two strategies differ in any of 27 comparisons."],
                    "pictures": [_FIGURE],
                }
            ]
        }
    )

    is_drawing: bool
    has_failed: bool
    is_current: bool
    drawn_at: datetime | None
    drives: int
    test: str
    findings: list[str]
    pictures: list[FigureOut]
