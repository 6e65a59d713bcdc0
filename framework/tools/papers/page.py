"""framework/docs/papers.md from the judged rows."""

import shlex
import subprocess
import time


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
    from perikit.program import toml
    return [(key, toml(value).replace("|", "\\|")) for key, value in row.get("set", {}).items()]


def picture(docs, entry, rows, runs):
    """Draws a picture of a run, or copies the plot of a study; returns its lines."""
    row = next(row for row in rows if row["what"] == entry["of"])
    if row["verdict"] == "not run":
        return []
    folder, file = runs.folder(row), docs / "images" / ("papers_" + entry["file"] + ".png")
    if "study" in row:
        file.write_bytes((folder / "plot.png").read_bytes())
    else:
        subprocess.run([runs.program, "plot", folder, *entry["options"], "-o", file], check=True, capture_output=True)
    return [f"![{entry['file']}](images/{file.name})", "", f"*{entry['caption']}*", ""]


def write(docs, sections, runs):
    total, count = sum(runs.seconds.values()), len(runs.seconds)
    longest = max(runs.seconds.values(), default=0)
    lines = (docs / "papers.md.in").read_text(encoding="utf-8").rstrip("\n").split("\n")
    for table, rows in sections:
        agree = sum(row["verdict"].startswith("agrees") for row in rows)
        differ = sum(row["verdict"].startswith("differs") for row in rows)
        lines += ["", f"## {table['title']}", "", *table["text"].strip().split("\n"), ""]
        lines += [f"{len(rows)} rows: {agree} agree, {differ} differ, {len(rows) - agree - differ} not run.", ""]
        for entry in table.get("picture", []):
            lines += picture(docs, entry, rows, runs)
        lines += ["| figure, table | what | scene | here | paper | off by | verdict |", "|---|---|---|---|---|---|---|"]
        for row in rows:
            ours = numbers(row, row["ours"]) if "ours" in row else ""
            verdict = row["verdict"] if row["verdict"] != "not run" else "not run: `%s`" % row["command"].replace("|", "\\|")
            lines.append(f"| {row['item']} | {row['what']} | {scene_cell(row)} | {ours} | {theirs(row)} | {difference(row)} | {verdict} |")
    minutes = f"{total / 60:.0f} minutes"
    text = "\n".join(lines).replace("@minutes@", minutes).replace("@runs@", str(count)).replace("@longest@", f"{longest / 60:.1f} minutes")
    (docs / "papers.md").write_text(text.replace("@date@", time.strftime("%Y-%m-%d")) + "\n", encoding="utf-8")
