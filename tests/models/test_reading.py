"""What is understood of a person, against Gaussian regression written out in real numbers."""

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.distance import cdist
from scipy.stats import multivariate_normal

from models.reading import Evidence, nearness, search, understand, wish

# What the forms cost beforehand, in nats, by the standard deviation that they allow.
SKEW_COSTS = {0.02: 0.0, 0.2: 3.0}
DRIFT_COSTS = {0.0: 0.0, 0.15: 3.0, 0.4: 5.0}
POLAR_COST = 2.0
NOISES = (0.002, 0.005, 0.012, 0.03, 0.05, 0.08, 0.12, 0.18, 0.27, 0.4, 0.6)
EXPONENTS = (0.6, 1.0, 1.5)
BLUR = 0.05
LENGTH_M = 0.2


def curve_cost(exponent):
    return 0.0 if exponent == 1.0 else 4.0 + 0.5 * (np.log(exponent) / 0.5) ** 2


def seen(k=12, seed=0, motions=1):
    """Moves of all directions over a workspace, as yet unanswered."""
    rng = np.random.default_rng(seed)
    u = rng.uniform(0.2, 0.9, k) * np.exp(1j * rng.uniform(0.0, 2 * np.pi, k))
    return Evidence(
        u=u,
        h=np.zeros_like(u),
        azimuth=rng.uniform(-0.8, 0.8, k),
        motion=np.arange(k) % motions,
        place=rng.uniform(-0.25, 0.25, (k, 2)),
    )


def answered(evidence, c=1.0, d=0.0, exponent=1.0, is_polar=False, noise=0.05, drift=None, seed=1):
    """The same moves with the sticks of somebody who turns by ``c`` and mirrors by ``d``."""
    rng = np.random.default_rng(seed)
    u = evidence.u * np.exp(-1j * evidence.azimuth) if is_polar else evidence.u
    c = c if drift is None else c * np.exp(1j * drift * evidence.place[:, 0])
    v = c * u + d * u.conj()
    h = v * np.abs(v) ** (exponent - 1.0)
    deviate = rng.standard_normal((2, len(h))) / np.sqrt(2.0)
    return replace(evidence, h=h * (1.0 + noise * (deviate[0] + 1j * deviate[1])))


TURN = np.exp(0.7j)
PEOPLE = {
    "straight": answered(seen(), c=0.8 * TURN, noise=0.2),
    "mirrored": answered(seen(), c=0.0, d=TURN),
    "curved": answered(seen(), c=TURN, exponent=0.6, noise=0.02),
    "curved the other way": answered(seen(), c=TURN, exponent=1.5, noise=0.02),
    "polar": answered(seen(), c=0.0, d=TURN, is_polar=True),
    "skewed": answered(seen(24), c=TURN, d=0.3j, noise=0.01),
    "drifting a little": answered(seen(24), c=TURN, noise=0.01, drift=1.0),
    "drifting": answered(seen(24), c=TURN, noise=0.01, drift=6.0),
    "in two motions": replace(
        seen(motions=2),
        h=np.where(
            np.arange(12) % 2, answered(seen(), c=0.0, d=TURN).h, answered(seen(), c=TURN).h
        ),
    ),
}


def motions_of(evidence):
    return int(evidence.motion.max()) + 1


def unbent(h, exponent):
    return h * np.abs(h) ** (1.0 / exponent - 1.0)


def log_slope(h, exponent):
    """Logarithm of how much larger a small area round ``h`` gets when it is unbent."""
    right, up = (
        (unbent(h + step, exponent) - unbent(h - step, exponent)) / 2e-6 for step in (1e-6, 1e-6j)
    )
    return np.log(np.abs(right.real * up.imag - right.imag * up.real))


def rows_of(evidence, motion, is_polar, exponent):
    """Moves and sticks of a motion with even noise, in real numbers, ``(k, 2)`` each."""
    here = evidence.motion == motion
    u = evidence.u[here] * np.exp(-1j * evidence.azimuth[here] * is_polar)
    length = np.sqrt(np.abs(u) ** 2 + BLUR**2)
    y = unbent(evidence.h[here], exponent) / length
    f = u / length
    return np.stack([f.real, f.imag], axis=1), np.stack([y.real, y.imag], axis=1)


def parts(f):
    """What each real part of c and d adds to the answers: ``(4, 2 k, k)``."""
    x, y = np.diag(f[:, 0]), np.diag(f[:, 1])
    return np.stack([np.concatenate(pair) for pair in ((x, y), (-y, x), (x, -y), (y, x))])


def variances(is_mirrored, skew):
    greater, lesser = 0.5, 0.5 * skew**2  # each of the real parts has half
    return (lesser, lesser, greater, greater) if is_mirrored else (greater, greater, lesser, lesser)


def covariance(f, place, g, there, is_mirrored, skew, drift):
    """Of answers for ``f`` at ``place`` with those for ``g`` at ``there``, ``(2 k, 2 m)``."""
    near = 0.5 * drift**2 * np.exp(-0.5 * (cdist(place, there) / LENGTH_M) ** 2)
    return sum(
        one @ (variance + near) @ other.T
        for one, other, variance in zip(
            parts(f), parts(g), variances(is_mirrored, skew), strict=True
        )
    )


def scores_of(evidence, is_polar, exponent, skew, drift):
    """How likely the sticks are, less what the forms cost, and who is mirrored; by noise."""
    given = log_slope(evidence.h, exponent).sum()
    given -= curve_cost(exponent) + SKEW_COSTS[skew] + DRIFT_COSTS[drift] + POLAR_COST * is_polar
    total, mirrored = np.full(len(NOISES), given), []
    for motion in range(motions_of(evidence)):
        f, y = rows_of(evidence, motion, is_polar, exponent)
        place = evidence.place[evidence.motion == motion]
        scale = np.median(np.linalg.norm(y, axis=1))
        straight, mirror = (
            [
                multivariate_normal.logpdf(
                    y.T.ravel(), cov=scale**2 * (spread + 0.5 * noise**2 * np.eye(len(spread)))
                )
                for noise in NOISES
            ]
            for spread in (
                covariance(f, place, f, place, is_mirrored, skew, drift)
                for is_mirrored in (False, True)
            )
        )
        mirrored.append(np.greater(mirror, straight))
        total += np.logaddexp(straight, mirror)
    return total, np.array(mirrored)


@pytest.mark.parametrize(
    ("person", "is_polar"), [*((person, False) for person in PEOPLE), ("polar", True)]
)
def test_the_reading_is_the_likeliest_after_its_cost(person, is_polar):
    evidence = PEOPLE[person]
    best: tuple[Any, Any, Any] = -np.inf, None, None
    for forms in product(EXPONENTS, SKEW_COSTS, DRIFT_COSTS):
        scores, mirrored = scores_of(evidence, is_polar, *forms)
        at = int(np.argmax(scores))
        if scores[at] > best[0]:
            best = scores[at], (*forms, NOISES[at]), tuple(mirrored[:, at])
    score, (reading, mirrored) = search(
        evidence, motions_of(evidence), is_polar, np.array(EXPONENTS)
    )
    assert score == pytest.approx(best[0], abs=1e-5)
    assert (reading.exponent, reading.skew, reading.drift, reading.noise) == best[1]
    assert (reading.is_polar, mirrored) == (is_polar, best[2])


@pytest.mark.parametrize("person", ["straight", "skewed", "drifting", "in two motions", "polar"])
def test_the_maps_are_the_regression_of_the_answers(person):
    evidence = PEOPLE[person]
    motions = motions_of(evidence)
    places = [np.random.default_rng(3).uniform(-0.3, 0.3, (5, 2)) for _ in range(motions)]
    understanding = understand(evidence, places)
    reading = understanding.reading
    assert not understanding.doubtful
    for motion, there in enumerate(places):
        motion_map = understanding.maps[motion]
        forms = motion_map.is_mirrored, reading.skew, reading.drift
        f, y = rows_of(evidence, motion, reading.is_polar, reading.exponent)
        place = evidence.place[evidence.motion == motion]
        gram = covariance(f, place, f, place, *forms)
        gram += 0.5 * reading.noise**2 * np.eye(len(gram))
        c, d = motion_map.at(there)
        lost = 0.0
        for side, expected in (((1.0, 0.0), c + d), ((0.0, 1.0), 1j * (c - d))):
            g = np.tile(side, (5, 1))
            cross = covariance(g, there, f, place, *forms)
            answer = cross @ np.linalg.solve(gram, y.T.ravel())
            assert_allclose(answer[:5] + 1j * answer[5:], expected, atol=1e-8)
            left = covariance(g, there, g, there, *forms) - cross @ np.linalg.solve(gram, cross.T)
            lost += 0.5 * np.trace(left) / 5
        assert motion_map.spread == pytest.approx(np.sqrt(lost), rel=1e-6)


@pytest.mark.parametrize("person", PEOPLE)
def test_a_wish_is_the_move_that_was_answered_with_that_stick(person):
    evidence = PEOPLE[person]
    motions = motions_of(evidence)
    understanding = understand(evidence, [evidence.place[:0]] * motions)
    h = np.random.default_rng(4).uniform(-0.6, 0.6, (12, 2))
    at = evidence.at(np.arange(12))
    moves = wish(understanding, h, at.place, at.motion, at.azimuth)
    u = moves[:, 0] + 1j * moves[:, 1]
    if understanding.reading.is_polar:
        u = u * np.exp(-1j * at.azimuth)
    for motion, motion_map in enumerate(understanding.maps):
        here = at.motion == motion
        c, d = motion_map.at(at.place[here])
        v = c * u[here] + d * u[here].conj()
        answer = v * np.abs(v) ** (understanding.reading.exponent - 1.0)
        assert_allclose(answer, h[here, 0] + 1j * h[here, 1], atol=1e-8)


def test_an_exponent_between_those_of_the_list_is_found():
    for exponent in (0.55, 0.87, 1.37, 1.9):
        found = understand(
            answered(seen(), c=TURN, exponent=exponent, noise=0.002), [np.zeros((1, 2))]
        )
        assert found.reading.exponent == pytest.approx(exponent, rel=5e-3)


def test_where_the_map_loses_a_direction_a_wish_stays_finite():
    flat = understand(answered(seen(), c=TURN, noise=0.0), [np.zeros((1, 2))])
    c = np.zeros_like(flat.maps[0].c)
    c[0] = 1.0
    lost = replace(flat, maps=(replace(flat.maps[0], c=c, d=c),))
    moves = wish(lost, np.array([[0.0, 1.0]]), np.zeros((1, 2)), np.zeros(1, int), np.zeros(1))
    assert_allclose(moves, [[0.0, 40.0]])  # twice over the twentieth that is left
    nothing = replace(flat, maps=(replace(flat.maps[0], c=0.0 * c, d=0.0 * c),))
    moves = wish(nothing, np.array([[0.0, 1.0]]), np.zeros((1, 2)), np.zeros(1, int), np.zeros(1))
    assert np.isfinite(moves).all()


@pytest.mark.parametrize("form", [{}, {"is_polar": True}, {"c": 0.0, "d": TURN}])
@pytest.mark.parametrize("wrong", [(0,), (3, 7), (1, 5, 9)])
def test_answers_that_point_elsewhere_are_named(form, wrong):
    evidence = answered(seen(10), **{"c": TURN, "noise": 0.05} | form)
    h = evidence.h.copy()
    h[list(wrong)] *= np.exp(1j * np.array([2.0, -1.8, 3.0])[: len(wrong)])
    assert understand(replace(evidence, h=h), [np.zeros((1, 2))]).doubtful == wrong


def test_an_answer_is_wrong_from_75_degrees_on():
    for off, doubtful in ((1.2, ()), (1.4, (4,)), (-1.2, ()), (-1.4, (4,))):
        evidence = answered(seen(12), c=TURN, noise=0.0)
        h = evidence.h.copy()
        h[4] *= np.exp(1j * off)
        found = understand(replace(evidence, h=h), [np.zeros((1, 2))])
        assert found.doubtful == doubtful


def test_three_answers_are_too_few_to_call_one_wrong():
    evidence = answered(seen(3), c=TURN, noise=0.0)
    h = evidence.h * np.exp(2j * np.array([0.0, 1.0, 0.0]))
    assert not understand(replace(evidence, h=h), [np.zeros((1, 2))]).doubtful


def test_places_are_alike_by_how_near_they_are():
    places = np.array([[0.0, 0.0], [0.2, 0.0], [0.12, -0.16], [0.0, 0.4]])
    expected = np.exp([0.0, -0.5, -0.5, -2.0])
    assert_allclose(nearness(places, places[:1])[:, 0], expected)
    assert nearness(places[None], places).shape == (1, 4, 4)


def test_noisy_people_are_rarely_taken_for_polar():
    """One in twenty at most, of 400 who answer seven moves with noise of half their length.

    Were the form free, one in twelve would be: it can bend to fit some of the noise.
    """
    taken = 0
    for seed in range(400):
        turn = np.exp(2j * np.pi * seed / 400)
        form = {"c": turn} if seed % 2 else {"c": 0.0, "d": turn}
        evidence = answered(seen(7, seed=seed), noise=0.5, seed=1000 + seed, **form)
        taken += understand(evidence, [np.zeros((1, 2))]).reading.is_polar
    assert taken <= 20
