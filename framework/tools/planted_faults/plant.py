#!/usr/bin/env python3
"""Do the tests see a fault? Plants small faults in a copy of the sources, all at once, each behind a switch that the environment variable
PERIKIT_FAULT throws (switches.py), builds that copy, and runs the tests of the test command with one fault after the other: case by case
(units.py), only those that reach the fault, the quick ones first, until one fails. What became of each fault stands in a table that is read
again: the next run goes on where the last one stopped, and with the tests that are new. framework/docs/checks.md holds what came of it.

A failure counts where the same case passes without the fault, and fails twice with it. Results: `caught` (by: the case), `survived` (every
case that reaches it passed), `equivalent` (a person says why in `note`), `no switch` (must be known to the compiler: another takes its place)."""

import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

from faults import Table, choose
from switches import lines_of, switched
from units import Units

ROUNDS = (1, 4, 20, 100, 1500)   # seconds: cases that take longer wait until the quicker ones have been tried


class Copy:
    """A copy of the sources with a build of its own, and the numbers of the faults that are planted in it."""

    def __init__(self, origin, work, jobs):
        self.origin, self.source, self.build, self.jobs = origin, work / "source", work / "source" / "build" / "quick", jobs
        self.numbers_file = work / "numbers.json"
        self.numbers = json.loads(self.numbers_file.read_text()) if self.numbers_file.exists() else {}

    def number(self, fault):
        return self.numbers.setdefault(fault.key, len(self.numbers) + 1)

    def update(self, faults):
        """Every tracked or new file of the origin as it is now, with these faults; the keys of those for which there is no room beside others."""
        files = subprocess.run(["git", "-C", self.origin, "ls-files", "-z", "--cached", "--others", "--exclude-standard"], check=True, capture_output=True, text=True)
        wanted = {f for f in files.stdout.split("\0") if f and (self.origin / f).is_file()}
        header = self.origin / "framework/tools/planted_faults/planted_fault.hpp"
        by_path, crowded = {}, set()
        for fault in faults:
            by_path.setdefault(fault.path, []).append((self.number(fault), fault))
        self.numbers_file.write_text(json.dumps(self.numbers))
        for name in wanted:
            content = (self.origin / name).read_bytes()
            if name in by_path:
                text, cut = switched(content.decode(), by_path[name])
                crowded |= {fault.key for number, fault in by_path[name] if number in cut}
                content = f'#include "{header}"\n#line 1 "{self.source / name}"\n{text}'.encode()
            to = self.source / name
            if not to.exists() or to.read_bytes() != content:
                to.parent.mkdir(parents=True, exist_ok=True)
                to.write_bytes(content)
                shutil.copymode(self.origin / name, to)
        for path in self.source.rglob("*"):
            name = path.relative_to(self.source)
            if path.is_file() and name.parts[0] != "build" and str(name) not in wanted:
                path.unlink()
        return crowded

    def make(self):
        """What the compiler said, where it failed."""
        if not (self.build / "build.ninja").exists():
            launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
            subprocess.run(["cmake", "-S", self.source, "-B", self.build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_CXX_FLAGS_RELEASE=-O1",
                            "-DPERIKIT_TESTS=ON", "-DCMAKE_LINK_DEPENDS_NO_SHARED=ON", *launcher], check=True, stdout=subprocess.DEVNULL)
        made = subprocess.run(["ninja", "-C", self.build, f"-j{self.jobs}", "-k", "0"], capture_output=True, text=True)
        (self.build / "make.log").write_text(made.stdout)
        return made.stdout if made.returncode else ""

    def culprits(self, said, faults):
        """Those of the faults whose lines the compiler complains about; where it names none, those whose lines led to what it complains about."""
        by_path = {}
        for fault in faults:
            by_path.setdefault(fault.path, []).append((self.number(fault), fault))
        lines = {path: lines_of((self.origin / path).read_text(), of_file) for path, of_file in by_path.items()}

        def named(pattern):
            places = {(name, int(line)) for name, line in re.findall(rf"{re.escape(str(self.source))}/([^:\s]+):(\d+):\d+: *{pattern}", said)}
            return {f.key for f in faults if any((f.path, line) in places for line in lines[f.path].get(self.number(f), ()))}
        return named("(?:fatal )?error") or named("(?:note|required|in )")


def make_all(copy, table, faults):
    """The copy with all faults that can be switched, built."""
    while True:
        faults = [f for f in faults if table.result(f) != "no switch"]
        bad = copy.update(faults)
        said = "" if bad else copy.make()
        if not bad and not said:
            return faults
        bad |= copy.culprits(said, faults)
        if not bad:
            sys.exit(f"the copy does not build, and no fault is known to be the reason: {copy.build}/make.log")
        for fault in faults:
            if fault.key in bad:
                print(f"no switch: {fault.path}: {fault.planted()[:140]}", flush=True)
                table.record(fault, "no switch")


class Trial:
    """Faults against units."""

    def __init__(self, copy, units, table, passed_file):
        self.copy, self.units, self.table, self.passed_file = copy, units, table, passed_file
        self.passed = json.loads(passed_file.read_text()) if passed_file.exists() else {}
        self.spent = {}   # processor time, by fault

    def waiting(self, fault):
        """Units that are to be run with it, those first that saw faults nearby or reach few, for each second that they take."""
        number, done = self.copy.number(fault), self.passed.get(fault.key, [])
        caught = {}
        for row in self.table.rows.values():
            if row["result"] == "caught":
                caught[row["by"]] = caught.get(row["by"], 0) + (3.0 if row["path"] == fault.path else 1.0 if row["room"] == fault.room else 0.2)
        folder, stem = pathlib.Path(fault.path).parent.name, pathlib.Path(fault.path).stem

        def worth(unit):
            test = unit.name.split(":")[0].split(".")[-1]
            return (0.2 + caught.get(unit.name, 0) + (2.0 if test in (folder, stem) else 0.0)) / (unit.seconds + 0.1) / (10 + len(unit.reached))
        return sorted((u for u in self.units.all.values() if u.good and number in (u.reached or ()) and u.name not in done), key=worth, reverse=True)

    def examine(self, fault):
        """Whether one of the units that are known so far catches it."""
        number = self.copy.number(fault)
        for unit in self.waiting(fault):
            self.spent[fault.key] = self.spent.get(fault.key, 0.0) + unit.seconds
            found = self.units.fails_with(unit, number)
            if found and (found == "time" or self.units.fails_with(unit, number)):
                self.table.record(fault, "caught", unit.name, self.spent[fault.key], "by its time" if found == "time" else "")
                return True
            self.passed.setdefault(fault.key, []).append(unit.name)
        return False

    def save(self):
        self.passed_file.write_text(json.dumps(self.passed))
        self.units.save()

    def run(self, faults, wanted):
        """wanted: a pattern of the names of cases; where it leaves out some, faults that all others miss stay open."""
        open_faults, start = list(faults), time.monotonic()
        for limit in ROUNDS:
            for k, unit in enumerate(self.units.all.values()):
                if open_faults and re.search(wanted, unit.name):
                    self.units.measure(unit, limit)
                if k % 100 == 99:
                    self.units.save()
            self.units.save()
            print(f"[{time.monotonic() - start:.0f} s] cases of at most {limit} s measured; {len(open_faults)} faults are open", flush=True)
            for fault in list(open_faults):
                if self.examine(fault):
                    open_faults.remove(fault)
                    row = self.table.rows[fault.key]
                    print(f"[{time.monotonic() - start:.0f} s] caught by {row['by']}: {fault.path}: {fault.planted()[:140]}   ({fault.old})", flush=True)
                self.save()
        for fault in open_faults if not wanted else []:
            reaching = sum(self.copy.number(fault) in (u.reached or ()) for u in self.units.all.values())
            self.table.record(fault, "survived", f"{reaching} cases reach it", self.spent.get(fault.key, 0.0))


def report(table, faults):
    rows = [table.rows[f.key] for f in faults if f.key in table.rows]
    count = {result: sum(row["result"] == result for row in rows) for result in sorted({row["result"] for row in rows})}
    seen, real = count.get("caught", 0), count.get("caught", 0) + count.get("survived", 0)
    print(", ".join(f"{n} {result}" for result, n in count.items()) + (f"; {100 * seen / real:.1f} % of {real} caught" if real else ""))
    for row in rows:
        if row["result"] == "survived":
            print(f"survived ({row['by']}): {row['path']}: {Table.fault(row).planted()}    [{row['old']}]  {row['key']}")


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("work", type=pathlib.Path, help="a folder of its own for the copy and its build")
    arguments.add_argument("--count", type=int, default=200, help="faults that can be switched")
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--table", type=pathlib.Path, default=pathlib.Path(__file__).parent / "planted.csv")
    arguments.add_argument("--again", default="", metavar="RESULTS", help="faults with these results are tried with the cases that are new: survived")
    arguments.add_argument("--anew", default="", metavar="PATTERN", help="cases whose names match have changed: they are measured and tried anew")
    arguments.add_argument("--cases", default="", metavar="PATTERN", help="of the slow cases only those whose names match; what they miss stays open")
    arguments.add_argument("--jobs", type=int, default=1, help="of the build")
    arguments.add_argument("--report", action="store_true", help="says what stands in the table, and plants nothing")
    given = arguments.parse_args()
    origin = pathlib.Path(__file__).resolve().parents[3]
    table = Table(given.table)
    by_hand = [Table.fault(row) for row in table.rows.values() if row["room"] == "by hand"]
    drawn = choose(origin, given.count + given.count // 4, given.seed)
    faults = by_hand + [f for f in drawn if f.key not in {h.key for h in by_hand}]

    def chosen(planted):
        return by_hand + [f for f in planted if f not in by_hand and table.result(f) != "no switch"][:given.count]
    if given.report:
        return report(table, chosen(faults))
    work = given.work.resolve()
    work.mkdir(parents=True, exist_ok=True)
    os.environ.pop("PERIKIT_FAULT", None)
    copy = Copy(origin, work, given.jobs)
    faults = chosen(make_all(copy, table, faults))
    trial = Trial(copy, Units(copy.build, work), table, work / "passed.json")
    if given.anew:
        for unit in trial.units.all.values():
            if re.search(given.anew, unit.name):
                unit.reached, unit.slower = None, 0.0
        trial.passed = {key: [n for n in names if not re.search(given.anew, n)] for key, names in trial.passed.items()}
    trial.run([f for f in faults if table.result(f) in ("", *given.again.split(","))], given.cases)
    report(table, faults)


if __name__ == "__main__":
    main()
