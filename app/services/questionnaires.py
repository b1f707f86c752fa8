"""The library of questionnaires, by name; a study may bring its own in the same form."""

from app.schemas.protocol import Item, Questionnaire


def _agree(key: str, text: str) -> Item:
    return Item(
        key=key, kind="scale", text=text, low_label="strongly disagree", high_label="strongly agree"
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

LIBRARY = {each.name: each for each in (STEERING, PREFERENCE)}
