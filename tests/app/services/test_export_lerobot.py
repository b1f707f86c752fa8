"""The drives of an export as LeRobot reads them."""

import io
import json
import zipfile

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from app.analysis.codebook import TABLES
from app.storage.database import Database
from tests.app.exported import EPISODES, TICKS, drive, export_of, lines_of, make_whole_study, sheet
from tests.app.factories import enrol, make_study


@pytest.fixture
def study_id(database: Database) -> str:
    with database.write() as db:
        return make_whole_study(db)


@pytest.fixture
def export(database: Database, study_id: str) -> zipfile.ZipFile:
    return export_of(database, study_id)


def test_drives_are_a_lerobot_dataset(export: zipfile.ZipFile) -> None:
    info = json.loads(export.read("lerobot/meta/info.json"))
    assert (info["codebase_version"], info["fps"], info["video_path"]) == ("v3.0", 60, None)
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (6, 6 * TICKS, 2)
    assert info["splits"] == {"train": "0:6"}
    place = {"chunk_index": 0, "file_index": 0}
    data = pq.ParquetFile(io.BytesIO(export.read(f"lerobot/{info['data_path'].format(**place)}")))
    assert data.num_row_groups == 6
    table = data.read()
    assert table.schema.names == list(info["features"])
    for name, feature in info["features"].items():
        (size,) = feature["shape"]
        kind = pa.list_(pa.float32(), size) if size > 1 else getattr(pa, feature["dtype"])()
        assert table.schema.field(name).type == kind
        assert feature["names"] is None or len(feature["names"]) == size
    assert table["index"].to_pylist() == list(range(6 * TICKS))
    episodes = pq.read_table(io.BytesIO(export.read(EPISODES))).to_pylist()
    frames = table.to_pandas()
    tasks = pd.read_parquet(io.BytesIO(export.read("lerobot/meta/tasks.parquet")))
    for number, episode in enumerate(episodes):
        part = frames[episode["dataset_from_index"] : episode["dataset_to_index"]]
        assert set(part["episode_index"]) == {number} == {episode["episode_index"]}
        assert part["frame_index"].tolist() == list(range(episode["length"]))
        assert part["timestamp"].tolist() == pytest.approx(np.arange(TICKS) / 60)
        (task,) = set(part["task_index"])
        assert episode["tasks"] == [tasks.index[task]]
        assert tasks.loc[episode["tasks"][0]].task_index == task
        actions = np.stack(part["action"])
        assert episode["stats/action/mean"] == pytest.approx(actions.mean(axis=0), abs=1e-5)
        assert episode["stats/action/count"] == [TICKS]
    stats = json.loads(export.read("lerobot/meta/stats.json"))
    states = np.stack(frames["observation.state"])
    for name, wanted in (("mean", states.mean(0)), ("std", states.std(0)), ("max", states.max(0))):
        assert stats["observation.state"][name] == pytest.approx(wanted, abs=1e-5)
    assert set(stats) == set(info["features"])


def test_a_lerobot_episode_holds_the_drives_own_samples(export: zipfile.ZipFile) -> None:
    samples = pq.read_table(io.BytesIO(sheet(export, "samples", "parquet"))).to_pandas()
    episode = pq.read_table(io.BytesIO(export.read(EPISODES))).to_pylist()[1]
    mine = samples[samples["drive"] == episode["drive"]]
    frames = pq.read_table(
        io.BytesIO(export.read("lerobot/data/chunk-000/file-000.parquet"))
    ).to_pandas()
    part = frames[frames["episode_index"] == 1]
    for name, columns in (
        ("observation.state", [f"q_{j}" for j in range(1, 8)]),
        ("action", [f"a_{j}" for j in range(1, 8)]),
        ("stick", ["h_x", "h_y"]),
    ):
        np.testing.assert_allclose(np.stack(part[name]), mine[columns], rtol=1e-6)


def test_a_study_without_drives_has_no_lerobot_dataset(database: Database) -> None:
    with database.write() as db:
        study = make_study(db)
        drive(db, enrol(db, study), "avoid", ticks=0)
        study_id = study.id
    export = export_of(database, study_id)
    assert not [name for name in export.namelist() if name.startswith("lerobot/")]
    (row,) = lines_of(export, "drives")
    assert (row["ticks"], row["path_length_m"]) == (0, None)
    empty = pq.read_table(io.BytesIO(sheet(export, "samples", "parquet")))
    assert empty.schema.names == [column.name for column in TABLES["samples"].columns]
