"""Runs a lesson as a reader would: lesson.py LESSON.md ROOT BUILD FOLDER.

Blocks marked sh and python are run one after the other in FOLDER, which is emptied first and sees configs/ and the program. A block marked text
shows what the block before it prints: each of its lines must be a line of that output. Numbers may differ by 1 %, and `...` is anything.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

TOLERANCE = 1e-2


def blocks(text):
    """Language and text of each fenced block."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def number(word):
    try:
        return float(word.strip(",;()|"))
    except ValueError:
        return None


def same_word(expected, found):
    a, b = number(expected), number(found)
    if a is None or b is None:
        return expected in ("...", found)
    return abs(a - b) <= TOLERANCE * max(abs(a), abs(b))


def same_line(expected, found):
    a, b = expected.split(), found.split()
    if "..." in a and a.index("...") == len(a) - 1:
        a, b = a[:-1], b[: len(a) - 1]
    return len(a) == len(b) and all(map(same_word, a, b))


def main(lesson, root, build, folder):
    root, build, folder = (pathlib.Path(path).resolve() for path in (root, build, folder))
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "configs").symlink_to(root / "configs")
    environment = os.environ | {"PATH": f"{build / 'bin'}:{os.environ['PATH']}", "PYTHONPATH": str(root / "framework" / "python"), "OMP_WAIT_POLICY": "passive"}
    environment.pop("PERIKIT_PLUGIN_PATH", None)
    output, ran = [], 0
    for language, text in blocks(pathlib.Path(lesson).read_text(encoding="utf-8")):
        if language == "text":
            for line in filter(str.strip, text.splitlines()):
                if not any(same_line(line, found) for found in output):
                    sys.exit(f"{lesson} shows\n  {line}\nwhich is no line of\n" + "\n".join(output))
        elif language in ("sh", "python"):
            command = ["bash", "-euo", "pipefail", "-c", text] if language == "sh" else [sys.executable, "-c", text]
            result = subprocess.run(command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            output = result.stdout.splitlines()
            print("\n".join(output))
            if result.returncode != 0:
                sys.exit(f"{lesson}: status {result.returncode} of\n{text}")
            ran += 1
    if ran == 0:
        sys.exit(f"{lesson} has nothing to run")


main(*sys.argv[1:])
