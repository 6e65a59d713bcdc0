"""What `perikit check` says of the memory of a process is what runs take, on one rank and on several.

usage: memory.py PROGRAM LIBRARY WORK
"""

import os
import re
import shutil
import subprocess
import sys

from scenes import ENVIRONMENT, need, run, scene

PROGRAM, LIBRARY, WORK = sys.argv[1:]
BOUND = 0.15
failed = []

SCENES = {
    "lattice, conventional": ('type = "conventional"', False, 56),
    "lattice, baqp": ('type = "baqp"', False, 40),
    "cloud, conventional": ('type = "conventional"', True, 34),
    "cloud, bond_based": ('type = "bond_based"', True, 40),
    "cloud, baqp": ('type = "baqp"', True, 24),
}


def said(text, words):
    return float(re.search(words, text).group(1))


def predicted(file, ranks):
    done = subprocess.run([PROGRAM, "check", file, "--threads", "1"] + (["--ranks", str(ranks)] if ranks else []),
                          env=ENVIRONMENT, capture_output=True, text=True, timeout=300)
    return said(done.stdout, r"rank.*, about ([\d.e+]+) MB a process at most" if ranks else r"process +about ([\d.e+]+) MB")


need(LIBRARY)
shutil.rmtree(WORK, ignore_errors=True)
os.makedirs(WORK)
for name, (kinematics, cloud, side) in SCENES.items():
    text = scene(kinematics, 3, cloud, 'type = "verlet"\nend_time = 0.2\ntime_step = 0.1\nallow_unstable = true', cells=[side] * 3)
    text = text[:text.index("fields = ")]
    for ranks in (0, 2, 4):
        folder = WORK + "/run"
        done = run(PROGRAM, text, folder, ranks)
        if done.returncode != 0:
            print(done.stderr)
            failed.append(name)
            continue
        with open(folder + "/run.log") as log:
            taken = said(log.read(), r"arrays, ([\d.e+]+) MB at most")
        expected = predicted(folder + ".toml", ranks)
        right = abs(expected - taken) <= BOUND * taken
        print("%s %-22s %d ranks: %.0f MB taken, %.0f MB predicted" % ("ok     " if right else "FAILED ", name, max(ranks, 1), taken, expected), flush=True)
        if not right:
            failed.append(name)
print("%d predictions failed" % len(failed))
sys.exit(1 if failed else 0)
