"""No container engine is at hand, so the Dockerfile's own lines are run without one.

Its copies, its install lines and its start line are carried out in an empty folder and an empty
environment, as the stages would; what the base image and the user's uid do is not covered. The
packages of run.lock are put there before pip is asked for them: locked_packages.py says how.
"""

import json
import os
import re
import shlex
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests import locked_packages
from tests.patience import PATIENCE_S

ROOT = Path(__file__).resolve().parents[1]


def instructions() -> list[tuple[str, str]]:
    lines = (ROOT / "Dockerfile").read_text().splitlines()
    found = [line.partition(" ") for line in lines if line and not line.startswith("#")]
    return [(name, rest) for name, _, rest in found]


def test_it_has_two_stages_a_user_and_a_health_check() -> None:
    found = instructions()
    assert sum(name == "FROM" for name, _ in found) == 2
    last_stage = found[max(i for i, (name, _) in enumerate(found) if name == "FROM") :]
    names = [name for name, _ in last_stage]
    assert dict(last_stage)["USER"] == "joymap"
    assert names.index("USER") < names.index("CMD")
    assert "HEALTHCHECK" in names


def test_its_install_and_start_lines_run_in_a_clean_environment(tmp_path: Path) -> None:
    home, work, data = tmp_path / "home", tmp_path / "srv" / "joymap", tmp_path / "srv" / "data"
    for folder in (home, work, data):
        folder.mkdir(parents=True)
    environment = {"HOME": str(home), "PATH": f"{Path(sys.executable).parent}:{os.defpath}"}
    # Which build of a version is installed is for the machine's own package index to say.
    environment |= {name: value for name, value in os.environ.items() if name[:4] == "PIP_"}
    port = free_port()
    command: list[str] = []
    check: list[str] = []
    for name, written in instructions():
        rest = written.replace("/srv/", f"{tmp_path}/srv/")
        if name == "COPY" and "--from" not in rest:
            *sources, target = [part for part in rest.split() if not part.startswith("--")]
            for source in sources:
                copy(ROOT / source, work / target)
        elif name == "RUN" and "useradd" not in rest:
            subprocess.run(rest, shell=True, cwd=work, env=environment, check=True, timeout=900)
            if "-m venv" in rest:
                locked_packages.link_into(work / ".venv")
        elif name == "ENV":
            environment |= dict(pair.split("=", 1) for pair in shlex.split(rest))
        elif name == "CMD":
            command = json.loads(rest)
        elif name == "HEALTHCHECK":
            check = json.loads(rest[rest.index("[") :])
    listed = [str(work / ".venv/bin/pip"), "list", "--format=json", "--exclude-editable"]
    packages = subprocess.run(listed, env=environment, check=True, capture_output=True).stdout
    installed = {package["name"] for package in json.loads(packages)} - {"pip", "setuptools"}
    assert installed == set(locked_packages.names())
    # The one thing changed: tests listen on the loopback address, at a free port.
    environment |= {"JOYMAP_HOST": "127.0.0.1", "JOYMAP_PORT": str(port)}
    server = subprocess.Popen(
        command, cwd=work, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    try:
        deadline = time.monotonic() + PATIENCE_S
        while subprocess.run(check, cwd=work, env=environment, stderr=-3, check=False).returncode:
            assert server.poll() is None, server.stdout.read().decode()  # type: ignore[union-attr]
            assert time.monotonic() < deadline, "the health check never passed"
            time.sleep(0.3)
    finally:
        server.terminate()
        output = server.communicate(timeout=PATIENCE_S)[0].decode()
    assert re.search(r"participant +http://127\.0\.0\.1:8000/p/\S{40,}", output)
    assert (data / "joymap.db").is_file()


def copy(source: Path, target: Path) -> None:
    if source.is_dir():
        shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
    else:
        shutil.copy(source, target)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@pytest.mark.parametrize("name", ["run.lock", "test.lock"])
def test_every_dependency_is_locked_to_one_version(name: str) -> None:
    lines = (ROOT / "requirements" / name).read_text().splitlines()
    packages = [line for line in lines if line and not line.startswith(("#", "-r"))]
    assert packages
    assert all(re.fullmatch(r"[A-Za-z0-9._-]+==[0-9][A-Za-z0-9.]*", line) for line in packages)
