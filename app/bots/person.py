"""A model of a person with a stick: a private idea of what it does, delay, noise, and learning.

The person wants the hand to move in some way and gives the stick that, by their idea, does it. They
act on what they saw a reaction time ago. Their hand shakes the more the farther they push
(signal-dependent noise: Harris and Wolpert, "Signal-dependent noise determines motor planning",
Nature 1998). Who adapts compares what came of their stick with what they wanted, and bends their
idea towards what they see: a step of normalised least mean squares, as trial-by-trial studies of
motor adaptation find it (Thoroughman and Shadmehr, "Learning of action through adaptive combination
of motor primitives", Nature 2000).
"""

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from models.kinematics import HandPose
from models.preferences import Preference
from models.simulated_human import SimulatedHuman
from models.tasks import Task

FULL_STICK_M_S = 0.2  # how fast they expect the hand to be at full stick
STEP_S = 0.1  # how they think of speed: a step
_NOISE_S = 0.2  # how long a slip of the hand lasts
_LEAST_M = 1e-3  # who sees less than this move in a step learns nothing from it


@dataclass(frozen=True)
class Habits:
    """What makes one person differ from another, beside their idea of the stick.

    Attributes:
        label_noise: RMS length of the noise of an answer over the answer's length.
        motor_noise: The same of the stick while they drive.
        reaction_s: How old what they act on is.
        adapts: How much of what surprised them they take in, at each look; 0: nothing.
    """

    label_noise: float = 0.1
    motor_noise: float = 0.1
    reaction_s: float = 0.2
    adapts: float = 0.0


@dataclass
class Person:
    """One simulated person, for one way of steering after the other.

    Attributes:
        preference: Their idea of the stick.
        habits: See :class:`Habits`.
        rng: All their chance.
    """

    preference: Preference
    habits: Habits
    rng: np.random.Generator
    surprises: list[float] = field(default_factory=list, init=False)
    _correction: np.ndarray = field(default_factory=lambda: np.eye(2), init=False)
    _slip: np.ndarray = field(default_factory=lambda: np.zeros(2), init=False)
    _seen: deque[tuple[float, HandPose, np.ndarray]] = field(default_factory=deque, init=False)

    def begin(self) -> None:
        """A new way of steering: expect their own idea, and be surprised anew."""
        self.surprises, self._correction = [], np.eye(2)
        self.pause()

    def pause(self) -> None:
        """A new attempt: what was seen before it says nothing of what comes."""
        self._seen.clear()
        self._slip = np.zeros(2)

    def label(self, task: Task, before: HandPose, after: HandPose, steps: int) -> np.ndarray:
        """The stick ``(2,)`` they would give for a move of so many steps of 0.1 s."""
        human = self._human(task)
        h = human.answer(task.dof_change(before, after) / steps, before)
        length = float(np.linalg.norm(h))
        h = h + self.habits.label_noise / np.sqrt(2.0) * length * self.rng.standard_normal(2)
        return np.asarray(h / max(1.0, float(np.linalg.norm(h))))

    def push(
        self, task: Task, wanted_m_s: np.ndarray, hand: HandPose, now_s: float, dt_s: float
    ) -> np.ndarray:
        """The stick ``(2,)`` they give to make the hand go as they want.

        Args:
            task: Whose degrees of freedom they think in.
            wanted_m_s: Where to, ``(2,)``.
            hand: Where they see the hand.
            now_s: Any clock that does not jump.
            dt_s: Since the last time.
        """
        human = self._human(task)
        idea = human.answer(wanted_m_s * STEP_S, hand)
        h = self._correction @ idea
        h = h / max(1.0, float(np.linalg.norm(h)))
        keep = np.exp(-dt_s / _NOISE_S)
        shake = self.habits.motor_noise / np.sqrt(2.0) * float(np.linalg.norm(h))
        self._slip = keep * self._slip + np.sqrt(1.0 - keep**2) * shake * self.rng.standard_normal(
            2
        )
        h = h + self._slip
        h = h / max(1.0, float(np.linalg.norm(h)))
        self._look(human, hand, h, now_s)
        return np.asarray(h)

    def surprise(self) -> float:
        """How differently the hand moved from what their stick meant: 0 as meant, 1 opposite."""
        return float(np.mean(self.surprises)) if self.surprises else 0.5

    def _look(self, human: SimulatedHuman, hand: HandPose, h: np.ndarray, now_s: float) -> None:
        """Compare what came of the stick of a moment ago with what it was meant to do."""
        self._seen.append((now_s, hand, h))
        then_s, before, pushed = self._seen[0]
        if now_s - then_s < STEP_S:
            return
        self._seen.popleft()
        seconds = now_s - then_s
        change = human.task.dof_change(before, hand) / seconds * STEP_S
        length = float(np.linalg.norm(change))
        if length < _LEAST_M or float(np.linalg.norm(pushed)) < 0.1:
            return
        looks_like = human.answer(change, before)  # what they would have given for what came
        across = float(np.dot(looks_like, pushed))
        size = float(np.linalg.norm(looks_like) * np.linalg.norm(pushed))
        self.surprises.append(0.5 * (1.0 - across / max(size, 1e-9)))
        if self.habits.adapts:
            miss = pushed - self._correction @ looks_like
            power = float(looks_like @ looks_like) + 0.01
            self._correction += self.habits.adapts * np.outer(miss, looks_like) / power

    def _human(self, task: Task) -> SimulatedHuman:
        return SimulatedHuman(task, self.preference, np.full(2, FULL_STICK_M_S * STEP_S))
