"""Runs on several ranks that do not come to their end: one message, the right status, soon, and results that a run goes on from.

usage: ends.py PROGRAM LIBRARY WORK FOLDER_OF_THE_FAILING_INTEGRATOR
"""

import glob
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import time

from scenes import ENVIRONMENT, check, command, differences, failed, need, run, scene, without_velocity

PROGRAM, LIBRARY, WORK, FAILING = sys.argv[1:]
LIMIT = 10.0   # seconds


def perikit_lines(text, message):
    return sum(message in line for line in text.splitlines())


def throws():
    """One rank throws, the others wait for it."""
    messages = {"input": (2, "thrown on purpose: input"), "run": (1, "the run failed: thrown on purpose: run"),
                "memory": (1, "the run failed: not enough memory"), "other": (1, "internal error: thrown on purpose: other")}
    for rank, place, error in ((2, "construction", "input"), (0, "plan", "other"), (1, "step", "run"), (2, "step", "memory"), (0, "step", "run")):
        text = scene('type = "conventional"', integrator='type = "failing"\nrank = %d\nat = "%s"\nerror = "%s"' % (rank, place, error))
        text = without_velocity(text)
        status, message = messages[error]
        began = time.time()
        done = run(PROGRAM, text, WORK + "/throws", 3, 1, ("--plugin-path", FAILING))
        spent = time.time() - began
        check(done.returncode == status and perikit_lines(done.stderr, message) == 1 and spent < LIMIT,
              "rank %d throws at %s: %s; status %d after %.1f s" % (rank, place, error, done.returncode, spent))
        if done.returncode != status:
            print(done.stderr)


def torn_off():
    """The loads of a quasi-static run tear off what they act on."""
    text = without_velocity(scene('type = "bond_based"', integrator='type = "dynamic_relaxation"\nsteps = 2\ntolerance = 1e-5\ncut_backs = 0', extra='[damage]\ntype = "critical_stretch"\nstretch = 0.03\n'))
    begin, end = text.index("force = "), text.index("[integrator]")
    return text[:begin] + "force = [4.0, 0.0]\n" + text[end:]


def with_points(name, changed):
    """A scene with points of a file, after its lines have been changed."""
    lines = ["x,y,volume"] + ["%.17g,%.17g,1" % (k % 32 + 0.5 + 0.2 * math.sin(3 * k), k // 32 + 0.5 + 0.2 * math.cos(5 * k)) for k in range(32 * 38)]
    file = "%s/%s.csv" % (WORK, name)
    with open(file, "w") as out:
        out.write("\n".join(changed(lines)))
    text = scene('type = "conventional"', 2, True)
    begin, end = text.index("[body.lattice]"), text.index("[sets]")
    return text[:begin] + '[body.points]\nfile = "%s"\n' % file + text[end:]


def refusals():
    """What all ranks refuse, one says."""
    conventional = 'type = "conventional"'
    for what, text, words in (
            ("a scene with a mistake", scene('type = "conventonal"'), "did you mean"),
            ("newton", without_velocity(scene(conventional, integrator='type = "newton"')), 'found "newton" on 3 ranks'),
            ("statics of a body that nothing holds", without_velocity(scene(conventional, integrator='type = "jfnk"')).replace('set = "low"\ndisplacement', 'set = "middle"\ndisplacement'), "found nothing that holds the body"),
            ("a piece that comes loose under load", torn_off(), "the loads move it"),
            ("jfnk with a preconditioner", without_velocity(scene(conventional, integrator='type = "jfnk"\npreconditioner = "factorisation"')), 'found "jfnk" on 3 ranks'),
            ("more ranks than blocks", scene(conventional, 2, True, cells=[8, 7]), "found 3 ranks for a body of 56 points"),
            ("a file with a mistake far down", with_points("mistake", lambda lines: lines[:950] + ["1,2,3,4"] + lines[950:]), "mistake.csv:951:1: found 4 cells"),
            ("two points at one place", with_points("twice", lambda lines: lines + lines[7:8]), "found two points at ("),
            ("a run that fails", scene(conventional, integrator='type = "verlet"\nend_time = 900.0\ntime_step = 9.0\nallow_unstable = true'), "the run failed: step 1")):
        began = time.time()
        done = run(PROGRAM, text, WORK + "/refused", 3)
        status = 1 if what in ("a run that fails", "a piece that comes loose under load") else 2
        check(done.returncode == status and perikit_lines(done.stderr, words) == 1 and time.time() - began < LIMIT,
              "%s: status %d, said %d times" % (what, done.returncode, perikit_lines(done.stderr, words)))
        if done.returncode != status or perikit_lines(done.stderr, words) != 1:
            print(done.stderr)


def named_pair():
    """Of several pairs of points at one place any number of ranks names the one that comes first in the input."""
    text = with_points("pairs", lambda lines: lines[:1] + lines[:0:-1] + [lines[10], lines[1100], lines[555]])
    x, y = [float(cell) for cell in open(WORK + "/pairs.csv").read().split("\n")[1 + 32 * 38 - 1100].split(",")[:2]]
    expected = "found two points at (%.6g, %.6g, 0)" % (x, y)
    for ranks in (0, 1, 2, 3):
        done = run(PROGRAM, text, WORK + "/pairs", ranks)
        check(done.returncode == 2 and perikit_lines(done.stderr, expected) == 1, "%d ranks name the pair that comes first" % ranks)
        if done.returncode != 2 or perikit_lines(done.stderr, expected) != 1:
            print(done.stderr)


def loose_pieces():
    """Pieces that wind through all parts, or lie in one of them, or hang together across a plane of symmetry alone: any number of ranks names the same."""
    serpentine = "x < 4 || (x > 6 && (cos(pi*y/4) < 0.7 || (cos(pi*y/8) > 0 ? x > 29 : x < 9)))"
    # Several points thick (others are refused), and many as large as each other: of these the one with the first point is named.
    islands = "(x < 5.5 || (cos(pi*(x - 34)/4) < 0.3 && cos(pi*y/5 + 0.01*x) > -0.3))"
    for what, cells, inside, extra in (
            ("a serpentine", [32, 40], serpentine, ""),
            ("islands", [40, 40], islands, ""),
            ("islands at a plane of symmetry", [40, 40], islands, '[[symmetry]]\naxis = "y"\nat = 0.0\n'),
            ("islands in a periodic body", [40, 40], islands, '[[periodic]]\naxis = "y"\nlower = 0.0\nupper = 40.0\n'),
            ("islands in space", [16, 14, 12], "x < 3 || sin(2.3*x)*sin(2.1*y + 0.3*x)*cos(2*z) > 0.2", "")):
        text = without_velocity(scene('type = "conventional"', len(cells), integrator='type = "jfnk"\npreconditioner = "companion"', cells=cells, extra=extra))
        text = text.replace("horizon_ratio = 3.015", "horizon_ratio = 1.5").replace("horizon_ratio = 2.515", "horizon_ratio = 1.5").replace("[sets]", 'inside = "%s"\n[sets]' % inside, 1)
        said = []
        for ranks in (0, 2, 3, 4):
            done = run(PROGRAM, text, WORK + "/loose", ranks)
            found = re.findall("found nothing that holds ([^:]*):", done.stderr)
            said.append(found[0] if len(found) == 1 and done.returncode == 2 else "status %d, %s" % (done.returncode, done.stderr))
        check(said[0].startswith("a piece of") and len(set(said)) == 1, "%s: %s" % (what, said[0] if len(set(said)) == 1 else said))

    # A part that nothing holds is none of a whole body that something does.
    text = without_velocity(scene('type = "conventional"', integrator='type = "jfnk"\npreconditioner = "companion"')).replace('low = "x < 2"', 'low = "x > 30"')
    with open(WORK + "/loose.toml", "w") as out:
        out.write(text)
    done = subprocess.run([PROGRAM, "check", WORK + "/loose.toml", "--ranks", "4"], capture_output=True, text=True, timeout=60)
    check(done.returncode == 0, "check --ranks of a body that is held at one end: %s" % done.stderr)


def other_commands():
    done = subprocess.run(["mpirun", "--oversubscribe", "-np", "2", PROGRAM, "study", "none.toml"], env=ENVIRONMENT, capture_output=True, text=True, timeout=60)
    check(done.returncode == 2 and perikit_lines(done.stderr, "found 2 processes (OMPI_COMM_WORLD_SIZE); allowed: one, but for `perikit run`") == 1, "perikit study on 2 ranks")


def start(text, folder, ranks, options=()):
    shutil.rmtree(folder, ignore_errors=True)
    with open(folder + ".toml", "w") as out:
        out.write(text)
    return subprocess.Popen(command(PROGRAM, folder + ".toml", folder, ranks, 1, options), env=ENVIRONMENT, stderr=subprocess.PIPE, text=True)


def wait_for(folder, frames):
    for _ in range(4000):
        if len(glob.glob(folder + "/frames/*.h5")) >= frames and os.path.exists(folder + "/checkpoint.h5"):
            return
        time.sleep(0.05)
    raise RuntimeError("no frames in " + folder)


LONG = scene('type = "baqp"', 2, False, 'type = "verlet"\nend_time = 12.0\ntime_step = 0.02', cells=[22, 18]).replace("frames = 3", "frames = 8\ncheckpoint_every = 100")


# Of a law that remembers, beside one that does not.
LONG_MEMORY = LONG.replace('type = "saint_venant_kirchhoff"', 'type = "hypoelastic"').replace("[sets]\n", '[sets]\nsome = "x > 11 && y > 7 && x < 21"\n')
LONG_MEMORY += '[[region]]\nset = "some"\nmaterial = { type = "neo_hookean", density = 2.0, shear_modulus = 1.0, bulk_modulus = 3.0 }\n'


# Of a cloud that cracks, and of which ranks have other parts afterwards.
LONG_CLOUD = scene('type = "bond_based"', 2, True, 'type = "verlet"\nend_time = 20.0\ntime_step = 0.01', cells=[32, 38])
LONG_CLOUD = LONG_CLOUD.replace("frames = 3", "frames = 8\ncheckpoint_every = 100").replace('"reaction"]', '"reaction", "damage"]')
LONG_CLOUD = LONG_CLOUD.replace("[[boundary]]", 'velocity = ["0.1*(x - 16)/16", "0.1*sin(x/3)*(y - 19)/19"]\n[[boundary]]', 1)
LONG_CLOUD += '[damage]\ntype = "critical_stretch"\nstretch = 0.02\n'


def pulled_open():
    """A slit that opens in equilibrium, most of it within one load step: its preconditioner is made again and again there."""
    text = without_velocity(scene('type = "baqp"', 2, False, 'type = "jfnk"\npreconditioner = "companion"\nsteps = 6\ntolerance = 1e-8', cells=[30, 20]))
    begin, end = text.index("[[load]]"), text.index("[integrator]")
    text = text[:begin] + '[[boundary]]\nset = "high"\ndisplacement = [1.6, 0]\n' + text[end:]
    text = text.replace("frames = 3", "frames = 7\ncheckpoint_every = 1").replace('"reaction"]', '"reaction", "damage"]')
    return text + '[[crack]]\nsegment = [[14.3, 11.2], [14.3, 22]]\n[damage]\ntype = "critical_stretch"\nstretch = 0.08\n'


PULLED_OPEN = pulled_open()


def output_fails():
    """Rank 0 cannot write a frame; the others wait for it in the next step."""
    folder = WORK + "/output"
    process = start(LONG, folder, 3)
    wait_for(folder, 2)
    began = time.time()
    os.rename(folder + "/frames", folder + "/earlier")
    with open(folder + "/frames", "w"):
        pass
    _, err = process.communicate(timeout=300)
    # Until the next frame is due the run goes on.
    check(process.returncode == 1 and perikit_lines(err, "the run failed") == 1 and time.time() - began < 3 * LIMIT,
          "no folder for frames: status %d after %.1f s" % (process.returncode, time.time() - began))
    if process.returncode != 1:
        print(err)


def shared_output_fails():
    """One rank cannot write its share of a frame: that is said once, and nothing of the frame stays."""
    folder = WORK + "/shared"
    text = without_velocity(scene('type = "conventional"', integrator='type = "failing"\nrank = 2\nat = "step"\nerror = "disk"'))
    began = time.time()
    done = run(PROGRAM, text, folder, 3, 1, ("--plugin-path", FAILING), environment={"PERIKIT_GATHERED_POINTS": "100"})
    frames = sorted(os.listdir(folder + "/frames"))
    check(done.returncode == 1 and perikit_lines(done.stderr, "the run failed") == 1 and perikit_lines(done.stderr, "File too large") == 1
          and frames == ["%08d.h5" % k for k in range(5)] and time.time() - began < LIMIT,
          "a rank cannot write its share: status %d after %.1f s, frames %s" % (done.returncode, time.time() - began, frames))
    if done.returncode != 1:
        print(done.stderr)


def children(process):
    return [int(pid) for pid in subprocess.run(["pgrep", "-P", str(process.pid)], capture_output=True, text=True).stdout.split()]


def stops():
    """A signal to one rank, to mpirun, and a rank that is killed: the run goes on from its checkpoint on another number of ranks, in statics on as many."""
    for name, text, target, number, ranks in (
            ("SIGTERM to one rank, in equilibrium", PULLED_OPEN, lambda p: children(p)[1], signal.SIGTERM, 2),
            ("SIGTERM to one rank", LONG, lambda p: children(p)[1], signal.SIGTERM, 2),
            ("SIGTERM to one rank, with a law that remembers", LONG_MEMORY, lambda p: children(p)[1], signal.SIGTERM, 2),
            ("SIGTERM to one rank, of a cloud", LONG_CLOUD, lambda p: children(p)[1], signal.SIGTERM, 4),
            ("SIGTERM to mpirun", LONG, lambda p: p.pid, signal.SIGTERM, 1),
            ("kill -9 of one rank", LONG, lambda p: children(p)[2], signal.SIGKILL, 1)):
        whole = WORK + {LONG: "/whole", LONG_MEMORY: "/whole_memory", LONG_CLOUD: "/whole_cloud", PULLED_OPEN: "/whole_equilibrium"}[text]
        static = text == PULLED_OPEN
        if not os.path.exists(whole + "/history.csv"):
            done = run(PROGRAM, text, whole, ranks if static else 0)
            check(done.returncode == 0, "a run without a stop")
        folder = WORK + "/stopped"
        process = start(text, folder, ranks if static else 3)
        wait_for(folder, 4 if static else 3)
        began = time.time()
        os.kill(target(process), number)
        _, err = process.communicate(timeout=60)
        spent = time.time() - began
        check(process.returncode != 0 and spent < LIMIT and os.path.exists(folder + "/checkpoint.h5"), "%s: all end after %.1f s with status %d" % (name, spent, process.returncode))
        if name.startswith("SIGTERM to one rank"):
            check(perikit_lines(err, "stopped by a signal") == 1 and process.returncode == 1, name + ": one message")
        done = run(PROGRAM, text, folder, ranks, 1, ("--resume",))
        found = differences(whole, folder) if done.returncode == 0 else [done.stderr]
        check(not found, "%s, then --resume on %d ranks: %s" % (name, ranks, "; ".join(found) or "the run without a stop"))


need(LIBRARY)
shutil.rmtree(WORK, ignore_errors=True)
os.makedirs(WORK)
refusals()
named_pair()
loose_pieces()
throws()
other_commands()
output_fails()
shared_output_fails()
stops()
print("%d checks failed" % len(failed))
sys.exit(1 if failed else 0)
