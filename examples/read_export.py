"""Reads an export with pandas and torch: ``python examples/read_export.py export.zip``."""

import io
import sys
import zipfile

import pandas as pd
from safetensors.torch import load

with zipfile.ZipFile(sys.argv[1]) as export:
    paths = export.namelist()

    def table(name: str) -> pd.DataFrame:
        """A table of the export."""
        path = next(each for each in paths if each.endswith(f"_{name}_data.parquet"))
        return pd.read_parquet(io.BytesIO(export.read(path)))

    participants, drives = table("participants"), table("drives")
    kept = participants[participants["excluded"].isna()]
    drives = drives[drives["participant"].isin(kept["participant"])]
    labels = {path: load(export.read(path)) for path in paths if path.startswith("tensors/")}

print(f"{len(kept)} participants, {len(drives)} drives")
print(
    drives.groupby(["task", "strategy"])[
        ["completion_time_s", "path_length_m", "undo_share"]
    ].mean()
)
for path, tensors in labels.items():
    print(path, {name: tuple(tensor.shape) for name, tensor in tensors.items()})
