"""The library of questionnaires, by name; a study may bring its own in the same form."""

from collections.abc import Mapping

from app.schemas.protocol import Item, Protocol, Questionnaire


def _agree(key: str, text: str, high: int = 7) -> Item:
    return Item(
        key=key,
        kind="scale",
        text=text,
        high=high,
        low_label="strongly disagree",
        high_label="strongly agree",
    )


def _load(key: str, text: str, low_label: str = "very low", high_label: str = "very high") -> Item:
    return Item(
        key=key,
        kind="scale",
        text=text,
        low=0,
        high=100,
        step=5,
        low_label=low_label,
        high_label=high_label,
    )


# What the paper asks after each strategy (Sec. "User Studies"); its wording is not published.
STEERING = Questionnaire(
    name="steering",
    title="How was it to steer like this?",
    items=(
        _agree("intuitive", "The arm moved as I expected when I pushed the stick."),
        _agree("easy", "It was easy to make the arm do what I wanted."),
        _agree("undo", "When something went wrong I could easily take it back."),
        _agree("consistent", "The same push did the same wherever the arm was."),
        _agree("proportional", "A small push made a small move, and a large push a large one."),
        _agree("again", "I would like to steer like this again."),
    ),
)

PREFERENCE = Questionnaire(
    name="preference",
    title="Which way of steering was best?",
    items=(
        Item(key="best", kind="strategy", text="Which way of steering did you like best?"),
        Item(key="why", kind="text", text="What made you choose it?"),
    ),
)

# Hart and Staveland 1988, "Development of NASA-TLX", with the words of NASA's paper form and its
# 21 marks; raw, without the weighing of pairs (Hart 2006, "NASA-Task Load Index; 20 years later").
NASA_TLX = Questionnaire(
    name="nasa-tlx",
    title="How demanding was it?",
    intro="Choose the mark that says best how it was for you.",
    items=(
        _load("mental", "How mentally demanding was the task?"),
        _load("physical", "How physically demanding was the task?"),
        _load("temporal", "How hurried or rushed was the pace of the task?"),
        _load(
            "performance",
            "How successful were you in accomplishing what you were asked to do?",
            "perfect",
            "failure",
        ),
        _load("effort", "How hard did you have to work to accomplish your level of performance?"),
        _load(
            "frustration",
            "How insecure, discouraged, irritated, stressed, and annoyed were you?",
        ),
    ),
)

# Brooke 1996, "SUS: A 'quick and dirty' usability scale"; its ten items word for word.
SUS = Questionnaire(
    name="sus",
    title="How usable is this system?",
    items=tuple(
        _agree(f"sus-{number}", text, high=5)
        for number, text in enumerate(
            (
                "I think that I would like to use this system frequently.",
                "I found the system unnecessarily complex.",
                "I thought the system was easy to use.",
                "I think that I would need the support of a technical person to be able to use "
                "this system.",
                "I found the various functions in this system were well integrated.",
                "I thought there was too much inconsistency in this system.",
                "I would imagine that most people would learn to use this system very quickly.",
                "I found the system very cumbersome to use.",
                "I felt very confident using the system.",
                "I needed to learn a lot of things before I could get going with this system.",
            ),
            start=1,
        )
    ),
)

COMMENTS = Questionnaire(
    name="comments",
    title="Is there anything else?",
    items=(Item(key="comments", kind="text", text="What else would you like to tell us?"),),
)

LIBRARY = {each.name: each for each in (STEERING, PREFERENCE, NASA_TLX, SUS, COMMENTS)}


def find(protocol: Protocol, name: str) -> Questionnaire | None:
    """One of the protocol's own questionnaires, or one of the library's."""
    own = {each.name: each for each in protocol.own_questionnaires}
    return own.get(name) or LIBRARY.get(name)


def fits(item: Item, value: int | str, ways: int) -> bool:
    """Whether an item can be answered with this, where so many ways of steering were tried."""
    match item.kind:
        case "scale":
            is_number = isinstance(value, int) and item.low <= value <= item.high
            return is_number and (int(value) - item.low) % item.step == 0
        case "choice":
            return value in item.choices
        case "strategy":
            return isinstance(value, int) and 1 <= value <= ways
        case "text":
            return isinstance(value, str)


def score(questionnaire: str, values: Mapping[str, int | str | None]) -> dict[str, float]:
    """The published scores of a questionnaire that was filled in.

    Args:
        questionnaire: Its name in the library.
        values: What was said to each item, by the item's key; None: declined.

    Returns:
        ``{"tlx_raw": …}`` from 0 (no load) to 100: the mean of the six scales, without weights.
        ``{"sus": …}`` from 0 to 100 (best): what each item gives towards "good", 0 to 4, added up
        and times 2.5. Nothing for a questionnaire without a published score, nor where an item was
        declined or is missing: neither source says how to do without one.

    Source: Hart 2006 (raw TLX); Brooke 1996 (SUS).
    """
    if questionnaire not in (NASA_TLX.name, SUS.name):
        return {}
    given = [values.get(item.key) for item in LIBRARY[questionnaire].items]
    numbers = [value for value in given if isinstance(value, int)]
    if len(numbers) < len(given):
        return {}
    if questionnaire == NASA_TLX.name:
        return {"tlx_raw": sum(numbers) / len(numbers)}
    # The items say something good and something bad in turn.
    good = [value - 1 if index % 2 == 0 else 5 - value for index, value in enumerate(numbers)]
    return {"sus": 2.5 * sum(good)}
