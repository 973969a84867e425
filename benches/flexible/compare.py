"""Convergence of holonom on the flexible systems, and the distance to EXUDYN.

    python compare.py PROGRAM FOLDER [SYSTEM ...]     with a Python that has numpy and exudyn

PROGRAM is the program holonom, FOLDER a place for its results. Errors are the largest distances of the observed node
over the sampled times, relative to the largest change of the deflection: of the tip in the frame of the root, of the
middle from the chord.
"""
import json, pathlib, re, subprocess, sys
import numpy as np

HERE = pathlib.Path(__file__).parent
MODELS = HERE / "../../examples/models"
# beams with their elements; root, observed node; end, sample, largest step (s); step of EXUDYN
SYSTEMS = {
    "rotor": dict(beams={"blade1": 12}, root="blade1.0", node="blade1.{}", of="blade1", end=1.0, sample=0.01, h=5e-4, peer=1e-4),
    "satellite": dict(beams={n: 8 for n in ("east", "north", "west", "south")}, root="north.0", node="north.{}", of="north",
                      end=3.0, sample=0.06, h=5e-3, peer=1e-3),
    "flexible_slider_crank": dict(beams={"rod": 12}, root=None, node="rod.{}", of="rod", end=1.0, sample=0.01, h=1e-3, peer=1e-4),
    "four_bar_steel": dict(beams={"coupler": 12, "rocker": 8}, root=None, node="coupler.{}", of="coupler", end=1.5,
                           sample=0.01, h=2e-3, peer=1e-4),
}


def model(system):
    text = (MODELS / f"{system}.toml").read_text()
    if system == "rotor":  # one blade: the hub is driven, the blades do not know of each other
        for k in (2, 3):
            text = re.sub(rf'\[\[(beam|joint)\]\]\nname = "(blade|root){k}".*?\n\n', "", text, flags=re.S)
    return text


class Run:
    def __init__(self, program, folder, system, factor, h, more=()):
        s = SYSTEMS[system]
        folder = pathlib.Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        file, self.out = folder / f"{system}.toml", folder / f"{system}-{factor}-{h:g}"
        file.write_text(model(system))
        sets = [f"beam.{b}.elements={n * factor}" for b, n in s["beams"].items()]
        sets += [f"simulation.every={round(s['sample'] / h)}", *more]
        if not (self.out / "summary.json").exists():
            args = [program, "run", file, "-o", self.out, "--force", "--step", repr(h), "--end", str(s["end"])]
            subprocess.run([*args, *(a for x in sets for a in ("--set", x))], check=True, capture_output=True)
        with open(self.out / "trajectory.csv") as f:
            names = f.readline().strip().split(",")
            rows = np.loadtxt(f, delimiter=",")
        column = {n: i for i, n in enumerate(names)}
        at = lambda n, d="": np.stack([rows[:, column[f"{n}.{d}{c}"]] for c in "xyz"], 1)
        last = s["beams"][s["of"]] * factor
        self.t = rows[:, 1]
        if s["root"]:
            self.x = at(s["node"].format(last))
            offset = self.x - at(s["root"])
            self.deflection = np.stack([(offset * at(s["root"], d)).sum(1) for d in ("d1", "d2", "d3")], 1)
        else:
            self.x = at(s["node"].format(last // 2))
            a, b = at(s["node"].format(0)), at(s["node"].format(last))
            chord = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
            self.deflection = np.cross(chord, self.x - (a + b) / 2)
        self.scale = np.linalg.norm(self.deflection - self.deflection[0], axis=1).max()
        self.path = np.linalg.norm(self.x - self.x[0], axis=1).max()


def peer(system, run, h, **more):
    s = SYSTEMS[system]
    job = dict(system=system, run=str(run.out), h=h, end=s["end"], sample=s["sample"], newton_tolerance=1e-6, **more)
    text = subprocess.run([sys.executable, "-W", "ignore", HERE / "exudyn_peer.py", json.dumps(job)], capture_output=True, text=True)
    found = [l for l in text.stdout.splitlines() if l.startswith("RESULT ")]
    if not found:
        raise SystemExit(text.stdout[-2000:] + text.stderr[-2000:])
    return json.loads(found[-1][7:])


def distance(run, t, x):
    """Largest distance at common times."""
    t, x = np.array(t), np.array(x)
    y = np.stack([np.interp(run.t, t, x[:, k]) for k in range(3)], 1)
    common = np.abs(run.t[:, None] - t[None, :]).min(1) < 1e-9
    assert common.sum() >= len(run.t) - 1, (common.sum(), len(run.t))
    return np.linalg.norm(run.x - y, axis=1)[common].max()


def main():
    program, folder, systems = sys.argv[1], sys.argv[2], sys.argv[3:] or list(SYSTEMS)
    for system in systems:
        s = SYSTEMS[system]
        runs = {k: Run(program, folder, system, 1, s["h"] / k) for k in (1, 2, 4, 8)}
        fine = runs[8]
        errors = [distance(runs[k], fine.t, fine.x) for k in (1, 2, 4)]
        print(f"{system}: deflection {fine.scale:.4g} m, path {fine.path:.4g} m")
        for k, e in zip((1, 2, 4), errors):
            print(f"  h = {s['h'] / k * 1e3:g} ms  error against h/8 {e:.3e} m = {e / fine.scale:.2e} of the deflection")
        # the error of h/8 itself, 1/64: e(h) - e(h/8) = C h² (1 - 1/64)
        limit = [e / (1 - k * k / 64) for k, e in zip((1, 2, 4), errors)]
        print("  orders " + ", ".join(f"{np.log2(a / b):.2f}" for a, b in zip(limit, limit[1:])))
        for factor in (1, 2):
            mine = fine if factor == 1 else Run(program, folder, system, factor, s["h"] / 8)
            his = peer(system, mine, s["peer"])
            half = peer(system, mine, s["peer"] / 2) if factor == 1 else None
            if not his["ok"]:
                print(f"  EXUDYN {factor}: failed after t = {his['t'][-1]}")
                continue
            d = distance(mine, his["t"], his["x"])
            own = distance(mine, half["t"], half["x"]) if half and half["ok"] else float("nan")
            coarse = distance(fine, mine.t, mine.x)
            print(f"  elements x{factor}: distance to EXUDYN {d:.3e} m = {d / fine.scale:.2e} of the deflection, "
                  f"{d / fine.path:.2e} of the path (its h/2: {own:.3e} m); own change with elements {coarse:.3e} m", flush=True)


if __name__ == "__main__":
    main()
