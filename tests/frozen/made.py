"""Where the frozen things lie, and which code made them."""

from pathlib import Path

HERE = Path(__file__).resolve().parent
COMMIT = "74d210e"
MADE = HERE / f"made_by_{COMMIT}"

DATA = MADE / "data_directory.zip"
EXPORT = MADE / "export.zip"
FIGURES = MADE / "figures"
ANSWERS = MADE / "api.json.gz"
LEARNING = MADE / "learning"
SIMULATION = MADE / "simulation"

# The loop's rate of the study: slow, so that drives take few ticks.
RATE_HZ = 10.0
# The owner's account in the study's database.
OWNER = {"name": "owner", "password": "correct horse"}


def study_addresses(
    study: str, people: list[str], drives: list[str], moves: list[str]
) -> list[str]:
    """What the dashboard asks for a study, under ``/api/v1``."""
    return [
        "me",
        "accounts",
        "tokens",
        "studies",
        f"studies/{study}",
        f"studies/{study}/participants",
        *(f"participants/{each}" for each in people),
        *(f"participants/{each}/drives" for each in people),
        *(f"drives/{each}" for each in drives),
        *(f"moves/{each}" for each in moves),
    ]
