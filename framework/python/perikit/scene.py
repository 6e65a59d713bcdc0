"""Scenes as dictionaries: their values as TOML."""

import json
import os
import re


def key(name):
    """A name as a key of TOML: in quotes where it is not of letters, digits, _ and - alone."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else value(str(name))


def value(item):
    """A Python value as TOML, on one line. Raises TypeError for what TOML has no word for."""
    if isinstance(item, bool):
        return "true" if item else "false"
    if isinstance(item, (int, float)) and not hasattr(item, "tolist"):
        return repr(item)
    if isinstance(item, dict):
        return "{ " + ", ".join(f"{key(name)} = {value(entry)}" for name, entry in item.items()) + " }"
    if isinstance(item, (str, os.PathLike)):
        return json.dumps(os.fspath(item), ensure_ascii=False)
    if hasattr(item, "tolist"):  # arrays and scalars of numpy
        return value(item.tolist())
    if isinstance(item, (list, tuple)):
        return "[" + ", ".join(value(entry) for entry in item) + "]"
    raise TypeError(f"found {item!r} in a scene; allowed: numbers, texts, true and false, arrays, lists and dictionaries of these")


def is_list_of_tables(item):
    return isinstance(item, (list, tuple)) and len(item) > 0 and all(isinstance(entry, dict) for entry in item)


def text(scene, path=()):
    """A dictionary as the text of a scene: {"body": {"dimension": 2}, "boundary": [{...}, {...}]} gives [body] and two of [[boundary]]."""
    lines, sections = [], []
    for name, item in scene.items():
        inner = (*path, key(name))
        if isinstance(item, dict):
            sections += ["", f"[{'.'.join(inner)}]", *text(item, inner).splitlines()]
        elif is_list_of_tables(item):
            for entry in item:
                sections += ["", f"[[{'.'.join(inner)}]]", *text(entry, inner).splitlines()]
        else:
            lines.append(f"{key(name)} = {value(item)}")
    return "\n".join(lines + sections) + "\n"
