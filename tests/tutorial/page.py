"""Runs a page of the documentation as a reader would: page.py ROOT BUILD FOLDER PAGE.md...

Blocks marked sh and python are run one after the other in FOLDER, which is emptied first and sees configs/, framework/ and the program. A block marked
text shows what the block before it prints: each of its lines must be a line of that output. Numbers may differ by one in their last digit shown, or by 1 %
after a comment `<!-- to 1 %: REASON -->`, and `...` is anything. A block marked toml is a scene that `perikit check` takes, or a part of one whose keys are those of the reference page; one marked cpp stands in some source. A
comment `<!-- not run: REASON -->` before a block leaves it out. Links to files and headings must lead somewhere.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

import environment
import links
import vocabulary

COMMANDS = r"(perikit|framework/tools/\S+|build/\S+|cmake|ctest|ninja|mpirun|sudo|export|pip|python3?)( |$)"


def blocks(text):
    """Language and text of each fenced block, why it is not run, and why it holds to 1 % only (both mostly empty)."""
    comment = r"(?:^<!-- not run: ([^\n]*?) -->\n|^<!-- to 1 %: ([^\n]*?) -->\n)?"
    found = re.findall(comment + r"^```(\w*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return [(language, block, unrun, rough) for unrun, rough, language, block in found]


def number(word):
    """The value of a word and of a one in its last digit; None where it is no number."""
    digits = re.fullmatch(r"([-+]?\d*\.?(\d*))(e[-+]?\d+)?", word.strip(",;()|"))
    if not digits or not re.search(r"\d", digits.group(1)):
        return None
    decimals, exponent = len(digits.group(2)) if "." in digits.group(1) else 0, digits.group(3) or "e0"
    return float(digits.group(1) + exponent), float(f"1e{int(exponent[1:]) - decimals}")


def same_word(expected, found, rough):
    a, b = number(expected), number(found)
    if a is None or b is None:
        return expected in ("...", found)
    return abs(a[0] - b[0]) <= (1e-2 * max(abs(a[0]), abs(b[0])) if rough else 1.01 * a[1])


def same_line(expected, found, rough):
    a, b = expected.split(), found.split()
    if "..." in a and a.index("...") == len(a) - 1:
        a, b = a[:-1], b[: len(a) - 1]
    return len(a) == len(b) and all(same_word(x, y, rough) for x, y in zip(a, b))


class Page:
    def __init__(self, path, root, build, folder):
        self.path, self.root, self.build, self.folder = path, root, build, folder
        self.python = environment.interpreter(build / "tutorial" / "python", root / "framework" / "python")
        if self.python is None:
            print(f"not from an installed module: {environment.what_is_missing()}")
        self.output, self.ran = [], 0

    def fail(self, message):
        sys.exit(f"{self.path}: {message}")

    def run(self, command, text):
        variables = environment.without_python_path() | {"PATH": f"{self.build / 'bin'}:{os.environ['PATH']}", "OMP_WAIT_POLICY": "passive"}
        variables.pop("PERIKIT_PLUGIN_PATH", None)
        if self.python is None:
            variables["PYTHONPATH"] = str(self.root / "framework" / "python")
        result = subprocess.run(command, cwd=self.folder, env=variables, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.output = result.stdout.splitlines()
        print(result.stdout)
        if result.returncode != 0:
            self.fail(f"status {result.returncode} of\n{text}")
        self.ran += 1

    def block(self, language, text, rough):
        if language == "sh":
            self.run(["bash", "-euo", "pipefail", "-c", text], text)
        elif language == "python":
            self.run([str(self.python or sys.executable), "-c", text], text)
        elif language == "text":
            for line in filter(str.strip, text.splitlines()):
                if not any(same_line(line, found, rough) for found in self.output):
                    self.fail(f"shows\n  {line}\nwhich is no line of\n" + "\n".join(self.output))
        elif language == "toml" and re.search(r"^format = 1$", text, re.MULTILINE):
            (self.folder / "scene.toml").write_text(text, encoding="utf-8")
            self.run(["perikit", "check", "scene.toml"], text)
        elif language == "toml":
            if fault := vocabulary.fault(text, self.root / "framework" / "docs" / "reference.md"):
                self.fail(f"{fault} in\n{text}")
        elif language == "cpp":
            if not vocabulary.in_sources(text, self.root):
                self.fail(f"no source has\n{text}")
        elif language == "":   # formulas
            self.no_command(text)
        else:
            self.fail(f"a block marked '{language}'; known: sh, python, text, toml, cpp, none for formulas, and `<!-- not run: REASON -->` before a block")

    def no_command(self, text):
        if command := re.search(rf"^{COMMANDS}.*$", text, re.MULTILINE):
            self.fail(f"a command in no block that could be run:\n{command.group()}")

    def follow(self):
        text = self.path.read_text(encoding="utf-8")
        for language, block, unrun, rough in blocks(text):
            if not unrun:
                self.block(language, block, bool(rough))
        outside = re.sub(r"^```\w*\n.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
        self.no_command("\n".join(line[4:] for line in outside.splitlines() if line.startswith("    ")))
        if fault := links.fault(self.path, outside):
            self.fail(fault)


def main(root, build, folder, *pages):
    root, build, folder = (pathlib.Path(path).resolve() for path in (root, build, folder))
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in ("configs", "framework"):
        (folder / name).symlink_to(root / name)
    for path in map(pathlib.Path, pages):
        page = Page(path.resolve(), root, build, folder)
        page.follow()
        if page.ran == 0 and "tutorial" in path.parts and path.stem != "README":
            page.fail("has nothing to run")


main(*sys.argv[1:])
