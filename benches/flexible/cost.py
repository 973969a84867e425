"""CPU time of one blade of the rotor to 1 % error of the tip, holonom and EXUDYN in turn.

    python cost.py PROGRAM FOLDER [WANTED]     with a Python that has numpy and exudyn

Each program is held against its own limit of small steps with the same 12 elements; error: largest distance of the tip
over 1 s, relative to the largest change of its deflection. Each takes the largest step, of a list, with an error below
WANTED (default 0.01); EXUDYN moreover the best of several settings. Times are CPU times, median of 3, in turn: holonom
the whole process, and without what a run of one step takes; EXUDYN its solver alone, without import and assembly.
"""
import os, pathlib, statistics, subprocess, sys
import numpy as np
from compare import SYSTEMS, Run, distance, model, peer

STEPS = [2e-2, 1e-2, 5e-3, 4e-3, 10 / 3e3, 2.5e-3, 2e-3, 1.25e-3, 1e-3, 5e-4, 2.5e-4]
SETTINGS = [dict(rho=rho, nodes=nodes, modified_newton=modified) for nodes in ("euler", "lie")
            for rho in (0.9, 0.6) for modified in (True, False)]


def seconds(args):
    before = os.times()
    subprocess.run(args, check=True, capture_output=True)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    wanted = float(sys.argv[3]) if len(sys.argv) > 3 else 0.01
    SYSTEMS["rotor"].update(sample=0.02)
    fine = Run(program, folder, "rotor", 1, 1.25e-4)
    scale = fine.scale
    his = peer("rotor", fine, 5e-5)
    limit = np.array(his["x"])
    print(f"deflection {scale:.4g} m; limits apart by {distance(fine, his['t'], limit) / scale:.1e} of it")
    mine = None
    for h in STEPS:
        if abs(0.02 / h - round(0.02 / h)) > 1e-9:
            continue
        try:
            run = Run(program, folder, "rotor", 1, h)
        except subprocess.CalledProcessError:
            continue
        error = distance(run, fine.t, fine.x) / scale
        print(f"holonom h = {h * 1e3:.3g} ms: error {error:.1e}")
        if error <= wanted:
            mine = h
            break
    best = []
    for setting in SETTINGS:
        for h in STEPS:
            if abs(0.02 / h - round(0.02 / h)) > 1e-9:
                continue
            got = peer("rotor", fine, h, repeat=1, **setting)
            if not got["ok"] or len(got["x"]) < len(limit):
                continue
            error = np.linalg.norm(np.array(got["x"])[:len(limit)] - limit, axis=1).max() / scale
            if error <= wanted:
                print(f"EXUDYN {setting}: h = {h * 1e3:.3g} ms, error {error:.1e}, {got['cpu'][0]:.3f} s", flush=True)
                best.append((got["cpu"][0], h, setting))
                break
    _, step, setting = min(best, key=lambda b: b[0])
    file = folder / "cost.toml"
    file.write_text(model("rotor"))
    args = lambda h, end: [program, "run", file, "-o", folder / "cost", "--force", "--step", repr(h), "--end", str(end), "--every", "100"]
    whole, one, other = [], [], []
    for _ in range(3):
        whole.append(seconds(args(mine, 1.0)))
        one.append(seconds(args(mine, mine)))
        other.append(peer("rotor", fine, step, **setting)["cpu"][0])
    print(f"holonom h = {mine * 1e3:.3g} ms: {statistics.median(whole):.3f} s, "
          f"without start and end {statistics.median(whole) - statistics.median(one):.3f} s  {whole} {one}")
    print(f"EXUDYN h = {step * 1e3:.3g} ms, {setting}: {statistics.median(other):.3f} s  {other}")


if __name__ == "__main__":
    main()
