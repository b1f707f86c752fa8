"""A fresh virtual environment with what run.lock names, without installing it anew each time.

That run.lock can be installed from nothing is shown by the set-up before the tests.
"""

import importlib.metadata
import importlib.util
import os
import shutil
import sysconfig
from pathlib import Path

RUN_LOCK = Path(__file__).resolve().parents[1] / "requirements" / "run.lock"


def names() -> list[str]:
    """The packages that run.lock names."""
    lines = RUN_LOCK.read_text().splitlines()
    return [line.split("==")[0] for line in lines if "==" in line]


def link_into(environment: Path) -> None:
    """Put this environment's packages of run.lock, and no others, into a fresh one.

    pip finds them there when it is asked for run.lock, and gets what is missing or of another
    version. Files are linked where they can be, else copied; programs are left out, since each
    names the Python that it belongs to.
    """
    places = {"base": str(environment), "platbase": str(environment)}
    site = Path(sysconfig.get_path("purelib", "venv", places))
    for name in names():
        try:
            files = importlib.metadata.distribution(name).files or []
        except importlib.metadata.PackageNotFoundError:
            continue
        for file in files:
            if ".." not in file.parts:
                source, target = Path(str(file.locate())), site / file
                _link(source, target)
                _link(_compiled(source), _compiled(target))


def _compiled(source: Path) -> Path:
    return Path(importlib.util.cache_from_source(str(source)))


def _link(source: Path, target: Path) -> None:
    if target.exists() or not source.is_file():  # some packages share a file
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)
