"""Made ``data_directory.zip``, ``export.zip``, ``figures`` and ``api.json.gz``; no test runs it.

In a checkout of the commit that the fixtures are named after, with this folder copied into it::

    python -m tests.frozen.make_study

A server is started and simulated participants take part through its doors: three finish, one of
them with the patience to reach the goal; one stops before a drive of the second task, one withdraws
and lets what they gave be kept, one withdraws and has it erased, one is gone for so long that their
place is free, and is excluded. Then the server's own answers are kept, the study is exported, and
the folder that the server left is packed. It takes two minutes; ids and times differ each time.
"""

import asyncio
import gzip
import json
import os
import sqlite3
import subprocess
import sys
import tempfile
import uuid
import zipfile
from pathlib import Path
from typing import Any

import httpx

from app.bots.crowd import Crowd
from app.bots.visit import Manners, Visit
from tests.frozen import made
from tests.running_server import Participant, RunningServer, running_server

_LONG_AGO = "2020-01-01 00:00:00.000000"


def main() -> None:
    made.MADE.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        data_dir = Path(folder)
        with running_server(data_dir, teleop_rate_hz=made.RATE_HZ) as server:
            study, gone = _people_come(server)
        _be_silent(data_dir / "joymap.db", gone)
        with running_server(data_dir, teleop_rate_hz=made.RATE_HZ) as server:
            office = httpx.Client(base_url=f"{server.base_url}/api/v1/", timeout=20.0)
            office.post("login", json=made.OWNER).raise_for_status()
            _post(office, f"participants/{gone}/exclude", reason="did not look")
            kept = _answers(office, study)
            _export(data_dir, study)
            _keep_data(data_dir)
            # At last, since whose place was freed has it back by coming.
            people = [line["id"] for line in kept[f"studies/{study}/participants"]["participants"]]
            _keep({"study": study, "api": kept, "sessions": _sessions(office, people)})


def _people_come(server: RunningServer) -> tuple[str, str]:
    """The study's id, and that of who is to be gone."""
    server.experimenter()
    office = httpx.Client(base_url=f"{server.base_url}/api/v1/", timeout=20.0)
    office.post("login", json=made.OWNER).raise_for_status()
    study = str(uuid.uuid4())
    _post(office, "studies", id=study, yaml=(made.HERE / "study.yaml").read_text())
    join = _post(office, f"studies/{study}/link")["link"]
    _post(office, "tokens", id=str(uuid.uuid4()), name="notebook", scope="read")
    command = [sys.executable, "-m", "app.cli", "bots", "--study", join, "--participants", "1"]
    bots = [
        subprocess.Popen([*command, "--seed", seed, "--gives-up-s", patience_s])
        for seed, patience_s in (("1", "30"), ("2", "1"), ("3", "1"))
    ]
    assert [bot.wait() for bot in bots] == [0, 0, 0]
    wanted = {"id": str(uuid.uuid4()), "count": 4}
    new = _post(office, f"studies/{study}/participants", **wanted)["participants"]
    half, kept, erased, gone = new
    _go_half_way(half["link"])
    for each, erase in ((kept, False), (erased, True)):
        _withdraw(Participant(each["link"]), erase)
    _answer_once(Participant(gone["link"]))
    first = office.get(f"studies/{study}/participants").json()["participants"][0]["id"]
    text = "Asked twice whether the cup is full."
    _post(office, f"participants/{first}/notes", id=str(uuid.uuid4()), text=text)
    return study, gone["id"]


def _go_half_way(link: str) -> None:
    """One task done, the second one learned, and then nothing more; one move they cannot tell."""
    person = Participant(link)
    bot = Visit(link, Crowd(1, seed=4).person(0), Manners(drop_out=0.5, gives_up_s=1.0))

    async def visit() -> None:
        async with httpx.AsyncClient(timeout=30.0) as http:
            report = await bot.run(http)
        assert report.state == "dropped out", report.state

    asyncio.run(visit())
    chosen = {"invert_x": True, "invert_y": False, "gain": 1.5, "one_axis": False, "steady": True}
    person.http.put("stick", json={"id": str(uuid.uuid4())} | chosen).raise_for_status()
    session = person.session()
    stick: Any = None
    while session["step"] == "queries":
        query = next(each for each in session["queries"] if each["answer"] is None)
        session = person.answer(query["id"], stick).raise_for_status().json()
        stick = [0.6, -0.4] if stick is None else [-stick[1], stick[0]]
    assert person.wait_for_training()["state"] == "succeeded"
    person.post("driving").raise_for_status()
    assert person.session()["step"] == "block"


def _withdraw(person: Participant, erase: bool) -> None:
    _answer_once(person)
    person.post("withdraw", erase=erase).raise_for_status()


def _answer_once(person: Participant) -> None:
    session = person.begin()
    person.answer(session["queries"][0]["id"], [0.25, -0.5]).raise_for_status()


def _be_silent(database: Path, participant: str) -> None:
    with sqlite3.connect(database) as db:
        db.execute("UPDATE participant SET seen_at = ? WHERE id = ?", (_LONG_AGO, participant))


def _export(data_dir: Path, study: str) -> None:
    """By the command, and what ``joymap figures`` says of it."""
    environment = os.environ | {
        "JOYMAP_DATA_DIR": str(data_dir),
        "JOYMAP_TELEOP_RATE_HZ": str(made.RATE_HZ),
    }
    joymap = [sys.executable, "-m", "app.cli"]
    export = [*joymap, "export", study, "--out", str(made.EXPORT)]
    subprocess.run(export, env=environment, check=True)
    figures = [*joymap, "figures", str(made.EXPORT), "--out", str(made.FIGURES)]
    subprocess.run(figures, env=environment, check=True)
    for picture in (*made.FIGURES.glob("*.png"), *made.FIGURES.glob("*.svg")):
        picture.unlink()


def _answers(office: httpx.Client, study: str) -> dict[str, Any]:
    """What the dashboard is told, by address."""
    lines = office.get(f"studies/{study}/participants").json()["participants"]
    people = [line["id"] for line in lines]
    drives, moves = _drives_and_moves(office, people)
    return {
        address: office.get(address).raise_for_status().json()
        for address in made.study_addresses(study, people, drives, moves)
    }


def _sessions(office: httpx.Client, people: list[str]) -> dict[str, Any]:
    """What each participant's page is told, by a new link."""
    links = {each: _post(office, f"participants/{each}/link")["link"] for each in people}
    return {
        each: httpx.get(f"{link}/api/session").raise_for_status().json()
        for each, link in links.items()
    }


def _keep(content: dict[str, Any]) -> None:
    text = json.dumps(content, ensure_ascii=False, separators=(",", ":"))
    made.ANSWERS.write_bytes(gzip.compress(text.encode(), mtime=0))


def _drives_and_moves(office: httpx.Client, people: list[str]) -> tuple[list[str], list[str]]:
    """A drive of each participant who drove, and a move of each who answered."""
    drives, moves = [], []
    for each in people:
        driven = office.get(f"participants/{each}/drives").json()["drives"]
        drives += [drive["id"] for drive in driven if drive["ticks"]][:1]
        given = office.get(f"participants/{each}").json()["answers_given"]
        moves += [answer["query_id"] for answer in given][:1]
    return drives, moves


def _keep_data(data_dir: Path) -> None:
    """The database as one file, and the weights beside it."""
    database = data_dir / "packed.db"
    # Not in a "with", which would begin a transaction.
    db = sqlite3.connect(data_dir / "joymap.db")
    db.execute("VACUUM INTO ?", (str(database),))
    db.close()
    with zipfile.ZipFile(made.DATA, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(database, "joymap.db")
        for path in sorted((data_dir / "alignments").iterdir()):
            archive.write(path, f"alignments/{path.name}")


def _post(office: httpx.Client, address: str, **body: Any) -> dict[str, Any]:
    response = office.post(address, json=body)
    assert response.is_success, response.text
    found: dict[str, Any] = response.json()
    return found


if __name__ == "__main__":
    main()
