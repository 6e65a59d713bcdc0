"""Runs that are kept: a stopped command goes on where it was. For the tools beside this file."""

import subprocess


def run(perikit, folder, settings, threads, make_scene):
    """One run into a folder, unless it is done there: of the text that make_scene() returns, which may write files beside it."""
    log = folder / "run.log"
    if log.exists() and ("speed  " in log.read_text() or "failed: " in log.read_text()):
        return
    folder.parent.mkdir(parents=True, exist_ok=True)
    scene = folder.with_suffix(".toml")
    scene.write_text(make_scene())
    command = [perikit, "run", str(scene), "-o", str(folder), "--force", "--quiet", "--threads", str(threads)]
    subprocess.run(command + [word for setting in settings for word in ("--set", setting)], check=False)
