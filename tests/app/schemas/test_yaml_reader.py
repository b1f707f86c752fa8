"""YAML 1.2 as protocols use it: what is read, with its lines, and what is refused in words."""

import contextlib
import json
import time
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from app.schemas import yaml_reader
from app.schemas.yaml_reader import NotReadable, read
from app.settings import ROOT

# What YAML 1.1 takes for something else than the text it looks like.
MISLEADING = ["on", "yes", "1:30", "0o7", "null", "~", "2024-13-45", "1_000", "=", "- a", "a: b"]
letters = st.characters(exclude_categories=["Cc", "Cs"], exclude_characters="\ufeff\ufffe\uffff")
texts = st.text(letters | st.sampled_from("\n\t '\"#:"), max_size=40)
values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**15), 10**15)
    | st.floats(-1e6, 1e6).filter(lambda x: x == 0.0 or abs(x) > 1e-6)
    | texts
    | st.sampled_from(MISLEADING),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(texts, inner, max_size=4),
    max_leaves=20,
)


@given(content=st.dictionaries(st.sampled_from("abcdef") | texts, values, max_size=5))
def test_what_is_written_reads_back_the_same(content: dict[str, Any]) -> None:
    assert read(yaml_reader.write(content)).content == content


@given(content=values)
def test_json_is_yaml(content: Any) -> None:
    # YAML forbids what it cannot show: JSON escapes it.
    assert read(json.dumps(content, ensure_ascii=True)).content == content


@given(content=st.dictionaries(st.sampled_from("abc"), st.integers() | st.booleans()))
def test_what_is_written_means_the_same_to_other_readers(content: dict[str, Any]) -> None:
    assert yaml.safe_load(yaml_reader.write(content)) == content


def test_every_value_has_its_line() -> None:
    lines = read("title: T\n\ntasks:\n  - task: avoid\n    labels: 7\n  - {task: pour-cup}\n").lines
    assert lines[("title",)] == 1
    assert lines[("tasks",)] == 3
    assert lines[("tasks", 0, "labels")] == 5
    assert lines[("tasks", 1)] == 6


@pytest.mark.parametrize("text", MISLEADING[:9])
def test_plain_words_are_text_as_yaml_1_2_has_it(text: str) -> None:
    if text in ("null", "~"):
        assert read(f"a: {text}").content == {"a": None}
    else:
        assert read(f"a: {text}").content == {"a": 7 if text == "0o7" else text}


@pytest.mark.parametrize(
    "encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-32-le"]
)
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_file_is_read_in_whatever_unicode_and_lines(encoding: str, end: str) -> None:
    document = read(f"title: Tüte{end}tasks: []{end}".encode(encoding))
    assert document.content == {"title": "Tüte", "tasks": []}
    assert document.lines[("tasks",)] == 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: 1\nb: 2\na: 3", "line 3: 'a' is there already, in line 1"),
        ('a: 1\n"a": 3', "line 2: 'a' is there already, in line 1"),
        ("x:\n  - {a: 1, a: 2}", "line 2: 'a' is there already, in line 2"),
        ("a: &x [1]\nb: *x", "line 1: '&x' names this for aliases"),
        ("a: 1\nb: *x", "line 2: '*x' is an alias"),
        ("a: {b: 1}\nc:\n  <<: {d: 1}", "line 3: '<<' is not used"),
        ("a: !!int abc", "line 1: the tag"),
        ("a: !!str abc", "line 1: the tag"),
        ("a: !own abc", "line 1: the tag"),
        ("!!map {a: 1}", "line 1: the tag"),
        ("a: !!python/object/apply:os.system [x]", "line 1: the tag"),
        ("a: 1\n---\nb: 2", "line 2: a second document"),
        ("%YAML 1.1\n---\na: 1", "%YAML"),
        ("%TAG ! tag:x,2000:\n---\na: 1", "%TAG"),
        ("1: 2", "line 1: a setting's name must be a word, not 1"),
        ("? [a]\n: 1", "line 1: a setting's name must be a word"),
        ("? \n: 1", "line 1: a setting's name must be a word"),
        ("a: .inf", "line 1: '.inf'"),
        ("a: .NaN", "line 1: '.NaN'"),
        ("a: 1" + "0" * 5000, "line 1: this number has too many digits"),
        ("a: 0x" + "f" * 40, "line 1: this number has too many digits"),
        ("a: 1e999", "line 1: this number is too large"),
        ("title: [unclosed\ntasks: 3", "line 2: "),
        ("a:\tb\n\tc: d", "line "),
        ("a: \x00", "not YAML"),
        ("[" * 90_000, "nested too deeply"),
        ("{" * 3000, "nested too deeply"),
        ("- " * 50_000, "nested too deeply"),
        ("\n".join(" " * n + "a:" for n in range(100)), "nested too deeply"),
        ("#\n" * 150_000, "200 kB"),
        ("ü" * 150_000, "200 kB"),
    ],
)
def test_what_authors_do_not_mean_is_refused_with_its_line(text: str, said: str) -> None:
    with pytest.raises(NotReadable) as refused:
        read(text)
    assert said in refused.value.sentence
    assert refused.value.sentence.endswith(".")
    assert "\n" not in refused.value.sentence


@pytest.mark.parametrize(
    "source", ["title: Tüte".encode("latin-1"), b"\xff\xfea", bytes(range(256))]
)
def test_a_file_that_is_in_no_unicode_is_refused(source: bytes) -> None:
    with pytest.raises(NotReadable, match="UTF-8"):
        read(source)


EXAMPLE = (ROOT / "examples" / "paper-study.yaml").read_text()


def cpu_s(text: str) -> float:
    """What reading takes, or refusing to."""
    began_s = time.thread_time()
    with contextlib.suppress(NotReadable):
        read(text)
    return time.thread_time() - began_s


@pytest.mark.parametrize(
    "text",
    [
        "#x\n" * 60_000,
        "a: |\n" + " x\n" * 60_000,
        "a: " + "x " * 90_000,
        'a: "' + "\\n" * 90_000 + '"',
        "a: " + "1:" * 60_000,
        "a: {" + ", ".join(f"k{n}: 1" for n in range(15_000)) + "}",
        "[" + "[],".join("" for _ in range(50_000)) + "]",
        "\n" * 190_000,
        " " * 190_000,
        "? " * 60_000,
        "a: &" + "a" * 180_000,
        "\n".join(f"k{n}: v" for n in range(18_000)),
    ],
)
def test_no_text_costs_more_than_its_time(text: str) -> None:
    in_passing_s = 30 * min(cpu_s(EXAMPLE) for _ in range(5))  # between two looks at the clock
    assert cpu_s(text) < yaml_reader.MAX_CPU_S + in_passing_s
