"""Write run.lock and test.lock: every package the project needs, at the version it was tested with.

A fresh environment is made for it, so that nothing is locked that nothing asks for. Local version
labels (a CPU build of torch calls itself 2.13.0+cpu) are left out: which build of a version is
installed is for the machine's own package index to say.
"""

import json
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
HEADER = "# Written by 'make lock' from pyproject.toml; do not edit.\n"


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        pip = [f"{folder}/bin/python", "-m", "pip", "--disable-pip-version-check"]
        # torch first and alone: an open range elsewhere would pull another build.
        subprocess.run([*pip, "install", "torch==2.13.0"], check=True)
        subprocess.run([*pip, "install", str(ROOT)], check=True)
        run = frozen(pip)
        (HERE / "run.lock").write_text(HEADER + "\n".join(run) + "\n")
        subprocess.run([*pip, "install", f"{ROOT}[dev]"], check=True)
        test = [line for line in frozen(pip) if line not in run]
        (HERE / "test.lock").write_text(HEADER + "-r run.lock\n" + "\n".join(test) + "\n")


def frozen(pip: list[str]) -> list[str]:
    """Every installed package, but pip's own and the project, as name==version."""
    output = subprocess.run(
        [*pip, "list", "--format=json"], check=True, capture_output=True, text=True
    ).stdout
    ours = {"joymap-studio", "pip", "setuptools", "wheel"}
    return [
        f"{package['name']}=={package['version'].split('+')[0]}"
        for package in json.loads(output)
        if package["name"] not in ours
    ]


if __name__ == "__main__":
    sys.exit(main())
