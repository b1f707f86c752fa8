"""What makes a protocol one that everybody can finish, beyond what its schema says.

Protocols that were kept before a rule was made stay as they are; the rules are for new ones.
"""

from collections.abc import Iterator

from app.schemas.protocol import Item, Protocol
from app.schemas.yaml_reader import Place
from app.services import counterbalancing, plan, questionnaires
from app.services.protocol_faults import look

Broken = tuple[Place, str]

# Sampled moves for each one to answer, so that enough of them can be shown: of a task's samples
# 42 % or more can be, and 15 % or more suit designed questions (every task, four pools of 1000).
_SAMPLES_A_LABEL = {"random": 5, "designed": 20}


def broken(protocol: Protocol) -> list[Broken]:
    """The place of everything that breaks a rule, and what to write instead."""
    found = [
        *_tasks(protocol),
        *_asked(protocol),
        *_own(protocol),
        *_completion(protocol),
    ]
    return found or list(_walk(protocol))


def _tasks(protocol: Protocol) -> Iterator[Broken]:
    for index, task in enumerate(protocol.tasks):
        least = _SAMPLES_A_LABEL[task.questions] * task.labels
        if task.unlabelled < least:
            yield (
                ("tasks", index, "unlabelled"),
                f"{task.labels} labels with {task.questions} questions need {least} sampled moves "
                f"to choose from; write at least {least} (not {task.unlabelled})",
            )


def _asked(protocol: Protocol) -> Iterator[Broken]:
    asked = protocol.questionnaires
    for where, names in asked.model_dump().items():
        place = ("questionnaires", where)
        for index, name in enumerate(names):
            if name in names[:index]:
                yield (*place, index), f"'{name}' is there twice in questionnaires.{where}"
            if questionnaires.find(protocol, name) is None:
                own = [each.name for each in protocol.own_questionnaires]
                yield (
                    (*place, index),
                    f"there is no questionnaire '{name}'; choose from "
                    f"{', '.join([*questionnaires.LIBRARY, *own])}, "
                    "or write your own under own_questionnaires",
                )
        if names and protocol.is_free:
            yield place, "who drives freely is asked nothing; leave the questionnaires out"


def _own(protocol: Protocol) -> Iterator[Broken]:
    for index, own in enumerate(protocol.own_questionnaires):
        place: Place = ("own_questionnaires", index)
        for number, item in enumerate(own.items):
            yield from _item(item, (*place, "items", number))


def _item(item: Item, place: Place) -> Iterator[Broken]:
    if item.kind == "scale" and (item.high - item.low) % item.step:
        last = item.high - (item.high - item.low) % item.step
        yield (
            (*place, "high"),
            f"from {item.low} in steps of {item.step} one does not come to {item.high}; "
            f"write {last} or {last + item.step}",
        )
    seen: dict[str, str] = {}
    for index, choice in enumerate(item.choices):
        before = seen.setdefault(look(choice), choice)
        if before is not choice:
            yield (*place, "choices", index), f"'{choice}' looks like the choice '{before}'"


def _completion(protocol: Protocol) -> Iterator[Broken]:
    url, code = protocol.completion.url, protocol.completion.code
    if url is not None and "{code}" in url and code is None:
        yield ("completion", "url"), "there is no completion.code to put for {code}"


def _walk(protocol: Protocol) -> Iterator[Broken]:
    """Every step of every order, to the last page."""
    for cell in range(len(counterbalancing.orders(protocol.order, protocol.strategies))):
        steps = plan.steps_of(protocol, cell)
        if len({step.key for step in steps}) < len(steps):
            yield (), "two of its steps are the same"
        if steps[-1].kind != ("driving" if protocol.is_free else "end"):
            yield (), "it has no end"
        for step in steps:
            if step.questionnaire is None:
                continue
            asked = questionnaires.find(protocol, step.questionnaire)
            for item in () if asked is None else asked.items:
                if not questionnaires.fits(item, _an_answer(item), len(protocol.strategies)):
                    yield (), f"nobody can answer '{item.key}' of '{step.questionnaire}'"


def _an_answer(item: Item) -> int | str:
    match item.kind:
        case "scale":
            return item.high
        case "choice":
            return item.choices[-1]
        case "strategy":
            return 1
        case "text":
            return ""
