"""`perikit contract` where the suites are missing: contract_built.py PERIKIT LIBRARIES SCRATCH.

A copy of the program in a build folder of its own, whose project stands for perikit's: its target perikit_contract is a program that says what it is called
with. The suites themselves take minutes.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

PERIKIT, LIBRARIES, SCRATCH = (pathlib.Path(word).resolve() for word in sys.argv[1:])

PROJECT = """cmake_minimum_required(VERSION 3.25)
project(toy CXX)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
set(CMAKE_CXX_STANDARD 20)
add_executable(perikit_contract EXCLUDE_FROM_ALL suites.cpp other_contract.cpp)
set_target_properties(perikit_contract PROPERTIES OUTPUT_NAME perikit-contract)
"""
SUITES = """#include <cstdio>
int other();
[[gnu::used]] constexpr char build_id[] = BUILD_ID;
int main(int, char** words) { std::printf("suites of %s\\n", words[1]); return other(); }
"""


def expect(condition, result):
    if not condition:
        raise SystemExit(f"status {result.returncode}\n--- out\n{result.stdout}\n--- err\n{result.stderr}")


def build_id():
    """That of the program: it holds it as a text."""
    return re.search(rb"(gcc|clang)\d+ [^\0]* headers-[0-9a-f]{12}", PERIKIT.read_bytes()).group().decode()


class Desk:
    def __init__(self, name, generator):
        self.sources, self.build = SCRATCH / name / "sources", SCRATCH / name / "build"
        self.sources.mkdir(parents=True)
        (self.build / "bin").mkdir(parents=True)
        shutil.copy(PERIKIT, self.build / "bin/perikit")
        (self.build / "lib").symlink_to(LIBRARIES)
        (self.sources / "CMakeLists.txt").write_text(PROJECT)
        (self.sources / "suites.cpp").write_text(SUITES.replace("BUILD_ID", f'"{build_id()}"'))
        (self.sources / "other_contract.cpp").write_text("int other() { return 0; }\n")
        if generator:
            subprocess.run(["cmake", "-S", self.sources, "-B", self.build, "-G", generator], check=True, stdout=subprocess.DEVNULL)

    def start(self):
        return subprocess.Popen([self.build / "bin/perikit", "contract", "law.so"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def contract(self, process=None):
        process = process or self.start()
        out, err = process.communicate()
        return subprocess.CompletedProcess("contract", process.returncode, out, err)

    def command(self):
        return f"cmake --build {self.build} --target perikit_contract"


shutil.rmtree(SCRATCH, ignore_errors=True)
first = "the contract suites are not built yet: building them, which takes a minute or two (cmake --build"

# Built when first asked for, with the share that is done; then there.
generators = ["Unix Makefiles"] + (["Ninja"] if shutil.which("ninja") else [])
for generator in generators:
    desk = Desk(generator.split()[-1], generator)
    built = desk.contract()
    expect(built.returncode == 0 and built.stdout == "suites of --library=law.so\n" and first in built.stderr, built)
    again = desk.contract()
    expect(again.returncode == 0 and again.stdout == built.stdout and again.stderr == "", again)

# Two at once: one builds.
(desk.build / "bin/perikit-contract").unlink()
results = [desk.contract(process) for process in [desk.start(), desk.start()]]
for result in results:
    expect(result.returncode == 0 and result.stdout == "suites of --library=law.so\n", result)
expect(sum("not built yet" in result.stderr for result in results) == 1, results[0])

# Suites of another build are built again, and say so where they cannot be.
(desk.build / "bin/perikit-contract").write_text("of an earlier build")
os.utime(desk.build / "bin/perikit-contract", (0, 0))
changed = desk.contract()
expect(changed.returncode == 0 and "the contract suites are of another build of perikit: building them" in changed.stderr, changed)

# What the compiler says, and a status, where it fails.
(desk.sources / "other_contract.cpp").write_text("int other() { return nothing_like_that; }\n")
(desk.build / "bin/perikit-contract").unlink()
failed = desk.contract()
expect(failed.returncode == 1 and "nothing_like_that" in failed.stderr, failed)
expect(f"the contract suites cannot be built: {desk.command()} ended with status" in failed.stderr, failed)

# One line where there is nothing to build them from.
shutil.rmtree(desk.sources)
gone = desk.contract()
expect(gone.returncode == 2 and f"not built yet, and cannot be: {desk.sources}/CMakeLists.txt is not there any more" in gone.stderr and gone.stderr.count("\n") == 1, gone)
installed = Desk("installed", None).contract()
expect(installed.returncode == 2 and installed.stderr.count("\n") == 1, installed)
expect("not built yet: in the folder that perikit was built in, cmake --build . --target perikit_contract, and install it again" in installed.stderr, installed)
