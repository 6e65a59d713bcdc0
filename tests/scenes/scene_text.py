"""Scenes as dictionaries, and their text."""

import os

from results import h5py

SUB_SECTIONS = {"body": ("lattice", "points")}


def value_text(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(value_text(item) for item in value) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join("%s = %s" % (key, value_text(item)) for key, item in value.items()) + " }"
    if isinstance(value, float):
        return repr(value) if "." in repr(value) or "e" in repr(value) else repr(value) + ".0"
    return str(value)


def section_text(header, content):
    return "\n".join([header] + ["%s = %s" % (key, value_text(value)) for key, value in content.items()]) + "\n"


def scene_text(scene):
    """TOML. Lists of dictionaries become arrays of tables, dictionaries of the top level become sections."""
    plain = {key: value for key, value in scene.items() if not isinstance(value, (dict, list)) and key != "files"}
    out = section_text("", plain).lstrip("\n")
    for name, value in scene.items():
        if name == "files" or name in plain:
            continue
        for item in value if isinstance(value, list) else [value]:
            subs = SUB_SECTIONS.get(name, ())
            rest = {key: content for key, content in item.items() if key not in subs and not is_tables(content)}
            out += section_text("[[%s]]" % name if isinstance(value, list) else "[%s]" % name, rest)
            for sub in subs:
                if sub in item:
                    out += section_text("[%s.%s]" % (name, sub), item[sub])
            for key, content in item.items():
                if is_tables(content):
                    out += "".join(section_text("[[%s.%s]]" % (name, key), entry) for entry in content)
    return out


def is_tables(value):
    return isinstance(value, list) and len(value) > 0 and isinstance(value[0], dict)


def write_columns(text, path):
    """The columns of a .csv file as datasets of an .h5 file."""
    names, *rows = [line.split(",") for line in text.strip().split("\n")]
    with h5py.File(path, "w") as file:
        for name, column in zip(names, zip(*rows)):
            file[name] = [float(word) for word in column]


def write_scene(scene, folder):
    os.makedirs(folder, exist_ok=True)
    for name, text in scene.get("files", {}).items():
        with open(os.path.join(folder, name), "w") as file:
            file.write(text)
    columns = scene["body"].get("points", {}).get("file", "")
    if columns.endswith(".h5"):
        write_columns(scene["files"][columns.replace(".h5", ".csv")], os.path.join(folder, columns))
    path = os.path.join(folder, "scene.toml")
    with open(path, "w") as file:
        file.write(scene_text(scene))
    return path
