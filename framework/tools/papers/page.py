"""framework/docs/papers.md from the judged rows."""

import shlex
import subprocess

import numpy


def quoted(word):
    return word if all(c.isalnum() or c in "_./=-" for c in word) else shlex.quote(word)


def numbers(row, values):
    return ", ".join(row.get("format", "%.3g") % value for value in values)


def theirs(row):
    if "paper" in row:
        paper = row["paper"] if isinstance(row["paper"], list) else [row["paper"]]
        return numbers(row, paper) + (" (" + row["claim"] + ")" if "claim" in row else "")
    return row["claim"]


def difference(row):
    """Largest difference from the paper's numbers, where there are any."""
    if "paper" not in row or "ours" not in row:
        return ""
    paper = row["paper"] if isinstance(row["paper"], list) else [row["paper"]]
    if len(paper) != len(row["ours"]):
        return ""
    if row.get("relative"):
        return "%.2g %%" % max((100 * abs(o / p - 1) for o, p in zip(row["ours"], paper)), default=0)
    return "%.2g" % max(abs(o - p) for o, p in zip(row["ours"], paper))


def scene_cell(row):
    name = row.get("scene") or row["study"]
    keys = ", ".join("`%s=%s`" % (key, value) for key, value in settings(row))
    return f"[`{name}`](../../configs/{name}.toml)" + (" " + keys if keys else "")


def settings(row):
    from perikit import scene
    return [(key, scene.value(value).replace("|", "\\|")) for key, value in row.get("set", {}).items()]


def row_of(rows, what):
    return next(row for row in rows if row["what"] == what)


def draw(file, entry, rows, runs, names_of):
    """A picture of a run, the plot of a study, or curves of several rows; nothing where a run is not there, so that the last picture stays."""
    chosen = [row_of(rows, curve["of"]) for curve in entry.get("curves", [entry])]
    if not all(runs.done(row) for row in chosen):
        return
    folder = runs.folder(chosen[0])
    if "curves" in entry:
        draw_curves(file, entry, [names_of(row, runs.folder(row)) for row in chosen])
    elif "study" in chosen[0] and "run" not in entry:
        file.write_bytes((folder / "plot.png").read_bytes())
    else:
        one = folder / "runs" / str(entry["run"]) if "run" in entry else folder
        subprocess.run([runs.program, "plot", one, *entry.get("options", []), "-o", file], check=True, capture_output=True)


def draw_curves(file, entry, names):
    """Curves by gnuplot."""
    lines = ["set terminal pngcairo size 760,440 font 'sans,11'", f"set output '{file}'", "set key outside right", "set grid lc rgb '#dddddd'",
             "set xlabel '%s'" % entry["axes"][0], "set ylabel '%s'" % entry["axes"][1], *(f"set logscale {axis}" for axis in entry.get("log", ""))]
    plots, data = [], []
    for curve, of_row in zip(entry["curves"], names):
        # The picture belongs to this repository, like the rows.
        x, y = (numpy.asarray(eval(curve[axis], of_row), dtype=float) for axis in "xy")
        plots.append("'-' with %s title '%s' noenhanced" % (curve.get("with", "lines lw 1.5"), curve["title"]))
        data += ["\n".join("%.9g %.9g" % pair for pair in zip(x, y)), "e"]
    script = "\n".join([*lines, "plot " + ", ".join(plots), *data]) + "\n"
    subprocess.run(["gnuplot"], input=script, text=True, check=True, capture_output=True)


def picture(docs, entry, rows, runs, names_of):
    """Its lines on the page."""
    file = docs / "images" / ("papers_" + entry["file"] + ".png")
    draw(file, entry, rows, runs, names_of)
    return [f"![{entry['file']}](images/{file.name})", "", f"*{entry['caption']}*", ""] if file.exists() else []


def duration(seconds):
    return f"{seconds / 60:.0f} min" if seconds >= 90 else f"{seconds:.0f} s"


def verdict_cell(row):
    if row["verdict"] == "not run":
        return "not run (%s): `%s`" % (row.get("takes", "its time is not known"), row["command"].replace("|", "\\|"))
    return row["verdict"] + (f" [{duration(row['seconds'])}]" if row["seconds"] >= 300 else "")


def write(docs, sections, runs, names_of):
    every = [row for _, rows in sections for row in rows]
    times = {row["command"]: row["seconds"] for row in every if "seconds" in row}
    usual = {row["command"]: row["seconds"] for row in every if "seconds" in row and not row.get("long")}
    dates = sorted({row["date"] for row in every if "date" in row})
    verdicts = [row["verdict"] for row in every]
    fill = {
        "dates": dates[0] if len(dates) == 1 else f"{dates[0]} to {dates[-1]}",
        "runs": str(len(times)), "minutes": duration(sum(times.values())), "longest": duration(max(times.values())),
        "usual": duration(sum(usual.values())), "rows": str(len(every)), "agree": str(sum(v.startswith("agrees") for v in verdicts)),
        "differ": str(sum(v.startswith("differs") for v in verdicts)), "nothing": str(sum(v.startswith("nothing") for v in verdicts)),
        "missing": str(verdicts.count("not run")),
        "clock": " (or, where only that is known, time on the clock of a busy machine)" if any(row.get("clock") for row in every) else "",
    }
    text = (docs / "papers.md.in").read_text(encoding="utf-8").rstrip("\n")
    for key, value in fill.items():
        text = text.replace(f"@{key}@", value)
    lines = text.split("\n")
    for table, rows in sections:
        agree = sum(row["verdict"].startswith("agrees") for row in rows)
        differ = sum(row["verdict"].startswith("differs") for row in rows)
        missing = sum(row["verdict"] == "not run" for row in rows)
        lines += ["", f"## {table['title']}", "", *table["text"].strip().split("\n"), ""]
        lines += [f"{len(rows)} rows: {agree} agree, {differ} differ, {missing} not run" + (
            f", {len(rows) - agree - differ - missing} with nothing printed in the paper." if len(rows) > agree + differ + missing else "."), ""]
        for entry in table.get("picture", []):
            lines += picture(docs, entry, rows, runs, names_of)
        lines += ["| figure, table | what | scene | here | paper | off by | verdict |", "|---|---|---|---|---|---|---|"]
        for row in rows:
            ours = numbers(row, row["ours"]) if "ours" in row else ""
            lines.append(f"| {row['item']} | {row['what']} | {scene_cell(row)} | {ours} | {theirs(row)} | {difference(row)} | {verdict_cell(row)} |")
    (docs / "papers.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
