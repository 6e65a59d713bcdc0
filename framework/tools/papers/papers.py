#!/usr/bin/env python3
"""The figures and tables of the five papers: runs the scene or study of each row, takes its number, sets it beside the paper's, and writes
framework/docs/papers.md. Rows are the tables of partmann.toml, hashim.toml, chowdhury.toml, scabbia.toml, hu.toml in this folder.

    papers.py PERIKIT OUT            every row but the long ones, then page and pictures into framework/docs
    papers.py PERIKIT OUT --long     the long ones too
    papers.py PERIKIT OUT --small    the rows that say small = true; checks them, and writes nothing but OUT
    --only TEXT                      rows whose figure or table contains it; writes no page

Runs that are done are kept where neither scene nor program has changed: a stopped command goes on where it was. One thread a run.
A row that does not keep what it promises makes the command fail: a number of the paper within its tolerance, a statement of the paper that
holds, or, where perikit differs from the paper, the number that it had when the reason was written down. Needs numpy and h5py.

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
"""

import argparse
import hashlib
import json
import os
import pathlib
import subprocess
import sys
import time
import tomllib

import numpy

sys.dont_write_bytecode = True

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
sys.path[:0] = [str(HERE), str(ROOT / "framework/python")]

import measures  # noqa: E402
import page  # noqa: E402
import perikit  # noqa: E402

PAPERS = ("partmann", "hashim", "chowdhury", "scabbia", "hu")


def scene_file(row):
    return ROOT / "configs" / (row.get("scene") or row["study"])


def words(row):
    """The words of the command line that make the row's run."""
    kind = "run" if "scene" in row else "study"
    sets = [word for key, value in row.get("set", {}).items() for word in ("--set", f"{key}={perikit.program.toml(value)}")]
    return [kind, str(scene_file(row).relative_to(ROOT)) + ".toml", *sets]


class Runs:
    """Folders of runs, one for each command; done.json says when one is done."""

    def __init__(self, program, out):
        self.program, self.out = program, out
        folder = program.parent.parent
        self.version = "".join(f"{file.name} {file.stat().st_size} {file.stat().st_mtime_ns}\n" for file in
                               [program, *sorted(folder.glob("lib*/**/*.so"))])
        self.seconds = {}

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
            options = ["--jobs", "1", "--resume"] if "study" in row else []
            print("run    ", " ".join(words(row)), flush=True)
            start = time.time()
            result = subprocess.run([self.program, *words(row), "-o", folder, "--threads", "1", "--quiet", *options], cwd=ROOT,
                                    env=dict(os.environ, OMP_WAIT_POLICY="passive"), capture_output=True, text=True, check=False)
            if result.returncode == 2 or result.returncode < 0:
                raise SystemExit(f"{' '.join(words(row))}\n{result.stderr}")
            done = {"seconds": time.time() - start, "failure": result.stderr.strip() if result.returncode else ""}
            (folder / "done.json").write_text(json.dumps(done))
        self.seconds[folder] = self.done(row)["seconds"]
        return folder


def evaluate(row, folder):
    """The row's number, or array of numbers."""
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
    value = eval(row["value"], names)  # rows are part of this repository
    return numpy.atleast_1d(numpy.asarray(value, dtype=float)), names


def each(expression, study, row, names):
    if not (study.folder / "runs" / str(int(study["run"][row])) / "results.h5").exists():
        return numpy.nan
    results = study.results(row)
    return eval(expression, {**names, **results.history, "results": results, "log": results.log})


def judged(row, ours, names):
    """(verdict, whether the row keeps its promise)."""
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
    if "holds" in row:
        names.update(ours=ours if len(ours) > 1 else ours[0])
        agrees = bool(eval(row["holds"], names))
    else:
        paper = numpy.atleast_1d(numpy.asarray(row["paper"], dtype=float))
        allowed = row["within"] if "within" in row else row["within_percent"] / 100 * numpy.abs(paper)
        agrees = bool(numpy.all(numpy.abs(ours - paper) <= allowed))
    return "agrees" + (": " + row["note"] if "note" in row else ""), agrees and held is not False


def rows_of(paper, options):
    with open(HERE / (paper + ".toml"), "rb") as file:
        table = tomllib.load(file)
    rows = [row for row in table["row"] if (not options.small or row.get("small")) and (not options.only or options.only in row["item"])]
    return table, rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("perikit", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    runs = Runs(options.perikit.resolve(), options.out.resolve())
    broken, sections = [], []
    for paper in PAPERS:
        table, rows = rows_of(paper, options)
        for row in rows:
            row["command"] = "perikit " + " ".join(page.quoted(word) for word in words(row))
            if row.get("long") and not options.long and not runs.done(row):
                row["verdict"] = "not run"
                continue
            folder = runs.make(row)
            try:
                row["ours"], names = evaluate(row, folder)
                row["verdict"], kept = judged(row, row["ours"], names)
            except (NameError, KeyError, IndexError, FileNotFoundError, TypeError, ValueError) as error:
                raise SystemExit(f"{table['short']} {row['item']}, {row['what']}: {error!r} ({folder})") from error
            print("%-9s %s %s, %s: %s" % ("ok" if kept else "BROKEN", table["short"], row["item"], row["what"], page.numbers(row, row["ours"])), flush=True)
            if not kept:
                broken.append(f"{table['short']} {row['item']}, {row['what']}: {page.numbers(row, row['ours'])}")
        sections.append((table, rows))
    if not options.small and not options.only and not broken:
        page.write(ROOT / "framework/docs", sections, runs)
    print("%d rows, %.0f s of runs" % (sum(len(rows) for _, rows in sections), sum(runs.seconds.values())))
    if broken:
        raise SystemExit("not as promised:\n  " + "\n  ".join(broken))


if __name__ == "__main__":
    main()
