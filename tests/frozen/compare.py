"""Whether all that was once said is still said; what is new beside it is no difference."""

import math
from collections.abc import Collection
from typing import Any

import yaml

# Sums of numbers in double precision may differ in the last digits from processor to processor.
RELATIVE = 1e-9


def differences(old: Any, new: Any, ignored: Collection[str] = (), at: str = "") -> list[str]:
    """Where ``new`` does not say what ``old`` says, a line for each place.

    Args:
        old: JSON: objects must have at least the old keys, lists exactly as many elements.
        new: What is held against it.
        ignored: Keys whose values may be others; they must be there.
        at: The place of both.
    """
    if at.endswith(".yaml") and isinstance(old, str) and isinstance(new, str):
        old, new = yaml.safe_load(old), yaml.safe_load(new)  # the same, however it is written
    if isinstance(old, dict) and isinstance(new, dict):
        found = [f"{at}.{key} is missing" for key in old.keys() - new.keys()]
        for key in old.keys() & new.keys() - set(ignored):
            found += differences(old[key], new[key], ignored, f"{at}.{key}")
        return found
    if isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            return [f"{at} has {len(new)} elements, not {len(old)}"]
        pairs = enumerate(zip(old, new, strict=True))
        return [each for i, (a, b) in pairs for each in differences(a, b, ignored, f"{at}[{i}]")]
    return [] if _are_equal(old, new) else [f"{at} is {new!r}, not {old!r}"]


def _are_equal(old: Any, new: Any) -> bool:
    if isinstance(old, float) and isinstance(new, float):
        is_near = math.isclose(old, new, rel_tol=RELATIVE, abs_tol=1e-12)
        return is_near or (math.isnan(old) and math.isnan(new))
    return bool(old == new and type(old) is type(new))
