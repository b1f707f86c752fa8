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
        path = next(each for each in paths if each.endswith(f"-{name}_data.parquet"))
        return pd.read_parquet(io.BytesIO(export.read(path)))

    participants, drives, responses = table("participants"), table("drives"), table("responses")
    labels = {path: load(export.read(path)) for path in paths if path.startswith("tensors/")}

# Whom an experimenter excluded is in the tables; leaving them out is up to whoever reads.
kept = participants.loc[participants["excluded"].isna(), "participant"]
drives = drives[drives["participant"].isin(kept)]
responses = responses[responses["participant"].isin(kept)]

print(f"{len(kept)} participants, {len(drives)} drives")
by_way = ["task", "strategy"]
measures = ["completion_time_s", "path_length_m", "undo_share"]
print(drives.groupby(by_way)[measures].mean())
print(responses.pivot_table(index=by_way, columns="item", values="number"))

# s (n, 7) and s* (n, 7) in [rad], h (n, 2): what an alignment is learned from.
for path, tensors in labels.items():
    s, h, s_star = tensors["s"], tensors["h"], tensors["s_star"]
    print(f"{path}: {len(h)} labels, moves of {(s_star - s).norm(dim=1).mean():.3f} rad")
