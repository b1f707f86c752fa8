"""What the service says when it refuses: a status, a kind for programs, a sentence for people."""


class JoymapError(Exception):
    """Base of the service's refusals."""

    status_code = 400
    kind = "bad-request"

    def __init__(self, sentence: str) -> None:
        """Keep the sentence a person will read."""
        super().__init__(sentence)
        self.sentence = sentence


class UnknownLink(JoymapError):
    """A participant's link nobody was given (or that was withdrawn)."""

    status_code = 404
    kind = "unknown-link"

    def __init__(self) -> None:
        """Say no more than that the link is not known."""
        super().__init__("This link is not known here. Please check that it was copied whole.")


class UnknownQuery(JoymapError):
    """An answer to a query that is not this participant's."""

    status_code = 404
    kind = "unknown-query"

    def __init__(self) -> None:
        """Say it without telling whether somebody else has that query."""
        super().__init__("This question is not one of yours, so the answer was not kept.")


class WrongStep(JoymapError):
    """Something asked for before its time, or after it."""

    status_code = 409
    kind = "wrong-step"


class IdReused(JoymapError):
    """The same client-made id sent with other contents."""

    status_code = 409
    kind = "id-reused"

    def __init__(self) -> None:
        """Tell the client to make a new id."""
        super().__init__("This id was already used for something else; please send a new one.")


class NotAllowed(JoymapError):
    """A page for experimenters, asked for without their cookie."""

    status_code = 401
    kind = "not-allowed"

    def __init__(self) -> None:
        """Say how to get in."""
        super().__init__("Please log in, or open the experimenter link the server printed.")


class UsedSetupLink(JoymapError):
    """An experimenter link used before, or of an earlier start."""

    status_code = 404
    kind = "used-setup-link"

    def __init__(self) -> None:
        """Say where a fresh one comes from."""
        super().__init__(
            "This experimenter link was used already, or is of an earlier start; "
            "restart the server for a new one."
        )


class BodyTooLarge(JoymapError):
    """A request body over the limit."""

    status_code = 413
    kind = "body-too-large"

    def __init__(self, limit_bytes: int) -> None:
        """Say the limit."""
        super().__init__(f"This request is larger than {limit_bytes // 1024} KiB.")


class ForeignOrigin(JoymapError):
    """A websocket or a form from another site."""

    status_code = 403
    kind = "foreign-origin"

    def __init__(self) -> None:
        """Say why it was refused."""
        super().__init__("This connection comes from another site and was refused.")
