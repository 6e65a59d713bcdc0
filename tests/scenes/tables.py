"""The program's own tables of sections, parts and keys, read from the page that `perikit describe --markdown` prints."""

import re
import subprocess
from dataclasses import dataclass, field


@dataclass
class Key:
    """A row of a table: what a key may hold, in the words of the page."""
    name: str
    unit: str
    default: str
    allowed: str

    @property
    def required(self):
        return self.default == "required"


@dataclass
class Table:
    keys: dict = field(default_factory=dict)
    groups: list = field(default_factory=list)   # ("exactly" or "at most", how many, [names])


@dataclass
class Tables:
    sections: dict   # "body.lattice" -> Table
    parts: dict      # "kinematics" -> {"baqp" -> Table}
    states: dict = field(default_factory=dict)   # "hypoelastic" -> ["state:work", ...]: what laws remember, as fields


def read_tables(program):
    page = subprocess.run([program, "describe", "--markdown"], capture_output=True, text=True, check=True).stdout
    return parse_tables(page)


def parse_tables(page):
    tables = Tables({}, {})
    table = part = None
    for line in page.split("\n"):
        heading = re.match(r"### (.+)", line)
        if heading:
            table = Table()
            name = heading.group(1).strip()
            part = re.match(r"(\w+)/(\w+)$", name)
            if part:
                tables.parts.setdefault(part.group(1), {})[part.group(2)] = table
            elif name == "Top level":
                tables.sections[""] = table
            elif re.match(r"\[[\w.]+\]$", name):
                tables.sections[name[1:-1]] = table
            continue
        if part is not None and line.startswith("Remembers, as point fields: "):
            tables.states[part.group(2)] = re.findall(r"`(state:\w+)`", line)
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] if line.startswith("| `") else []
        if table is not None and len(cells) == 5:
            name = cells[0].strip("`")
            table.keys[name] = Key(name, cells[1], cells[2].strip("`"), cells[3])
        group = re.match(r"Of these, (exactly|at most|at least) (\d+) of: (.+)\.$", line)
        if group and table is not None:
            table.groups.append((group.group(1), int(group.group(2)), group.group(3).split(", ")))
    return tables
