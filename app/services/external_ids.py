"""What recruiting services call people: which names are somebody's, and when two are the same.

An id is kept in Unicode's composed form (NFC) without spaces around it, and compared letter by
letter: ``Anna`` and ``anna`` are two people, for services' ids differ by case.

It names somebody and proves nothing: see :func:`app.services.enrolment.join`.
"""

import re
import unicodedata

from app.errors import JoymapError

MAX_LENGTH = 200

# What links carry when a program had nothing to put there.
_NOBODY = {
    *("undefined", "null", "NULL", "None", "NaN", "nil", "[object Object]"),
    *("n/a", "N/A", "not available"),
}
# What they carry when nobody filled them in: Prolific's {{%PROLIFIC_PID%}}, Qualtrics' and MTurk's
# ${…}, SONA's %SURVEY_CODE%, MTurk's ASSIGNMENT_ID_NOT_AVAILABLE in a preview, and authors' own.
_UNFILLED = re.compile(
    r"""
      [{$\#]+\{?.*\}               # {{%PROLIFIC_PID%}}, ${e://Field/id}, #{id}, {id}
    | \[.*\] | <.*> | %.+% | @@.+@@ | __.+__
    | \$[A-Z_]\w+
    | (\w+_)?NOT_AVAILABLE
    | (your|insert)[_ -]?(\w+[_ -])?id([_ -]here)?
    """,
    re.VERBOSE | re.IGNORECASE | re.DOTALL,
)


class NobodysId(JoymapError):
    """An id that an experimenter gives somebody, and that cannot be anybody's."""

    status_code = 422
    kind = "nobodys-id"

    def __init__(self, given: str) -> None:
        """Say what was given."""
        super().__init__(
            f"'{given[:60]}' cannot be somebody's id: write letters or digits, at most "
            f"{MAX_LENGTH}, and no placeholder."
        )


class NoId(JoymapError):
    """A study that wants an id, and a link that brings none."""

    status_code = 422
    kind = "no-id"

    def __init__(self, given: str | None) -> None:
        """``given``: what the link brought in its place."""
        brought = "" if not given else f" (it says '{given[:60]}')"
        super().__init__(
            f"The link that brought you here does not say who you are{brought}. Please go back to "
            "where you found it and open it there again; if that does not help, tell the people "
            "who invited you."
        )


def read(given: str | None) -> str | None:
    """The id as it is kept and compared; None if this is nobody's."""
    if given is None or len(given) > MAX_LENGTH:
        return None
    text = unicodedata.normalize("NFC", given).strip()
    if not any(unicodedata.category(letter)[0] in "LN" for letter in text):
        return None
    if any(unicodedata.category(letter) in ("Cc", "Cs", "Cn", "Zl", "Zp") for letter in text):
        return None
    if text in _NOBODY or _UNFILLED.fullmatch(text):
        return None
    return text


def of_study(wanted: str, given: str | None) -> str | None:
    """The id that a study keeps of somebody who comes with this one.

    Args:
        wanted: ``required``, ``optional`` or ``none``, as the protocol says.
        given: What their link brought.

    Raises:
        NoId: If one is required and this is none.
    """
    if wanted == "none":
        return None
    found = read(given)
    if found is None and wanted == "required":
        raise NoId(given)
    return found
