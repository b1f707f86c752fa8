"""What comes of parts, without driving; workers import it by name."""

from app.rehearsal.participant import Drove, Part

FIRST = Part("avoid", ("all-priors", "no-priors"), 7)


def take_at_once(part: Part) -> tuple[Drove, ...]:
    """Better under the first by time, no two people alike; worse by path."""
    number = part.number
    return (
        Drove(True, 10.0 + 0.1 * number, 3.0 + 0.2 * number, 0.1),
        Drove(number > 0, 20.0 + 0.3 * number, 2.0, 0.1),
    )


def refuse(part: Part) -> tuple[Drove, ...]:
    """Nobody should be asked."""
    raise AssertionError(part)
