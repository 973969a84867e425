"""Shards as jobs of Snakemake, by the recipe of the guide: the table and the runs of one process."""

import os
import re
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

PAGE = ROOT / "docs" / "guide" / "src" / "sweeps.md"


def block(language: str, before: str = "") -> str:
    """The first block of this language below these words."""
    text = PAGE.read_text(encoding="utf-8")
    found = re.search(rf"^```{language}\n(.*?)^```$", text[text.index(before) :], re.MULTILINE | re.DOTALL)
    assert found, language
    return found[1]


def run(folder: Path, *command: str) -> str:
    environment = os.environ | {"PATH": f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}"}
    answer = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert answer.returncode == 0, f"{command}\n{answer.stdout}{answer.stderr}"
    return answer.stdout + answer.stderr


def points(folder: Path) -> dict[str, tuple[int, bytes]]:
    """When each point was run, and its trajectory."""
    files = sorted(folder.glob("[0-9]*/trajectory.csv"))
    return {file.parent.name: (file.stat().st_mtime_ns, file.read_bytes()) for file in files}


def test_shards_of_snakemake_are_one_process(tmp_path: Path) -> None:
    pytest.importorskip("snakemake", reason="no Snakemake: the recipe of the guide is not run")
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin" / "holonom"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m holonom "$@"\n')
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    (tmp_path / "door.toml").write_text(block("toml"))
    recipe = block("snakemake", "## On a cluster")
    (tmp_path / "Snakefile").write_text(recipe)
    vary = re.search(r'SWEEP = "door.toml (.*) -o door-sweep"', recipe)
    assert vary
    snakemake = (sys.executable, "-m", "snakemake", "--cores", "2", "--quiet", "all")

    run(tmp_path, "holonom", "sweep", "door.toml", *vary[1].split(), "-o", "one", "-j", "1", "--quiet")
    run(tmp_path, *snakemake)
    table = (tmp_path / "one" / "sweep.csv").read_bytes()
    assert (tmp_path / "door.csv").read_bytes() == table
    assert (tmp_path / "door-sweep" / "sweep.csv").read_bytes() == table
    one, shards = points(tmp_path / "one"), points(tmp_path / "door-sweep")
    assert len(one) == 10 and {name: own[1] for name, own in one.items()} == {name: own[1] for name, own in shards.items()}

    # a shard that was lost with one of its points: that point is run again, and no other
    manifests = (tmp_path / "door-sweep").glob("manifest*.jsonl")
    own = [(path, path.read_text().splitlines(keepends=True)) for path in manifests]
    [(path, lines, lost)] = [(path, lines, line) for path, lines in own for line in lines if '"point":5,' in line]
    path.write_text("".join(line for line in lines if line != lost))
    (tmp_path / "door-sweep" / "00005" / "summary.json").unlink()
    (tmp_path / "door.csv").unlink()
    for shard in (tmp_path / "shards").iterdir():
        shard.unlink()
    run(tmp_path, *snakemake)
    assert (tmp_path / "door.csv").read_bytes() == table
    again = points(tmp_path / "door-sweep")
    assert [name for name in again if again[name][0] != shards[name][0]] == ["00005"]
    assert again["00005"][1] == shards["00005"][1]
