"""Models as mappings: their text in TOML, with the order of the items."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any


def to_toml(model: Mapping[str, Any]) -> str:
    """Returns the text of a model that is given as nested mappings: sections of items, each a value or a mapping of keys."""
    values, sections = [], []
    for name, content in model.items():
        if isinstance(content, Mapping):
            lines = [f"{_text(item)} = {_value(value, f'{name}.{item}')}" for item, value in content.items()]
            sections.append("\n".join([f"[{_text(name)}]", *lines]))
        else:
            values.append(f"{_text(name)} = {_value(content, name)}")
    return "\n\n".join(["\n".join(values), *sections]) + "\n"


def _text(text: str) -> str:
    if not isinstance(text, str):
        raise TypeError(f"{text!r} is a key of a model; give text")
    return json.dumps(text)


def _value(value: Any, where: str) -> str:
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_text(key)} = {_value(own, f'{where}.{key}')}" for key, own in value.items()) + " }"
    # Numbers of numpy have `item`.
    value = value.item() if hasattr(value, "item") else value
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float) and math.isfinite(value):
        return repr(value)
    raise TypeError(f"{where} is {value!r}; give text, a finite number, a truth value or a mapping")
