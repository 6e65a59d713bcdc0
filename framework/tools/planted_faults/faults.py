"""Small faults that could be planted in the sources, and the table of what became of them."""

import csv
import dataclasses
import hashlib
import itertools
import pathlib
import re
from dataclasses import dataclass

# Rooms that faults go into, and how many of every hundred each of them gets.
ROOMS = {
    "families": (16, ["framework/src/families/*", "framework/include/perikit/families/*"]),
    "spaces": (16, ["framework/src/spaces/*"]),
    "operators": (9, ["framework/src/operators/*", "framework/src/maps/*", "framework/include/perikit/operators/*"]),
    "assembly": (9, ["framework/src/assembly/*"]),
    "problem": (11, ["framework/src/problem/*", "framework/src/sdk/*", "framework/include/perikit/problem/*", "framework/include/perikit/sdk/*"]),
    "terms": (11, ["framework/src/terms/*", "framework/include/perikit/terms/*"]),
    "integrators": (11, ["integrators/*/*"]),
    "parts": (11, ["materials/*/law.hpp", "plugins/*/*/*", "framework/src/model/*", "framework/include/perikit/model/*"]),
    "body": (6, ["framework/src/body/*", "framework/src/core/*", "framework/include/perikit/body/*", "framework/include/perikit/core/*"]),
}

# Kinds of faults: a pattern, of which group 1 is replaced, and what by.
NUMBER = r"(?<![\w.\]])({})(?![\w.\]'])"
KINDS = [
    ("sign", r"(?<=[\w)\]]) (\+|-) (?=[\w(])", lambda x: {"+": "-", "-": "+"}[x]),
    ("sign", r" (\+=|-=) ", lambda x: {"+=": "-=", "-=": "+="}[x]),
    ("sign", r"(?:return |= |\(|, )(-)(?=[a-zA-Z(])", lambda x: ""),
    ("factor", r"(?<=[\w)\]]) (\*|/) (?=[\w(])", lambda x: {"*": "/", "/": "*"}[x]),
    ("constant", NUMBER.format(r"[0-9]+\.[0-9]+"), lambda x: "0.125" if float(x) == 0 else repr(0.8 * float(x))),
    ("constant", r"(?:[*/] )([2-9]|[1-9][0-9]+)(?![\w.])", lambda x: str(int(x) - 1)),
    ("constant", r"(?<![\w.\]])(?<!e-)([2-9]|[1-9][0-9]+)(?= [*/] )", lambda x: str(int(x) - 1)),
    ("one", r"[+-] (1)(?![\w.])", lambda x: "2"),
    ("bound", r"\bfor \([^;]*= (0);", lambda x: "1"),
    ("index", r"\[([012])\]", lambda x: {"0": "1", "1": "0", "2": "1"}[x]),
    ("comparison", r"(?<=[\w)\]]) (<=|>=|<|>|==|!=) (?=[\w(-])", None),
    ("logic", r" (&&|\|\|) ", lambda x: {"&&": "||", "||": "&&"}[x]),
    ("logic", r"(?:if \(|return |&& |\|\| )(!)(?=[\w(])", lambda x: ""),
    ("logic", r"\breturn (true|false);", lambda x: {"true": "false", "false": "true"}[x]),
    ("extreme", r"std::(?:ranges::)?(min|max)\(", lambda x: {"min": "max", "max": "min"}[x]),
]

# A bound that is off by one; between numbers that are never equal the other sense, for a bound with = is no fault there.
BOUND = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="}
SENSE = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}
BETWEEN_REALS = re.compile(r"\.[0-9]|1e|std::(abs|sqrt|fabs|hypot)|norm|double|Pack|tolerance|residual|trace|det\b|size\b(?!\()|least|weight|volume|stretch|error|scale")

# Lines that compute nothing: messages, tables of parameters, sizes of memory, what only speed depends on; and what must be known to the
# compiler, in which nothing can be switched.
SKIPPED = re.compile(r"constexpr|^\s*(#|///?|\*|template|static_assert|namespace|using |case .*:$)|throw |fmt::|InputError|error\(|message|warn|log\(|describe|"
                     r"\.by_default|\.at_least|\.at_most|\.above|\.below|table\.|reserve\(|alignas|bytes\(\)|sizeof|bytes|prefetch|operations::|"
                     r"batch_points =|\bnotes?_? |pack_width|parallel_for|grain|threads|noexcept = |std::format|operator<<|assert\(")


@dataclass(frozen=True)
class Fault:
    room: str
    kind: str
    path: str
    line: str    # as it stands, without the spaces around it
    which: int   # of equal lines in the file
    column: int
    old: str
    new: str

    @property
    def key(self):
        """The same for as long as the line is, wherever in the file it stands."""
        return hashlib.sha256("|".join(map(str, (self.path, self.line, self.which, self.column, self.old, self.new))).encode()).hexdigest()[:10]

    def planted(self):
        return self.line[: self.column] + self.new + self.line[self.column + len(self.old):]

    def place(self, text):
        """Where in the text of its file the replaced characters begin."""
        begin, equal = 0, 0
        for raw in text.splitlines(keepends=True):
            if raw.strip() == self.line:
                if equal == self.which:
                    return begin + len(raw) - len(raw.lstrip()) + self.column
                equal += 1
            begin += len(raw)
        raise LookupError(f"{self.path} has no line {self.line}")


TOKENS = re.compile(r'"(\\.|[^"\\])*"|\'(\\.|[^\'\\])\'|/\*.*?\*/|//.*$')


def without_comments(line):
    return TOKENS.sub(lambda m: " " * len(m[0]) if m[0][0] == "/" else m[0], line)


def code_of(line):
    """The line with blanks in place of comments and of what stands between quotation marks: columns stay."""
    return TOKENS.sub(lambda m: " " * len(m[0]) if m[0][0] == "/" else m[0][0] + " " * (len(m[0]) - 2) + m[0][0], line)


def in_loop_head(code, column):
    head = re.search(r"\bfor \(", code)
    return bool(head) and column < len(code) and code[head.start(): column].count("(") > code[head.start(): column].count(")")


def faults_of(source, path, room):
    seen = {}
    for raw in (source / path).read_text().splitlines():
        line = raw.strip()
        which = seen.get(line, 0)
        seen[line] = which + 1
        code = code_of(line)
        if not code.strip() or SKIPPED.search(code):
            continue
        for kind, pattern, change in KINDS:
            for match in re.finditer(pattern, code):
                column, old = match.start(1), match[1]
                if kind != "bound" and in_loop_head(code, column):
                    continue   # endless loops and reads out of bounds, which every test sees or none can
                if re.search(r"(?:^|\W)[\w:]+<[^<>;()]*$", code[:column]):
                    continue   # an argument of a template
                if re.match(r"(?!return |delete |else )[\w:<>, ]+[ *]+\w+(\[\w+\])*\[[^\]=(]*$", code[:column]):
                    continue   # the size of an array
                if kind == "comparison":
                    new = (SENSE if BETWEEN_REALS.search(code) else BOUND)[old]
                else:
                    new = change(old)
                yield Fault(room, kind, path, line, which, column, old, new)


def choose(source, count, seed):
    """The faults in the order in which they are planted: rooms in turn, by their shares; in each of them files in turn, kinds in turn."""
    def rank(*what):
        return hashlib.sha256("|".join(map(str, (seed, *what))).encode()).hexdigest()
    total = sum(share for share, _ in ROOMS.values())
    chosen = []
    for room, (share, patterns) in ROOMS.items():
        paths = sorted({str(p.relative_to(source)) for pattern in patterns for p in source.glob(pattern)
                        if p.suffix in (".cpp", ".hpp")})
        by_file = {}
        for path in paths:
            by_kind = {}
            for fault in faults_of(source, path, room):
                by_kind.setdefault(fault.kind, []).append(fault)
            lists = [sorted(faults, key=lambda f: rank(f.key)) for faults in by_kind.values()]
            lists.sort(key=lambda faults: rank(path, faults[0].kind))
            in_turn = [f for layer in itertools.zip_longest(*lists) for f in layer if f]
            if in_turn:
                # Long files are visited more often: one fault for every hundred lines in each turn.
                length = len((source / path).read_text().splitlines())
                by_file[path] = [in_turn[k:k + 1 + length // 100] for k in range(0, len(in_turn), 1 + length // 100)]
        files = sorted(by_file, key=rank)
        of_room = [f for layer in itertools.zip_longest(*(by_file[path] for path in files)) for group in layer if group for f in group]
        of_room = of_room[: round(count * share / total)]
        chosen += [((k + 0.5) / max(len(of_room), 1), fault) for k, fault in enumerate(of_room)]
    return [fault for _, fault in sorted(chosen, key=lambda pair: (pair[0], pair[1].key))]


COLUMNS = ["key", "room", "kind", "path", "which", "column", "line", "old", "new", "result", "by", "seconds", "note"]


class Table:
    """What became of the faults, in a file that is read again."""

    def __init__(self, path):
        self.path = pathlib.Path(path)
        self.rows = {}
        if self.path.exists():
            with self.path.open(newline="") as file:
                self.rows = {row["key"]: row for row in csv.DictReader(file)}

    @staticmethod
    def fault(row):
        return Fault(row["room"], row["kind"], row["path"], row["line"], int(row["which"]), int(row["column"]), row["old"], row["new"])

    def result(self, fault):
        return self.rows[fault.key]["result"] if fault.key in self.rows else ""

    def record(self, fault, result, by="", seconds=0.0, note=""):
        """`seconds`: processor time of its tests."""
        note = note or self.rows.get(fault.key, {}).get("note", "")
        self.rows[fault.key] = dataclasses.asdict(fault) | {"key": fault.key, "result": result, "by": by, "seconds": f"{seconds:.1f}", "note": note}
        new = self.path.with_suffix(".new")
        with new.open("w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(self.rows.values())
        new.replace(self.path)
