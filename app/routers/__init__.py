"""The doors, in reading order."""

from app.routers import accounts, experimenter, join, live, pages, participants, replays, studies

ROUTERS = (
    pages.router,
    join.router,
    participants.router,
    live.router,
    accounts.router,
    studies.router,
    experimenter.router,
    replays.router,
)
