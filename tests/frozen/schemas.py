"""Every name that a JSON schema has: keys, and the words that a key's value may be."""

from collections.abc import Iterator
from typing import Any


def names_in(schema: dict[str, Any], shared: dict[str, Any], at: str = "") -> Iterator[str]:
    """Each key with its path, such as ``studies[].title``, and each word as ``state = open``.

    Args:
        schema: JSON schema.
        shared: What ``$ref`` means, by its last part.
        at: Where the schema's value stands.
    """
    if "$ref" in schema:
        yield from names_in(shared[schema["$ref"].rsplit("/", 1)[1]], shared, at)
    for part in ("anyOf", "oneOf", "allOf", "prefixItems"):
        for each in schema.get(part, ()):
            yield from names_in(each, shared, at)
    for name, each in schema.get("properties", {}).items():
        inside = f"{at}.{name}" if at else name
        yield inside
        yield from names_in(each, shared, inside)
    for part, mark in (("items", "[]"), ("additionalProperties", "{}")):
        if isinstance(schema.get(part), dict):
            yield from names_in(schema[part], shared, f"{at}{mark}")
    words = [schema["const"]] if "const" in schema else schema.get("enum", [])
    for word in words:
        yield f"{at} = {word}"


def operations(description: dict[str, Any]) -> Iterator[str]:
    """Each operation of an OpenAPI document: what it takes (``?`` and ``<``) and gives (``>``).

    Of refusals only the status: their bodies are all alike.
    """
    shared = description["components"]["schemas"]
    for path, methods in description["paths"].items():
        for method, operation in methods.items():
            called = f"{method.upper()} {path}"
            yield called
            for given in operation.get("parameters", ()):
                if given["in"] != "path":
                    name = f"?{given['name']}"
                    yield f"{called} {name}"
                    yield from (f"{called} {e}" for e in names_in(given["schema"], shared, name))
            for name in _content(operation.get("requestBody", {}), shared):
                yield f"{called} < {name}"
            for status, response in operation["responses"].items():
                yield f"{called} > {status}"
                for name in _content(response, shared) if status < "400" else ():
                    yield f"{called} > {status} {name}"


def _content(body: dict[str, Any], shared: dict[str, Any]) -> Iterator[str]:
    for kind, content in body.get("content", {}).items():
        if kind == "application/json":
            yield from names_in(content.get("schema", {}), shared)
