"""A model of a person with a stick: a private idea of what it does, delay, noise, and doubt.

The person wants the hand to move in some way and gives the stick that, by their idea, does it.
What they see is a reaction time old, and they know it: they forecast where the hand is by now
from what they pushed since, and trust the forecast as far as it lately came true (a forward model
that bridges the delay: Miall, Weir, Wolpert and Stein, "Is the cerebellum a Smith predictor?",
Journal of Motor Behavior 1993). Their hand shakes the more the farther they push (signal-
dependent noise: Harris and Wolpert, "Signal-dependent noise determines motor planning", Nature
1998). When they see the hand get no closer to where they want it, they take it back (they believe
that the opposite push undoes a push: the paper's reversibility) and then try some other
direction. Who adapts compares what came of their stick with what it was to do, and bends their
idea towards what they see: a step of normalised least mean squares, as trial-by-trial studies of
motor adaptation find it (Thoroughman and Shadmehr, "Learning of action through adaptive
combination of motor primitives", Nature 2000).
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from models.demonstrations import DT_S
from models.kinematics import HandPose
from models.preferences import Preference
from models.simulated_human import SimulatedHuman
from models.tasks import Task

FULL_STICK_M_S = 0.2  # how fast they expect the hand to be at full stick
STEP_S = DT_S  # how they think of speed: a step
_NOISE_S = 0.2  # how long a slip of the hand lasts
_LEAST_M = 1e-3  # who sees less than this move in a step learns nothing from it
_DOUBT_S = 0.5  # for how long something looks wrong before they do something about it
_LITTLE = 0.1  # of the way that they expected is as good as none
ADAPTS = 0.02  # of those who adapt: see Habits.adapts
_PUSHED = 0.5  # whoever pushes less than this expects little


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
class _Moment:
    """What was seen and done at one time."""

    at_s: float
    hand: HandPose
    wanted: np.ndarray
    h: np.ndarray
    expected: np.ndarray  # how fast they believe that the hand goes by it


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
    _past: deque[_Moment] = field(default_factory=deque, init=False)
    _trust: float = field(default=1.0, init=False)  # in their forecast, from 0 to 1
    _instead: tuple[np.ndarray, np.ndarray] = field(init=False)
    _until_s: float = field(default=-np.inf, init=False)

    def begin(self) -> None:
        """A new way of steering: expect their own idea, and be surprised anew."""
        self.surprises, self._correction, self._trust = [], np.eye(2), 1.0
        self.pause()

    def pause(self) -> None:
        """A new attempt: what was seen before it says nothing of what comes."""
        self._past.clear()
        self._slip = np.zeros(2)
        self._until_s = -np.inf

    def label(self, task: Task, before: HandPose, after: HandPose, steps: int) -> np.ndarray:
        """The stick ``(2,)`` they would give for a move of so many steps of 0.1 s."""
        human = self._human(task)
        h = human.answer(task.dof_change(before, after) / steps, before)
        length = float(np.linalg.norm(h))
        h = h + self.habits.label_noise / np.sqrt(2.0) * length * self.rng.standard_normal(2)
        return _in_reach(h)

    def push(
        self,
        task: Task,
        wish: Callable[[HandPose], np.ndarray],
        hand: HandPose,
        now_s: float,
        dt_s: float,
    ) -> np.ndarray:
        """The stick ``(2,)`` they give to make the hand go as they want.

        Args:
            task: Whose degrees of freedom they think in.
            wish: Where they want a hand to go from somewhere, ``(2,)`` in [m/s].
            hand: Where they see the hand, which is where it was a reaction time ago.
            now_s: Any clock that does not jump.
            dt_s: Since the last time.
        """
        human = self._human(task)
        self._look(human, hand, now_s)
        wanted = wish(task.moved(hand, self._forecast(now_s)))
        if now_s < self._until_s:
            back, elsewhere = self._instead
            h = back if self._until_s - now_s > _DOUBT_S else elsewhere
        else:
            h = _in_reach(self._correction @ human.answer(wanted * STEP_S, hand))
        h = _in_reach(h + self._shake(h, dt_s))
        meant = np.linalg.pinv(self._correction) @ h if self.habits.adapts else h
        expected = human.wish(meant, hand) / STEP_S
        self._past.append(_Moment(now_s, hand, wanted, h, expected))
        return h

    def surprise(self) -> float:
        """How differently the hand moved from what their stick meant: 0 as meant, 1 opposite."""
        return float(np.mean(self.surprises)) if self.surprises else 0.5

    def _shake(self, h: np.ndarray, dt_s: float) -> np.ndarray:
        keep = np.exp(-dt_s / _NOISE_S)
        shake = self.habits.motor_noise / np.sqrt(2.0) * float(np.linalg.norm(h))
        slip = np.sqrt(1.0 - keep**2) * shake * self.rng.standard_normal(2)
        self._slip = keep * self._slip + slip
        return self._slip

    def _forecast(self, now_s: float) -> np.ndarray:
        """How far they believe that the hand got since it was as they see it, ``(2,)`` in [m]."""
        delay_s = self.habits.reaction_s
        expected = [each.expected for each in self._past if now_s - each.at_s <= delay_s]
        if not expected:
            return np.zeros(2)
        way: np.ndarray = self._trust * delay_s * np.mean(expected, axis=0)
        return way

    def _look(self, human: SimulatedHuman, hand: HandPose, now_s: float) -> None:
        """Compare what is seen to have come of the stick with what it was meant to do.

        What is seen now came of what was pushed a reaction time ago, and people know that.
        """
        past, delay_s = self._past, self.habits.reaction_s
        while past and now_s - past[0].at_s > delay_s + _DOUBT_S + STEP_S:
            past.popleft()
        step = [each for each in past if now_s - each.at_s >= STEP_S]
        done = [each for each in past if delay_s <= now_s - each.at_s <= delay_s + STEP_S]
        if step and done:
            self._learn(human, step[-1], hand, now_s, np.mean([each.h for each in done], axis=0))
        doubt = [each for each in past if now_s - each.at_s >= _DOUBT_S]
        done = [each for each in past if delay_s <= now_s - each.at_s <= delay_s + _DOUBT_S]
        if doubt and done:
            came = human.task.dof_change(doubt[-1].hand, hand)
            self._weigh(came, done)
            if now_s >= self._until_s + delay_s + _DOUBT_S:
                self._doubt(came, done, now_s)

    def _weigh(self, came: np.ndarray, done: list[_Moment]) -> None:
        """Trust the forecast as far as it came true over the last half second."""
        expected = _DOUBT_S * np.mean([each.expected for each in done], axis=0)
        size = float(expected @ expected)
        if size > (_LITTLE * FULL_STICK_M_S * _DOUBT_S) ** 2:
            self._trust = float(np.clip(came @ expected / size, 0.0, 1.0))

    def _learn(
        self, human: SimulatedHuman, then: _Moment, hand: HandPose, now_s: float, pushed: np.ndarray
    ) -> None:
        seconds = now_s - then.at_s
        change = human.task.dof_change(then.hand, hand) / seconds * STEP_S
        if float(np.linalg.norm(change)) < _LEAST_M or float(np.linalg.norm(pushed)) < 0.1:
            return
        looks_like = human.answer(change, then.hand)  # what they would have given for what came
        self.surprises.append(0.5 * (1.0 - _cosine(looks_like, pushed)))
        if self.habits.adapts:
            miss = pushed - self._correction @ looks_like
            power = float(looks_like @ looks_like) + 0.01
            self._correction += self.habits.adapts * np.outer(miss, looks_like) / power

    def _doubt(self, came: np.ndarray, done: list[_Moment], now_s: float) -> None:
        """Where hardly any way is made, take it back, and then try something else."""
        pushed = np.mean([each.h for each in done], axis=0)
        wanted = np.mean([each.wanted for each in done], axis=0)
        expected_m = FULL_STICK_M_S * _DOUBT_S * float(np.linalg.norm(pushed))
        if float(np.linalg.norm(pushed)) < _PUSHED or not wanted.any():
            return
        way_m = float(came @ wanted) / float(np.linalg.norm(wanted))
        if way_m < _LITTLE * expected_m:
            angle = self.rng.uniform(0.0, 2.0 * np.pi)
            self._instead = (-pushed, np.array([np.cos(angle), np.sin(angle)]))
            self._until_s = now_s + 2 * _DOUBT_S

    def _human(self, task: Task) -> SimulatedHuman:
        return SimulatedHuman(task, self.preference, np.full(2, FULL_STICK_M_S * STEP_S))


def _in_reach(h: np.ndarray) -> np.ndarray:
    return np.asarray(h / max(1.0, float(np.linalg.norm(h))))


def _cosine(first: np.ndarray, second: np.ndarray) -> float:
    size = float(np.linalg.norm(first) * np.linalg.norm(second))
    return float(np.dot(first, second)) / max(size, 1e-9)
