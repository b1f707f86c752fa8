"""The doors, in reading order."""

from app.routers import (
    accounts,
    experimenter,
    exports,
    figures,
    join,
    live,
    pages,
    participants,
    replays,
    studies,
    watching,
)

ROUTERS = (
    pages.router,
    join.router,
    participants.router,
    live.router,
    accounts.router,
    studies.router,
    experimenter.router,
    exports.router,
    figures.router,
    replays.router,
    watching.router,
)
