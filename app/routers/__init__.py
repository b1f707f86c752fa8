"""The doors, in reading order."""

from app.routers import experimenter, live, pages, participants

ROUTERS = (pages.router, participants.router, live.router, experimenter.router)
