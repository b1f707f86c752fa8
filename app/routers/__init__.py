"""The doors, in reading order."""

from app.routers import experimenter, live, pages, participants, replays

ROUTERS = (pages.router, participants.router, live.router, experimenter.router, replays.router)
