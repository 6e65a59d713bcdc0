"""Whether a fragment of a scene or of a study uses keys that exist: those of the tables of the reference page, which the program writes of itself."""

import functools
import re
import tomllib

PARTS = ("kinematics", "material", "damage", "influence", "term", "integrator", "stabilization")


@functools.cache
def tables(reference):
    """Keys by heading of the reference page: "body.lattice", "kinematics/baqp", "study", "study.plot", "" for the top level."""
    keys, heading = {}, None
    for line in reference.read_text(encoding="utf-8").splitlines():
        if line.startswith("### "):
            heading = line[4:].replace("Top level of a study", "study").replace("Top level", "")
            if heading.endswith(" of a study"):
                heading = "study." + heading.removesuffix(" of a study")
            heading = heading.replace("[", "").replace("]", "")
            keys[heading] = set()
        elif heading is not None and (key := re.match(r"\| `([^`]+)` \|", line)):
            keys[heading].add(key.group(1))
    return keys


def part_fault(kind, value, known):
    """A part of a scene: its name, or a table with `type` and the keys of that part and of its section."""
    value = {"type": value} if isinstance(value, str) else value
    names = [name for name in known if name.startswith(kind + "/")]
    if "type" in value:
        if f"{kind}/{value['type']}" not in known:
            return f"the unknown {kind} '{value['type']}'"
        names = [f"{kind}/{value['type']}"]
    allowed = {"type", *known.get(kind, ()), *(key for name in names for key in known[name])}
    for key, item in value.items():
        if key not in allowed:
            return f"the unknown key {kind}.{key}"
        inner = {"stabilization": "stabilization", "base": "kinematics"}.get(key)
        if inner and (found := part_fault(inner, item, known)):
            return found
    return None


def section_fault(path, table, known):
    """A section of a scene, its sections included."""
    if path in ("constants", "study.values"):
        return None
    if path == "sets":
        table = {key: entry for value in table.values() if isinstance(value, dict) for key, entry in value.items()}
    inside = path + "." if path else ""
    for key, value in table.items():
        section = inside + key
        kind = key if key in PARTS else None
        if kind and (section in known or key in known[path]):
            entries = value if isinstance(value, list) and kind == "term" else [] if isinstance(value, list) else [value]
            found = next(filter(None, (part_fault(kind, entry, known) for entry in entries)), None)
        elif section in known:
            found = next(filter(None, (section_fault(section, entry, known) for entry in (value if isinstance(value, list) else [value]))), None)
        elif key in known[path]:
            found = None
        else:
            found = f"the unknown key {section}"
        if found:
            return found
    return None


def fault(text, reference):
    """What is wrong with a fragment; None where all its keys are known."""
    known = tables(reference)
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        return str(error)
    if content.keys() & {"scene", "values", "quantity"}:
        return section_fault("study", {key: value for key, value in content.items() if key != "values"}, known)
    return section_fault("", content, known)


@functools.cache
def sources(root):
    folders = ("framework/templates", "materials", "plugins", "integrators", "framework/include")
    return "\n".join(" ".join(file.read_text(encoding="utf-8").split()) for folder in folders for file in (root / folder).rglob("*.?pp"))


def in_sources(text, root):
    """Whether some source of a part, a template or a header has these lines, however they are broken."""
    return " ".join(text.split()) in sources(root)
