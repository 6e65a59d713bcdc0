#!/usr/bin/env python3
"""Do the tests see a fault? Plants small faults one by one in a copy of the sources, builds what changed, and runs the tests of the test
command, those first that are likely to see it, until one fails. What became of each fault stands in a table that is read again: the next
run goes on where the last one stopped, and with the tests that are new. framework/docs/checks.md holds what came of it.

A failure counts where the same test passes without the fault. Results: `caught` (by: the test), `survived` (every test passed),
`undecided` (--patience ended before the tests did), `does not compile`, `equivalent` (the same machine code, or a reason in `note`)."""

import argparse
import hashlib
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from faults import Table, choose

# Tests that look at no number: of packages, pages, includes; of pictures and processes; of the speed of this machine; of readers that
# unit tests cover; of kills and flipped bits at random.
NEVER = re.compile(r"^(unit\.plot|unit\.study|package|out_of_tree|headers_id|layers|reference_page|python|tutorial\..*|benchmark\..*|unit\.machine_limits|ranks\.no_mpi|"
                   r"robustness\.(fuzz_.*|xdmf_.*|write_sample|flipped_libraries|interruptions|resume))$")
DOCTEST = ("perikit_unit", "perikit-contract", "perikit_validation", "perikit_program_test")


class Copy:
    """A copy of the sources with a build of its own."""

    def __init__(self, origin, work, jobs):
        self.origin, self.source, self.build, self.jobs = origin, work / "source", work / "source" / "build" / "quick", jobs
        self.clean_file = work / "clean.json"
        self.temporary = work / "temporary"
        self.temporary.mkdir(parents=True, exist_ok=True)
        self.update()
        if not (self.build / "build.ninja").exists():
            launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
            subprocess.run(["cmake", "-S", self.source, "-B", self.build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_CXX_FLAGS_RELEASE=-O1",
                            "-DPERIKIT_TESTS=ON", "-DCMAKE_LINK_DEPENDS_NO_SHARED=ON", *launcher], check=True, stdout=subprocess.DEVNULL)
        if not self.make():
            sys.exit("the sources do not build without a fault: ninja -C " + str(self.build))
        self.clean = {path: digest(path) for path in self.products()}

    def update(self):
        """Every tracked or new file of the origin as it is now."""
        files = subprocess.run(["git", "-C", self.origin, "ls-files", "-z", "--cached", "--others", "--exclude-standard"], check=True, capture_output=True, text=True)
        wanted = {f for f in files.stdout.split("\0") if f and (self.origin / f).is_file()}
        for name in wanted:
            to = self.source / name
            if not to.exists() or to.read_bytes() != (self.origin / name).read_bytes():
                to.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(self.origin / name, to)
                os.utime(to)
        for path in self.source.rglob("*"):
            name = path.relative_to(self.source)
            if path.is_file() and name.parts[0] != "build" and str(name) not in wanted:
                path.unlink()

    def products(self):
        return sorted(p for folder in ("bin", "lib", "lib/perikit") for p in (self.build / folder).glob("*") if p.is_file() and not p.is_symlink())

    def make(self):
        return subprocess.run(["ninja", "-C", self.build, f"-j{self.jobs}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0

    def same_code(self):
        return all(digest(path) == sum_ for path, sum_ in self.clean.items())

    def plant(self, fault):
        (self.source / fault.path).write_text(fault.plant(self.origin))

    def restore(self, fault):
        (self.source / fault.path).write_text((self.origin / fault.path).read_text())


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def wait_for(pid, limit):
    """Processor time of the process and of those that it waited for, and its exit status; None where it was killed, as after `limit` seconds."""
    end = time.monotonic() + limit
    while True:
        found, status, usage = os.wait4(pid, os.WNOHANG)
        if not found and time.monotonic() < end:
            time.sleep(0.02)
            continue
        try:
            os.killpg(pid, signal.SIGKILL)   # with all that it started
        except ProcessLookupError:
            pass
        if not found:
            _, status, usage = os.wait4(pid, 0)
        return usage.ru_utime + usage.ru_stime, os.WEXITSTATUS(status) if os.WIFEXITED(status) else None


class Tests:
    def __init__(self, copy, table):
        self.copy, self.table = copy, table
        shown = subprocess.run(["ctest", "--show-only=json-v1"], cwd=copy.build, check=True, capture_output=True, text=True)
        self.tests = {t["name"]: t for t in json.loads(shown.stdout)["tests"] if not NEVER.match(t["name"])}
        self.spent = 0.0     # processor time of all tests so far
        self.seconds = {}    # of passes, processor time
        self.clean = {}      # whether it passes without a fault
        if copy.clean_file.exists():
            known = json.loads(copy.clean_file.read_text())
            self.seconds, self.clean = known["seconds"], known["clean"]

    def guess(self, name):
        if name in self.seconds:
            return self.seconds[name]
        for pattern, seconds in ((r"^unit\.(study|plot|dense)", 10), (r"^unit", 0.5), (r"^contract\.kinematics\.conventional", 15), (r"^contract\.(kinematics|third|stab)", 60),
                                 (r"^(ranks|papers|work_precision)", 150), (r"^robustness", 15)):
            if re.match(pattern, name):
                return seconds
        return 10

    def order(self, fault):
        """Those first that saw faults nearby, for each second that they take."""
        caught = [row for row in self.table.rows.values() if row["result"] == "caught"]
        folder = pathlib.Path(fault.path).parent.name
        stem = pathlib.Path(fault.path).stem

        def worth(name):
            value = 0.2 + sum(3.0 if row["path"] == fault.path else 1.0 if row["room"] == fault.room else 0.2 for row in caught if row["by"] == name)
            if name.split(".")[-1] in (folder, stem):
                value += 3.0
            return value / (self.guess(name) + 0.3)
        return sorted((n for n in self.tests if self.clean.get(n, True)), key=lambda n: -worth(n))

    def run(self, name):
        """Whether it passed."""
        test = self.tests[name]
        properties = {p["name"]: p["value"] for p in test["properties"]}
        command = list(test["command"])
        if pathlib.Path(command[0]).name in DOCTEST:
            command.append("--abort-after=1")
        environment = os.environ | {"OMP_WAIT_POLICY": "passive", "TMPDIR": str(self.copy.temporary)}
        environment |= dict(pair.split("=", 1) for pair in properties.get("ENVIRONMENT", []))
        limit = 60 + int(15 * self.guess(name))   # of processor time: this machine may be busy

        def limits():
            resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
            resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        with tempfile.TemporaryFile(dir=self.copy.temporary) as output:
            process = subprocess.Popen(command, cwd=properties.get("WORKING_DIRECTORY", self.copy.build), env=environment, stdin=subprocess.DEVNULL,
                                       stdout=output, stderr=subprocess.STDOUT, start_new_session=True, preexec_fn=limits)
            spent, status = wait_for(process.pid, 40 * limit)
            output.seek(0)
            said = output.read()
        self.spent += spent
        passed = status == 0
        expected = properties.get("PASS_REGULAR_EXPRESSION")
        if expected:
            passed = any(re.search(e, said.decode(errors="replace")) for e in expected)
        passed = passed or status == properties.get("SKIP_RETURN_CODE")
        if passed:
            self.seconds[name] = spent
        return passed

    def save(self):
        self.copy.clean_file.write_text(json.dumps({"seconds": self.seconds, "clean": self.clean}, indent=1))

    def believable(self, name, fault):
        """Whether the test passes without the fault, and fails with it a second time: a busy machine fails tests of its own."""
        if name not in self.clean:
            self.copy.restore(fault)
            self.copy.make()
            self.clean[name] = self.run(name) or self.run(name)
            self.save()
            self.copy.plant(fault)
            self.copy.make()
            if not self.clean[name]:
                print(f"  {name} fails without a fault: left out", flush=True)
        return self.clean[name] and not self.run(name)


def examine(copy, tests, fault, passed, patience):
    """Result, test."""
    copy.plant(fault)
    if not copy.make():
        return "does not compile", ""
    if copy.same_code():
        return "equivalent", ""
    start = tests.spent
    for name in tests.order(fault):
        if name in passed:
            continue
        if tests.spent - start > patience:
            return "undecided", ""
        if not tests.run(name) and tests.believable(name, fault):
            return "caught", name
        passed.append(name)
    return "survived", ""


def report(table, faults):
    rows = [table.rows[f.key] for f in faults if f.key in table.rows]
    count = {result: sum(row["result"] == result for row in rows) for result in sorted({row["result"] for row in rows})}
    seen, real = count.get("caught", 0), count.get("caught", 0) + count.get("survived", 0)
    print(", ".join(f"{n} {result}" for result, n in count.items()) + (f"; {100 * seen / real:.1f} % of {real} caught" if real else ""))
    for row in rows:
        if row["result"] in ("survived", "undecided"):
            print(f"{row['result']}: {row['path']}: {Table.fault(row).planted()}    [{row['old']}]  {row['key']}")


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("work", type=pathlib.Path, help="a folder of its own for the copy and its build")
    arguments.add_argument("--count", type=int, default=200, help="faults that compile")
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--table", type=pathlib.Path, default=pathlib.Path(__file__).parent / "planted.csv")
    arguments.add_argument("--patience", type=float, default=1e9, help="seconds of processor time of tests after which a fault is left undecided")
    arguments.add_argument("--again", default="", metavar="RESULTS", help="faults with these results are tried again, such as survived,undecided")
    arguments.add_argument("--only", default="", metavar="KEYS", help="these faults alone")
    arguments.add_argument("--jobs", type=int, default=1)
    arguments.add_argument("--report", action="store_true", help="says what stands in the table, and plants nothing")
    given = arguments.parse_args()
    origin = pathlib.Path(__file__).resolve().parents[3]
    table = Table(given.table)
    drawn = choose(origin, given.count + given.count // 4, given.seed)
    by_hand = [Table.fault(row) for row in table.rows.values() if row["room"] == "by hand"]
    faults = by_hand + [f for f in drawn if f.key not in {h.key for h in by_hand}]
    if given.report:
        return report(table, faults)
    copy = Copy(origin, given.work.resolve(), given.jobs)
    tests = Tests(copy, table)
    passed_file = given.work / "passed.json"
    passed = json.loads(passed_file.read_text()) if passed_file.exists() else {}
    compiled = 0
    for fault in faults:
        row = table.rows.get(fault.key)
        known = row["result"] if row else ""
        again = known in given.again.split(",") or fault.key in given.only.split(",")
        if (known and not again) or (given.only and fault.key not in given.only.split(",")):
            compiled += known != "does not compile"
            continue
        if compiled >= given.count:
            break
        if known == "survived":
            passed.pop(fault.key, None)   # a test has been added to, maybe
        start = time.monotonic()
        try:
            result, by = examine(copy, tests, fault, passed.setdefault(fault.key, []), given.patience)
        finally:
            copy.restore(fault)
            passed_file.write_text(json.dumps(passed))
            tests.save()
        compiled += result != "does not compile"
        table.record(fault, result, by, time.monotonic() - start)
        print(f"{compiled} {result} {by} [{time.monotonic() - start:.0f} s] {fault.path}: {fault.planted()[:140]}   ({fault.old})", flush=True)
    report(table, faults)


if __name__ == "__main__":
    main()
