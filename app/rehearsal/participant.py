"""One simulated participant's part in a study of one task, in process and out of real time.

The questions, the methods and every tick are the server's own (:mod:`app.services.queries`,
:mod:`models.strategies`, :class:`app.teleop.live_session.LiveSession`), and the person is the one
that ``joymap bots`` sends (:mod:`app.bots`); only the sockets, the clock and the picture between
them are left out. The bots themselves may not know the arm from the inside, so it is on the floor
above them that the two are brought together.
"""

from collections import deque
from dataclasses import dataclass
from functools import cache
from itertools import count
from typing import Any

import numpy as np

from app.analysis.measures import measure
from app.bots.crowd import Crowd
from app.bots.eyes import Sight, presses, wish_from
from app.bots.person import Habits, Person
from app.bots.visit import STICK_HZ
from app.scene.arm_scene import ArmScene
from app.schemas.props import PropsOut
from app.schemas.protocol import LEARNABLE, NO_ALIGN, TaskProtocol
from app.services import queries
from app.storage.tables import AnswerRow
from app.storage.ticks import COLUMNS
from app.teleop.live_session import LiveSession
from app.teleop.recorder import DriveLog
from app.teleop.stick_lease import Connection
from models.alignment import Alignment
from models.arm_kinematics import ArmKinematics
from models.arrays import JointPositions
from models.checkpoints import load_controller
from models.controller import LatentController
from models.experiment import PAPER_UNLABELLED
from models.fitting import FitProblem, Labels
from models.kinematics import Kinematics
from models.mapping import Mapping
from models.panda_pack import PandaPack, open_pack
from models.queries import SHOWN_STEPS
from models.simulation import HandState, Simulation
from models.strategies import get_strategy
from models.tasks import Task, get_task

STRATEGIES = (NO_ALIGN, *LEARNABLE)
_TICKS_A_STICK = 2  # the loop runs at 60 Hz
_DT_S = 1.0 / (_TICKS_A_STICK * STICK_HZ)
_SILENCE_S = 0.25
_NAME = "rehearsal"
_PAGE = Connection(_NAME)
_SEED, _START = 2, 3  # of a person's chance; Crowd has streams 0 and 1


@dataclass(frozen=True)
class Part:
    """A participant's part; every field decides what comes of it.

    Attributes:
        task: Name of the task.
        strategies: What they drive under, in this order; one of them twice is allowed.
        labels: How many questions they answer.
        preference: Words for their idea of the stick (:mod:`models.preferences`).
        habits: Their noise, delay and learning.
        limit_s: An attempt ends after so long.
        seed: Of the crowd.
        number: Which of the crowd they are.
    """

    task: str
    strategies: tuple[str, ...]
    labels: int
    preference: str = "random"
    habits: Habits = Habits()  # noqa: RUF009 (it is frozen)
    limit_s: float = 60.0
    seed: int = 0
    number: int = 0

    def check(self) -> None:
        """Refuse at once what no participant could do.

        Raises:
            ModelsError: If there is no such preference, or the arm's pack is missing.
        """
        self.person()
        open_pack()

    def person(self) -> Person:
        """Who takes it: the same as of a crowd of that seed."""
        return Crowd(self.number + 1, self.preference, self.habits, self.seed).person(self.number)


@dataclass(frozen=True)
class Drove:
    """How one attempt went.

    Attributes:
        is_success: Whether it ended well.
        completion_time_s: How long it took; the time limit if it did not end well.
        path_length_m: As :mod:`app.analysis.measures` has it.
        undo_share: The same.
    """

    is_success: bool
    completion_time_s: float
    path_length_m: float
    undo_share: float


def take_part(part: Part) -> tuple[Drove, ...]:
    """Answer, let it be learned, and drive once under each strategy; same part, same result.

    Raises:
        ModelsError: If the arm's pack or the controller is missing, or nobody is like that.
    """
    lab = _lab(part.task)
    person = part.person()
    seed = int(_chance(part, _SEED).integers(2**31))
    labels = _answer(part, person, lab, seed)
    learned = _learn(part, lab, labels, seed)
    return tuple(
        _drive(part, person, lab, learned[strategy], _chance(part, _START + place))
        for place, strategy in enumerate(part.strategies)
    )


@dataclass(frozen=True)
class _Lab:
    task: Task
    controller: LatentController
    pack: PandaPack
    kinematics: Kinematics


@cache
def _lab(name: str) -> _Lab:
    pack = open_pack()
    return _Lab(get_task(name), load_controller(name), pack, Kinematics.from_urdf(pack.urdf))


def _chance(part: Part, stream: int) -> np.random.Generator:
    return np.random.default_rng([part.seed, part.number, stream])


def _answer(part: Part, person: Person, lab: _Lab, seed: int) -> Labels:
    """Look at the moves that a study would show them, and say what they would push."""
    wanted = TaskProtocol(
        task=part.task, labels=part.labels, unlabelled=PAPER_UNLABELLED[part.task]
    )
    shown = queries.draw(_NAME, seed, wanted, lab.controller, lab.kinematics)[: part.labels]
    given = []
    for query in shown:
        path = queries.as_path(query)
        before, after = lab.kinematics.hand_pose(path[0]), lab.kinematics.hand_pose(path[-1])
        x, y = person.label(lab.task, before, after, SHOWN_STEPS).tolist()
        given.append((query, AnswerRow(h_x=x, h_y=y)))
    return queries.as_labels(given)


def _learn(part: Part, lab: _Lab, labels: Labels, seed: int) -> dict[str, Alignment]:
    pool = queries.draw_pool(
        part.task, seed, lab.controller, lab.kinematics, PAPER_UNLABELLED[part.task]
    )
    problem = FitProblem(lab.task, lab.kinematics, lab.controller, labels, pool)
    return {
        name: get_strategy(name).method.fit(problem, seed).alignment
        for name in dict.fromkeys(part.strategies)
    }


def _drive(
    part: Part, person: Person, lab: _Lab, alignment: Alignment, chance: np.random.Generator
) -> Drove:
    """One attempt; they act on what was to be seen a reaction time ago."""
    session = LiveSession(
        _NAME,
        Simulation(lab.pack, lab.task.props),
        _NoPicture(),
        lab.task,
        silence_s=_SILENCE_S,
        start=lab.task.home_q,
        limit_s=part.limit_s,
    )
    session.take_stick(_PAGE)
    props = PropsOut.model_validate(lab.task.props).model_dump()
    arm = ArmKinematics(lab.kinematics, lab.pack)
    attempt = lab.task.begin(session.prepare(), arm, chance)
    record = _Record()
    session.start_drive(None, Mapping(lab.controller, alignment), record, attempt)
    person.begin()
    delay = round(part.habits.reaction_s / _DT_S)
    seen: deque[Sight] = deque(maxlen=delay + 1)
    for tick in count():
        now_s = tick * _DT_S
        seen.append(Sight.of(attempt, props))
        if tick % _TICKS_A_STICK == 0 and len(seen) > delay:
            if presses(seen[0]):
                session.press(_PAGE)
            wish = wish_from(lab.task.name, seen[0])
            stick = person.push(lab.task, wish, seen[0].hand, now_s, 1.0 / STICK_HZ)
            session.move_stick(_PAGE, float(stick[0]), float(stick[1]), now_s)
        session.tick(now_s, _DT_S)
        if not session.is_trying:
            break
    return _measured(record, part.limit_s)


def _measured(record: "_Record", limit_s: float) -> Drove:
    went = measure(np.array(record.rows), COLUMNS, record.outcome)
    is_success = bool(went.is_success)
    return Drove(
        is_success,
        went.completion_time_s if is_success else limit_s,
        went.path_length_m,
        went.undo_share,
    )


class _Record(DriveLog):
    """A drive's ticks, kept here and not in a database."""

    def __init__(self) -> None:
        self.drive_id = _NAME
        self.rows: list[np.ndarray] = []
        self.outcome: dict[str, Any] = {}

    def add(self, row: np.ndarray, props: np.ndarray) -> None:
        del props
        self.rows.append(row)

    def end(self, why: str, outcome: dict[str, Any] | None = None) -> None:
        del why
        self.outcome = outcome or {}


class _NoPicture(ArmScene):
    """The scene of an arm that nobody looks at."""

    def __init__(self) -> None:
        pass

    def show_arm(self, q: JointPositions, hand: Any) -> None:
        pass

    def show_props(self, cup: HandState | None, beads: np.ndarray) -> None:
        pass

    def hide_arrows(self) -> None:
        pass
