"""Drives as a LeRobot v3 dataset (huggingface/lerobot, ``codebase_version`` v3.0).

An episode is a drive, a frame a tick; there are no videos. One data file holds all episodes, each
a row group of its own.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from app import texts
from app.services.export_package import Package
from app.services.export_tables import TableRow

_QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
_FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_FIRST = _FILE.format(chunk_index=0, file_index=0)
_JOINTS = [f"joint_{j}" for j in range(1, 8)]
# Which columns of the samples each vector is made of, and what its components are called.
_VECTORS = {
    "observation.state": ([f"q_{j}" for j in range(1, 8)], _JOINTS),
    "action": ([f"a_{j}" for j in range(1, 8)], _JOINTS),
    "stick": (["h_x", "h_y"], ["right", "up"]),
}
_INDICES = ("frame_index", "episode_index", "index", "task_index")
_SCHEMA = pa.schema(
    [(name, pa.list_(pa.float32(), len(parts))) for name, (parts, _) in _VECTORS.items()]
    + [("timestamp", pa.float32())]
    + [(name, pa.int64()) for name in _INDICES]
)


@dataclass
class _Written:
    """What the files about the data have to say of it.

    Attributes:
        tasks: The words for each task, in the order of their indices.
        episodes: A row for each drive.
        stats: Of each drive, by the feature's name and the statistic's.
        frames: How many there are in all.
    """

    tasks: list[str] = field(default_factory=list)
    episodes: list[TableRow] = field(default_factory=list)
    stats: list[dict[str, dict[str, np.ndarray]]] = field(default_factory=list)
    frames: int = 0


def write_lerobot(
    package: Package, drives: Iterable[TableRow], samples: Iterable[pa.Table], fps: int
) -> int:
    """Write the dataset into the folder ``lerobot``.

    Args:
        package: Where to.
        drives: Rows of the table of drives.
        samples: The table of samples, in parts, drives in the same order.
        fps: Ticks a second.

    Returns:
        How many episodes there are: drives with at least one tick. Without any nothing is written,
        as LeRobot cannot read a dataset without episodes.
    """
    described = {row["drive"]: row for row in drives}
    episodes = iter(_whole(samples))
    first = next(episodes, None)
    if first is None:
        return 0
    written = _Written()
    with (
        package.open(f"lerobot/data/{_FIRST}") as file,
        pq.ParquetWriter(pa.PythonFile(file, "w"), _SCHEMA) as sheet,
    ):
        for ticks in chain([first], episodes):
            frames = _frames(written, ticks, described[ticks["drive"][0].as_py()], fps)
            sheet.write_table(frames, row_group_size=len(frames))
    _put_about(package, written, fps)
    return len(written.episodes)


def _whole(samples: Iterable[pa.Table]) -> Iterator[pa.Table]:
    """The samples drive by drive."""
    gathered: list[pa.Table] = []
    for part in samples:
        if gathered and gathered[0]["drive"][0] != part["drive"][0]:
            yield pa.concat_tables(gathered)
            gathered = []
        gathered.append(part)
    if gathered:
        yield pa.concat_tables(gathered)


def _frames(written: _Written, ticks: pa.Table, drive: TableRow, fps: int) -> pa.Table:
    """A drive's frames; takes it down among what was written."""
    count, episode = len(ticks), len(written.episodes)
    title = texts.title_of(drive["task"])
    if title not in written.tasks:
        written.tasks.append(title)
    frame = np.arange(count)
    columns: dict[str, np.ndarray] = {
        name: np.stack([ticks[part].to_numpy() for part in parts], axis=1).astype(np.float32)
        for name, (parts, _) in _VECTORS.items()
    } | {
        # As LeRobot counts time; the server's clock is in the samples.
        "timestamp": (frame / fps).astype(np.float32),
        "frame_index": frame,
        "episode_index": np.full(count, episode),
        "index": written.frames + frame,
        "task_index": np.full(count, written.tasks.index(title)),
    }
    stats = {name: _stats(values) for name, values in columns.items()}
    written.stats.append(stats)
    written.episodes.append(
        {
            "episode_index": episode,
            "tasks": [title],
            "length": count,
            "data/chunk_index": 0,
            "data/file_index": 0,
            "dataset_from_index": written.frames,
            "dataset_to_index": written.frames + count,
            "meta/episodes/chunk_index": 0,
            "meta/episodes/file_index": 0,
            **{name: drive[name] for name in ("participant", "drive", "strategy", "step")},
            "is_success": drive["is_success"],
            **{
                f"stats/{name}/{statistic}": value.tolist()
                for name, statistics in stats.items()
                for statistic, value in statistics.items()
            },
        }
    )
    written.frames += count
    arrays = [
        pa.FixedSizeListArray.from_arrays(values.ravel(), values.shape[1])
        if (values := columns[name]).ndim == 2
        else pa.array(values)
        for name in _SCHEMA.names
    ]
    return pa.table(arrays, schema=_SCHEMA)


def _stats(values: np.ndarray) -> dict[str, np.ndarray]:
    """A feature's statistics over an episode, each ``(components,)``; the count ``(1,)``."""
    table = values.reshape(len(values), -1)
    return {
        "min": table.min(axis=0),
        "max": table.max(axis=0),
        "mean": table.mean(axis=0, dtype=np.float64),
        "std": table.std(axis=0, dtype=np.float64),
        "count": np.array([len(table)]),
        **{name: np.quantile(table, share, axis=0) for name, share in _QUANTILES.items()},
    }


def _over_all(stats: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """A feature's statistics over all episodes; quantiles as LeRobot has them: their means."""
    by_name = {name: np.stack([each[name] for each in stats]) for name in stats[0]}
    share = by_name["count"] / by_name["count"].sum()
    mean = (share * by_name["mean"]).sum(axis=0)
    variance = (share * (by_name["std"] ** 2 + (by_name["mean"] - mean) ** 2)).sum(axis=0)
    return {
        "min": by_name["min"].min(axis=0),
        "max": by_name["max"].max(axis=0),
        "mean": mean,
        "std": np.sqrt(variance),
        "count": by_name["count"].sum(axis=0),
        **{name: (share * by_name[name]).sum(axis=0) for name in _QUANTILES},
    }


def _put_about(package: Package, written: _Written, fps: int) -> None:
    features = {
        name: {"dtype": "float32", "shape": [len(parts)], "names": names}
        for name, (parts, names) in _VECTORS.items()
    } | {"timestamp": {"dtype": "float32", "shape": [1], "names": None}}
    features |= {name: {"dtype": "int64", "shape": [1], "names": None} for name in _INDICES}
    info = {
        "codebase_version": "v3.0",
        "robot_type": "panda",
        "total_episodes": len(written.episodes),
        "total_frames": written.frames,
        "total_tasks": len(written.tasks),
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": fps,
        "splits": {"train": f"0:{len(written.episodes)}"},
        "data_path": f"data/{_FILE}",
        "video_path": None,
        "features": features,
    }
    stats = {
        name: {
            statistic: value.tolist()
            for statistic, value in _over_all([each[name] for each in written.stats]).items()
        }
        for name in _SCHEMA.names
    }
    package.put("lerobot/meta/info.json", json.dumps(info, indent=4))
    package.put("lerobot/meta/stats.json", json.dumps(stats, indent=4))
    _put_table(package, "tasks.parquet", _tasks(written.tasks))
    _put_table(package, f"episodes/{_FIRST}", pa.Table.from_pylist(written.episodes))


def _put_table(package: Package, name: str, table: pa.Table) -> None:
    with package.open(f"lerobot/meta/{name}") as file:
        pq.write_table(table, pa.PythonFile(file, "w"))


def _tasks(titles: list[str]) -> pa.Table:
    """The tasks as pandas would write them, the titles being the index: so LeRobot reads them."""

    def column(name: str, pandas_type: str, numpy_type: str) -> dict[str, Any]:
        types = {"pandas_type": pandas_type, "numpy_type": numpy_type}
        return {"name": name, "field_name": name, **types, "metadata": None}

    about = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [column("task_index", "int64", "int64"), column("task", "unicode", "object")],
        "pandas_version": "2.2.0",
    }
    table = pa.table({"task_index": pa.array(range(len(titles)), pa.int64()), "task": titles})
    return table.replace_schema_metadata({"pandas": json.dumps(about)})
