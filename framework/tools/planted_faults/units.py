"""The tests of the test command, cut into units as small as can be run alone: cases of doctest, other tests as they are."""

import json
import os
import pathlib
import re
import resource
import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass

# Tests that look at no number: of packages, pages, includes; of pictures and processes; of the speed of this machine; of readers that
# unit tests cover; of kills and flipped bits at random.
NEVER = re.compile(r"^(unit\.plot|unit\.study|package|out_of_tree|headers_id|layers|reference_page|python|tutorial\..*|benchmark\..*|unit\.machine_limits|ranks\.no_mpi|"
                   r"robustness\.(fuzz_.*|xdmf_.*|write_sample|flipped_libraries|interruptions|resume))$")
DOCTEST = ("perikit_unit", "perikit-contract", "perikit_validation", "perikit_program_test")
BYTES = 4096   # as in planted_fault.hpp


@dataclass
class Unit:
    name: str
    command: list
    properties: dict
    folder: str
    seconds: float = 0.0            # of processor time, without a fault
    reached: frozenset = None       # numbers of faults; None: not measured yet
    good: bool = True               # passes without a fault
    slower: float = 0.0             # seconds that were too few to measure it


def limited(seconds):
    def set_limits():
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 1))
        resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    return set_limits


def wait_for(pid, limit):
    """Processor time of the process and of those that it waited for, its exit status (None: killed), and whether `limit` seconds were too few."""
    end = time.monotonic() + limit
    pause = 0.002
    while True:
        found, status, usage = os.wait4(pid, os.WNOHANG)
        if not found and time.monotonic() < end:
            time.sleep(pause)
            pause = min(0.05, 1.2 * pause)
            continue
        try:
            os.killpg(pid, signal.SIGKILL)   # with all that it started
        except ProcessLookupError:
            pass
        late = not found
        if late:
            _, status, usage = os.wait4(pid, 0)
        late = late or (os.WIFSIGNALED(status) and os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL))
        return usage.ru_utime + usage.ru_stime, os.WEXITSTATUS(status) if os.WIFEXITED(status) else None, late


class Units:
    def __init__(self, build, work):
        self.build, self.temporary, self.file, self.reached_file = build, work / "temporary", work / "units.json", work / "reached"
        self.temporary.mkdir(parents=True, exist_ok=True)
        self.all = {}
        shown = subprocess.run(["ctest", "--show-only=json-v1"], cwd=build, check=True, capture_output=True, text=True)
        for test in json.loads(shown.stdout)["tests"]:
            if not NEVER.match(test["name"]):
                for unit in self.cases(test):
                    self.all[unit.name] = unit
        known = json.loads(self.file.read_text()) if self.file.exists() else {}
        for name, (seconds, reached, good, slower) in known.items():
            if name in self.all:
                unit = self.all[name]
                unit.seconds, unit.reached, unit.good, unit.slower = seconds, reached if reached is None else frozenset(reached), good, slower

    def cases(self, test):
        properties = {p["name"]: p["value"] for p in test["properties"]}
        command, folder = test["command"], properties.get("WORKING_DIRECTORY", str(self.build))
        if pathlib.Path(command[0]).name not in DOCTEST or any(word.startswith("--library=") for word in command):
            yield Unit(test["name"], command, properties, folder)
            return
        listed = subprocess.run([*command, "--list-test-cases"], cwd=folder, env=self.environment(properties), check=True, capture_output=True, text=True)
        names = [line for line in listed.stdout.splitlines() if not re.match(r"=====|\[doctest\]", line)]
        for name in dict.fromkeys(names):
            pattern = re.sub(r"[,\\*]", "?", name)   # what doctest's filters do not take as it stands
            words = [word for word in command if not word.startswith("--test-case=")]
            yield Unit(f"{test['name']}: {name}", [*words, f"--test-case={pattern}", "--abort-after=1"], properties, folder)

    def environment(self, properties, **more):
        pairs = dict(pair.split("=", 1) for pair in properties.get("ENVIRONMENT", []))
        return os.environ | {"OMP_WAIT_POLICY": "passive", "TMPDIR": str(self.temporary)} | pairs | more

    def run(self, unit, limit, wall, **environment):
        """Whether it passed, processor time, and whether it took longer than `limit` (of processor time, each process) or `wall` seconds."""
        with tempfile.TemporaryFile(dir=self.temporary) as output:
            process = subprocess.Popen(unit.command, cwd=unit.folder, env=self.environment(unit.properties, **environment), stdin=subprocess.DEVNULL,
                                       stdout=output, stderr=subprocess.STDOUT, start_new_session=True, preexec_fn=limited(limit))
            spent, status, late = wait_for(process.pid, wall)
            process.returncode = 0   # waited for
            output.seek(0)
            said = output.read().decode(errors="replace")
        expected = unit.properties.get("PASS_REGULAR_EXPRESSION")
        passed = any(re.search(e, said) for e in expected) if expected else status == 0
        return passed or (status is not None and status == unit.properties.get("SKIP_RETURN_CODE")), spent, late

    def measure(self, unit, limit):
        """Which faults it reaches, and whether it passes without one; nothing where it takes much longer than `limit`."""
        if unit.reached is not None or limit <= unit.slower:
            return
        self.reached_file.write_bytes(bytes(BYTES))
        passed, spent, late = self.run(unit, 3 * limit, 10 * limit, PERIKIT_FAULTS_REACHED=str(self.reached_file))
        if late and not passed:
            unit.slower = limit
            return
        unit.good = passed or self.run(unit, 30 * limit, 100 * limit)[0]
        unit.seconds, unit.reached = spent, frozenset(k for k, byte in enumerate(self.reached_file.read_bytes()) if byte)
        if not unit.good:
            print(f"left out, for it fails without a fault: {unit.name}", flush=True)

    def fails_with(self, unit, number):
        """With this fault at work: '', 'fails' or 'time'."""
        limit = 20 + 15 * unit.seconds
        passed, _, late = self.run(unit, limit, 3 * limit, PERIKIT_FAULT=str(number))
        return "" if passed else "time" if late else "fails"

    def save(self):
        known = {u.name: (round(u.seconds, 3), u.reached if u.reached is None else sorted(u.reached), u.good, u.slower) for u in self.all.values()}
        new = self.file.with_suffix(".new")
        new.write_text(json.dumps(known))
        new.replace(self.file)
