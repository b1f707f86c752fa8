"""Every knob of the service, read once from the environment (``JOYMAP_…``)."""

from pathlib import Path
from typing import Literal

from pydantic import Field, FiniteFloat, PositiveInt
from pydantic_settings import BaseSettings, SettingsConfigDict

ROOT = Path(__file__).resolve().parents[1]
STATIC_DIR = ROOT / "static"
MIGRATIONS_DIR = ROOT / "migrations"


class Settings(BaseSettings):
    """How this server runs. Units are in the names; there are no secrets to set."""

    model_config = SettingsConfigDict(env_prefix="JOYMAP_", extra="forbid")

    host: str = Field(default="127.0.0.1", description="Address to listen on.")
    port: int = Field(default=8000, ge=0, le=65535, description="Port to listen on.")
    public_url: str | None = Field(
        default=None,
        description="Address people open, where it differs, such as https://lab.example.",
    )
    data_dir: Path = Field(
        default=ROOT / "data", description="Database, weights and the arm's pack."
    )
    panda_dir: Path | None = Field(
        default=None, description="The arm's asset pack; by default the folder panda in data_dir."
    )
    task: str = Field(
        default="plane", description="The task that new participants label and drive."
    )
    drive_limit_s: FiniteFloat | None = Field(
        default=None,
        description="A drive of a task that has an end is over after this long, in seconds.",
    )
    drive_waits_s: FiniteFloat = Field(
        default=5.0,
        description="A drive whose page is gone waits so long for it to come back, in seconds.",
    )
    auto_grasp: bool = Field(
        default=False, description="The hand grasps by itself once it is where it can."
    )
    arrows: Literal["off", "on", "switch"] = Field(
        default="switch",
        description="Arrows at the hand show where each stick direction would lead: never, always, "
        "or as the person likes, off at first.",
    )
    labels_wanted: PositiveInt = Field(
        default=7, description="Labelled moves before training starts; at most so many if designed."
    )
    queries: Literal["random", "designed"] = Field(
        default="random",
        description="Moves to label: drawn at random, or chosen so that few suffice.",
    )
    enough_error: FiniteFloat = Field(
        default=0.1,
        description="With designed queries, labels are enough once the expected error of a move, "
        "over its length, is below this.",
    )
    practice_s: FiniteFloat = Field(
        default=60.0, description="Time offered to practise, in seconds."
    )
    teleop_rate_hz: FiniteFloat = Field(
        default=60.0, ge=1.0, le=1000.0, description="Ticks of the control loop a second."
    )
    speed: float = Field(
        default=1.0,
        ge=0.1,
        le=20.0,
        description="How much faster than real the arm's time goes: for simulated participants.",
    )
    same_strategy: str | None = Field(
        default=None,
        description="Everybody drives under this strategy, whatever theirs is called: a study that "
        "should find no difference (an A/A test).",
    )
    silence_s: FiniteFloat = Field(
        default=0.25,
        gt=0.0,
        le=10.0,
        description="A stick not heard of for this long lets the arm hold, in seconds.",
    )
    record_chunk_s: FiniteFloat = Field(
        default=0.5,
        gt=0.0,
        le=60.0,
        description="Samples of a drive are stored at least this often, in seconds.",
    )
    session_idle_s: FiniteFloat = Field(
        default=60.0,
        gt=0.0,
        le=86_400.0,
        description="A scene nobody looks at is closed after this long, in seconds.",
    )
    training_workers: PositiveInt = Field(
        default=1, le=64, description="Processes that train alignments."
    )
    training_steps: PositiveInt | None = Field(
        default=None,
        le=10_000_000,
        description="Steps of the optimiser; by default the learning core's own.",
    )
    unlabelled_states: PositiveInt = Field(default=1000, description="N of the paper's Step 4.")
    max_body_bytes: PositiveInt = Field(
        default=1 << 20, le=1 << 30, description="Largest request body, in bytes."
    )
    max_message_bytes: PositiveInt = Field(
        default=1 << 14, le=1 << 30, description="Largest websocket message from a page, in bytes."
    )

    @property
    def pack_dir(self) -> Path:
        """Where the arm's asset pack lies."""
        return self.panda_dir if self.panda_dir is not None else self.data_dir / "panda"

    @property
    def database_path(self) -> Path:
        """The SQLite file."""
        return self.data_dir / "joymap.db"

    @property
    def base_url(self) -> str:
        """What links begin with, without a slash at the end."""
        return (self.public_url or f"http://{self.host}:{self.port}").rstrip("/")
