#!/usr/bin/env python3
"""The figures and tables of the five papers: runs the scene or study of each row, takes its number, sets it beside the paper's, and writes
framework/docs/papers.md. Rows are the tables of partmann.toml, hashim.toml, chowdhury.toml, scabbia.toml, hu.toml in this folder.

    papers.py PERIKIT OUT            every row but the long ones, then page and pictures into framework/docs
    papers.py PERIKIT OUT --long     the long ones too
    papers.py PERIKIT OUT --small    the rows that say small = true; checks them, and writes nothing but OUT
    papers.py PERIKIT OUT --page     runs nothing: the page from record.json, and from what lies in OUT
    --only TEXT                      rows whose name contains it, as in "C Fig. 3,"; writes no page

Runs that are done are kept in OUT where neither scene nor program has changed: a stopped command goes on where it was, in the middle of a run at its checkpoint. What each row gave last, when, and how long its run took is in record.json beside this file, and on the page: so long rows need not run again for each page. A
row whose scene, settings or expression have changed since has no record. One thread a run.
The first lines of each scene and study must say figure or table, reference, what comes out here, and what differs from the paper.
A row that does not keep what it promises makes the command fail: a number of the paper within its tolerance, a statement of the paper that
holds, or, where perikit differs from the paper, the number that it had when the reason was written down. Needs numpy and h5py; pictures need gnuplot.

Keys of a row:
  item, what        figure or table; what is compared, with its unit
  scene or study    under configs/, without .toml; set: values of keys; small, long: see above
  value             expression: columns of history.csv (or of the study's table) as arrays, `results` and `log` of a scene's run, functions of
                    measures.py. each: expression for every run of a study, its values are `v` in value
  paper             the paper's number(s), with within (in the number's unit) or within_percent
  claim, holds      what the paper says where it prints no number, and a condition on `ours` that means so
  held              what perikit gives where it differs from the paper, to a hundredth or within held_percent
  because           why it differs
  format            of a number, "%.3g"
  takes             how long it takes, where no run has said so yet

Keys of a picture: file, caption, and
  of                `what` of a row: its run drawn by `perikit plot` with options, or the plot of its study; run: a run of the study instead
  curves            or curves of several rows: of, title, x, y (expressions as in value); axes: their names; log: "x", "y" or "xy"
"""

import argparse
import hashlib
import json
import os
import pathlib
import re
import resource
import signal
import subprocess
import sys
import time
import tomllib

sys.dont_write_bytecode = True

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
sys.path[:0] = [str(HERE), str(ROOT / "framework/python")]

import perikit  # noqa: E402  (first: it says which packages this Python lacks)
import measures  # noqa: E402
import numpy  # noqa: E402
import page  # noqa: E402

PAPERS = ("partmann", "hashim", "chowdhury", "scabbia", "hu")


def scene_file(row):
    return ROOT / "configs" / (row.get("scene") or row["study"])


def words(row):
    """The words of the command line that make the row's run."""
    kind = "run" if "scene" in row else "study"
    sets = [word for key, value in row.get("set", {}).items() for word in ("--set", f"{key}={perikit.scene.value(value)}")]
    return [kind, str(scene_file(row).relative_to(ROOT)) + ".toml", *sets]


class Runs:
    """Folders of runs, one for each command; done.json says when one is done."""

    def __init__(self, program, out):
        self.program, self.out = program, out
        folder = program.parent.parent
        self.version = "".join(f"{file.name} {hashlib.sha256(file.read_bytes()).hexdigest()}\n" for file in
                               [program, *sorted(folder.glob("lib*/**/*.so"))])

    def folder(self, row):
        text = self.text(scene_file(row).with_suffix(".toml"))
        key = hashlib.sha256("\0".join([self.version, text, *words(row)]).encode()).hexdigest()[:8]
        return self.out / f"{scene_file(row).name}-{key}"

    @staticmethod
    def text(file):
        """The content of a scene, or of a study with its scene; comments do not count."""
        content = tomllib.loads(file.read_text(encoding="utf-8"))
        if "scene" in content:
            content["scene"] = tomllib.loads((file.parent / content["scene"]).read_text(encoding="utf-8"))
        return json.dumps(content, sort_keys=True)

    def done(self, row):
        file = self.folder(row) / "done.json"
        return json.loads(file.read_text()) if file.exists() else None

    def make(self, row):
        """Runs the row's command unless its results are there. A run that stops early is a result too."""
        folder = self.folder(row)
        if not self.done(row):
            folder.parent.mkdir(parents=True, exist_ok=True)
            options = ["--jobs", "1", "--keep-going"] if "study" in row else []
            print("run    ", " ".join(words(row)), flush=True)
            code, errors = self.call([self.program, *words(row), "-o", folder, "--threads", "1", "--quiet", "--resume", *options], folder)
            if code == 2 or code < 0:
                raise SystemExit(f"{' '.join(words(row))}\n{errors}")
            done = {"seconds": self.spent(folder), "date": time.strftime("%Y-%m-%d"), "failure": errors.strip() if code else ""}
            (folder / "done.json").write_text(json.dumps(done))
        return folder

    @staticmethod
    def spent(folder):
        """Processor time [s] of the run, all its attempts together."""
        return sum(float(line) for line in (folder / "seconds.txt").read_text().split())

    @staticmethod
    def call(command, folder):
        """Exit status and messages. A stop of this command lets the run write its checkpoint first."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        with subprocess.Popen(command, cwd=ROOT, env=dict(os.environ, OMP_WAIT_POLICY="passive"), stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, text=True) as process:
            try:
                errors = process.communicate()[1]
            except BaseException:
                process.terminate()
                process.wait()
                raise
            finally:
                after = resource.getrusage(resource.RUSAGE_CHILDREN)
                if folder.is_dir():
                    with open(folder / "seconds.txt", "a", encoding="utf-8") as file:
                        print("%.2f" % (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime), file=file)
        return process.returncode, errors


def evaluate(row, folder):
    """The row's number, or array of numbers."""
    names = evaluate_in(row, folder)
    value = eval(row["value"], names)  # rows are part of this repository
    return numpy.asarray(value, dtype=float).ravel(), names


def evaluate_in(row, folder):
    """What expressions of the row can name."""
    names = {name: getattr(measures, name) for name in dir(measures) if not name.startswith("_")}
    names["np"] = numpy
    if "scene" in row:
        results = perikit.Results(folder)
        names.update(results.history, results=results, log=results.log, failure=json.loads((folder / "done.json").read_text())["failure"])
    else:
        study = perikit.Study(folder)
        names.update({name.split(".")[-1]: column for name, column in study.columns.items()}, study=study)
        if "each" in row:
            names["v"] = numpy.array([each(row["each"], study, k, names) for k in range(len(study))])
    return names


def each(expression, study, row, names):
    if not (study.folder / "runs" / str(int(study["run"][row])) / "results.h5").exists():
        return numpy.nan
    results = study.results(row)
    return eval(expression, {**names, **results.history, "results": results, "log": results.log})


def judged(row, ours, names, agreed=None):
    """(verdict, whether the row keeps its promise). agreed: where `ours` is of the record, whether it did."""
    held = None
    if "held" in row:
        expected = numpy.atleast_1d(numpy.asarray(row["held"], dtype=float))
        held = ours.shape == expected.shape and bool(  # nothing is held closer than to a millionth of the row's largest number
            numpy.all(numpy.abs(ours - expected) <= row.get("held_percent", 1.0) / 100 * numpy.abs(expected) + 1e-6 * numpy.max(numpy.abs(expected))))
    if "because" in row:
        if held is None:
            return "?", False
        return "differs: " + row["because"], held
    if "holds" not in row and "paper" not in row:
        return "nothing printed there", held
    if "holds" in row and agreed is None:
        names.update(ours=ours if len(ours) > 1 else ours[0])
        agreed = bool(eval(row["holds"], names))
    elif "holds" not in row:
        paper = numpy.atleast_1d(numpy.asarray(row["paper"], dtype=float))
        allowed = row["within"] if "within" in row else row["within_percent"] / 100 * numpy.abs(paper)
        agreed = bool(numpy.all(numpy.abs(ours - paper) <= allowed))
    kept = agreed and held is not False
    return ("agrees" if kept else "no longer") + (": " + row["note"] if "note" in row else ""), kept


class Record:
    """What rows gave last: record.json, by paper and row."""

    FILE = HERE / "record.json"

    def __init__(self):
        self.entries = json.loads(self.FILE.read_text(encoding="utf-8")) if self.FILE.exists() else {}

    @staticmethod
    def name(table, row):
        return f"{table['short']} {row['item']}, {row['what']}"

    @staticmethod
    def source(row):
        """Of everything that the row's number depends on but the program."""
        text = "\0".join([Runs.text(scene_file(row).with_suffix(".toml")), *words(row), row["value"], row.get("each", ""), row.get("holds", "")])
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def of(self, table, row):
        entry = self.entries.get(self.name(table, row))
        return entry if entry and entry["source"] == self.source(row) else None

    def keep(self, table, row, kept, done):
        self.entries[self.name(table, row)] = {"source": self.source(row), "ours": [float(v) if numpy.isfinite(v) else None for v in row["ours"]],
                                               "kept": bool(kept), "seconds": round(done["seconds"], 1), "date": done["date"]}

    def prune(self, names):
        """Forgets rows that are no more."""
        self.entries = {name: entry for name, entry in self.entries.items() if name in names}
        self.write()

    def write(self):
        self.FILE.write_text(json.dumps(self.entries, indent=0, sort_keys=True) + "\n", encoding="utf-8")


def refuse_header(row):
    """The first lines of a scene say which figure or table it is, what the reference is, what comes out here, and what differs from the paper."""
    file = scene_file(row).with_suffix(".toml")
    header = file.read_text(encoding="utf-8").split("format = 1")[0]
    missing = [name for name, pattern in (("figure, table, section or equation", r"Figs?\.|Table|section|eqs?\.|special cases"), ("Reference", r"Reference"),
                                          ("what comes out here", r"\b[Hh]ere\b"), ("Differs from the paper:", r"Differs from the paper:"))
               if not re.search(pattern, header)]
    if missing:
        raise SystemExit(f"{file}: its first lines lack {', '.join(missing)}")


def rows_of(paper, options):
    with open(HERE / (paper + ".toml"), "rb") as file:
        table = tomllib.load(file)
    rows = [row for row in table["row"] if (not options.small or row.get("small")) and options.only in Record.name(table, row)]
    return table, rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("perikit", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--page", action="store_true")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("stopped"))
    runs, record = Runs(options.perikit.resolve(), options.out.resolve()), Record()
    broken, sections = [], []
    for paper in PAPERS:
        table, rows = rows_of(paper, options)
        for row in rows:
            refuse_header(row)
            row["command"] = "perikit " + " ".join(page.quoted(word) for word in words(row))
            if not runs.done(row) and (options.page or row.get("long") and not options.long):
                kept = recalled(record.of(table, row), row)
            else:
                kept = found(table, row, runs)
                if not options.small:
                    record.keep(table, row, kept, runs.done(row))
                    record.write()
            if not kept:
                broken.append(f"{Record.name(table, row)}: {page.numbers(row, row['ours'])}")
        sections.append((table, rows))
    if not options.small and not options.only and not broken:
        record.prune({Record.name(table, row) for table, rows in sections for row in rows})
        page.write(ROOT / "framework/docs", sections, runs, evaluate_in)
    times = {row["command"]: row["seconds"] for _, rows in sections for row in rows if "seconds" in row}
    print("%d rows, %.0f s of runs" % (sum(len(rows) for _, rows in sections), sum(times.values())))
    if broken:
        raise SystemExit("not as promised:\n  " + "\n  ".join(broken))


def found(table, row, runs):
    """Runs the row and judges its number; returns whether it keeps its promise."""
    folder = runs.make(row)
    try:
        row["ours"], names = evaluate(row, folder)
        row["verdict"], kept = judged(row, row["ours"], names)
    except (NameError, KeyError, IndexError, FileNotFoundError, TypeError, ValueError) as error:
        raise SystemExit(f"{table['short']} {row['item']}, {row['what']}: {error!r} ({folder})") from error
    row.update(seconds=runs.done(row)["seconds"], date=runs.done(row)["date"])
    print("%-9s %s: %s" % ("ok" if kept else "BROKEN", Record.name(table, row), page.numbers(row, row["ours"])), flush=True)
    return kept


def recalled(entry, row):
    """The row as its last run was; returns whether it kept its promise then, or was never run."""
    if entry is None:
        row["verdict"] = "not run"
        return True
    row["ours"] = numpy.array([numpy.nan if v is None else v for v in entry["ours"]])
    row["verdict"], kept = judged(row, row["ours"], {}, entry["kept"])
    row.update(seconds=entry["seconds"], date=entry["date"], clock=entry.get("clock", False))
    return kept


if __name__ == "__main__":
    main()
