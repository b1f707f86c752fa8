"""The doors, in reading order."""

from app.routers import experimenter, join, live, pages, participants, replays

ROUTERS = (
    pages.router,
    join.router,
    participants.router,
    live.router,
    experimenter.router,
    replays.router,
)
