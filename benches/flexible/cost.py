"""CPU time of one blade of the rotor to 1 % error of the tip, holonom and EXUDYN in turn.

    python cost.py PROGRAM FOLDER     with a Python that has numpy and exudyn

Error: largest distance of the tip over 1 s from a fine solution, relative to the largest change of its deflection, with
both the error of the step and that of the elements. Each program has the fewest elements of two nodes among those listed, and with
them the largest step, with an error below 1 %. Median of 3 CPU times, in turn: holonom the whole process, and without what
a run of one step takes; EXUDYN its solver alone.
"""
import pathlib, resource, statistics, subprocess, sys
import numpy as np
from compare import SYSTEMS, Run, model, peer

STEPS = [1e-2, 5e-3, 4e-3, 2.5e-3, 2e-3, 1e-3, 5e-4]
COUNTS = [2, 3, 4, 6, 8, 12, 24]
PEER_COUNTS = [12, 16, 20, 24]  # of EXUDYN
FINE = 48, 2.5e-4  # elements, step
SMALL = 5e-4  # a step whose error is small beside that of the elements
WANTED = 0.01


def seconds(args):
    spent = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    before = spent()
    subprocess.run(args, check=True, capture_output=True)
    return spent() - before


def main():
    program, folder, s = sys.argv[1], pathlib.Path(sys.argv[2]), SYSTEMS["rotor"]
    s["sample"] = 0.02

    def run(elements, h, element="helicoidal"):
        s["beams"] = {"blade1": elements}
        return Run(program, f"{folder}/{element}-{elements}", "rotor", 1, h, more=[f'beam.blade1.element="{element}"'])

    # in balance in EXUDYN, too, whose element is that one where it bends little
    start = lambda elements: run(elements, 1e-2, "mean_directors")
    fine = run(*FINE)
    error = lambda x: np.linalg.norm(np.array(x)[:len(fine.x)] - fine.x, axis=1).max() / fine.scale
    mine, count = None, None
    for count in COUNTS:
        e = error(run(count, SMALL).x)
        print(f"holonom, {count} elements, h = {SMALL * 1e3:g} ms: {e:.1e}", flush=True)
        if e <= WANTED:
            break
    for h in STEPS:
        e = error(run(count, h).x)
        print(f"holonom, {count} elements, h = {h * 1e3:g} ms: {e:.1e}", flush=True)
        if e <= WANTED:
            mine = h
            break
    for other in PEER_COUNTS:
        got = peer("rotor", start(other), SMALL, rho=0.9)
        e = error(got["x"]) if got["ok"] and len(got["x"]) >= len(fine.x) else float("nan")
        print(f"EXUDYN, {other} elements, h = {SMALL * 1e3:g} ms: {e:.1e}", flush=True)
        if e <= WANTED:
            break
    best = []
    for setting in [dict(rho=0.9), dict(rho=0.6), dict(rho=0.9, nodes="lie")]:
        for h in STEPS:
            got = peer("rotor", start(other), h, **setting)
            e = error(got["x"]) if got["ok"] and len(got["x"]) >= len(fine.x) else float("nan")
            print(f"EXUDYN {setting} h = {h * 1e3:g} ms: {e:.1e}, {got['cpu'][0]:.3f} s", flush=True)
            if e <= WANTED:
                best.append((got["cpu"][0], h, setting))
                break
    _, step, setting = min(best, key=lambda b: b[0])
    file = folder / "cost.toml"
    text = model("rotor").replace("elements = 12", f"elements = {count}")
    file.write_text(text.replace('"mean_directors"', '"helicoidal"'))
    args = lambda h, end: [program, "run", file, "-o", folder / "cost", "--force", "--step", repr(h), "--end", str(end), "--every", "100"]
    whole, one, his = [], [], []
    for _ in range(3):
        whole.append(seconds(args(mine, 1.0)))
        one.append(seconds(args(mine, mine)))
        his.append(peer("rotor", start(other), step, **setting)["cpu"][0])
    print(f"holonom, {count} elements, h = {mine * 1e3:g} ms: {statistics.median(whole):.3f} s, "
          f"without start and end {statistics.median(whole) - statistics.median(one):.3f} s  {whole} {one}")
    print(f"EXUDYN, {other} elements, h = {step * 1e3:g} ms, {setting}: {statistics.median(his):.3f} s  {his}")


if __name__ == "__main__":
    main()
