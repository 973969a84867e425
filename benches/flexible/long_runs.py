"""Long runs of the flexible systems at many steps: energy, angular momentum, constraints.

    python3 benches/flexible/long_runs.py PROGRAM FOLDER [NAME ...]     FOLDER: results; finished runs are not repeated

Prints a row for each run: system, step (ms), steps, how it ended, largest change of E_d, balance (of both halves of the run), both
relative to the largest kinetic energy; largest relative change of L_z and of L, largest linear momentum, largest residual of
the constraints, Newton iterations, ms per step. Rows of docs/flexible-systems.md are a part of these.
"""
import csv, json, math, pathlib, re, subprocess, sys

HERE = pathlib.Path(__file__).parent
MODELS = HERE / "../../examples/models"
STEPS = [1e-2, 4e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4]
MOST = 100_000  # steps
# model, steps (s), end of 100 revolutions (s), overrides, the time from which energy and momenta are compared (s)
RUNS = {
    "blade, stated": (HERE / "rotor_blade.toml", STEPS, 31.42, [], 0.0),
    "blade, relaxed": (HERE / "rotor_blade.toml", STEPS, 31.42, ["simulation.start=relaxed"], 0.0),
    "rotor": (MODELS / "rotor.toml", STEPS, 31.42, [], 0.0),
    "slider-crank": (MODELS / "flexible_slider_crank.toml", [2e-3, 1e-3, 5e-4, 2e-4], 26.5, [], 0.0),
    "four-bar": (MODELS / "four_bar_steel.toml", [4e-3, 2e-3, 1e-3, 5e-4], 63.0, [], 0.0),
    "satellite": (MODELS / "satellite.toml", [5e-2, 2e-2, 1e-2, 5e-3], 1257.0, [], 1.0),
}


def rows(file):
    with open(file) as f:
        return [{k: float(v) for k, v in row.items() if v} for row in csv.DictReader(f)]


def measure(out, since):
    summary = json.load(open(out / "summary.json"))
    result = {"status": summary["status"], "steps": summary["steps"], "failure": summary.get("failure"),
              "seconds_per_step": summary["seconds_per_step"], "residual": summary["constraint_residual"]["position"]["max"],
              "newton": summary["newton_iterations"]["mean"]}
    motion = [r for r in rows(out / "trajectory.csv") if r["t"] >= since]
    energy = [r for r in rows(out / "energy.csv") if r["t"] >= since]
    first, late = motion[0], motion[len(motion) // 2:]
    change = lambda part, f: max((abs(f(r)) for r in part), default=math.nan)
    result["kinetic"] = energy[0]["kinetic"] or energy[-1]["kinetic"]
    result["largest_kinetic"] = max(r["kinetic"] for r in energy)
    result["balance"] = change(energy, lambda r: r["balance"] - energy[0]["balance"])
    result["balance_halves"] = [change(p, lambda r: r["balance"] - energy[0]["balance"])
                                for p in (energy[:len(energy) // 2], energy[len(energy) // 2:])]
    result["E"] = change(motion[:-1], lambda r: r["E"] - first["E"])
    result["H"] = change(motion, lambda r: r["H"] - first["H"])
    norm = lambda r, s: math.sqrt(sum(r[s + c] ** 2 for c in "xyz"))
    result["Lz"] = change(motion, lambda r: r["Lz"] - first["Lz"]) / abs(first["Lz"] or 1.0)
    turned = lambda r: math.sqrt(sum((r["L" + c] - first["L" + c]) ** 2 for c in "xyz"))
    result["L"] = change(motion, turned) / (norm(first, "L") or 1.0)
    result["P"] = change(motion, lambda r: norm(r, "P"))
    return result


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[3:] or RUNS:
        model, steps, end, sets, since = RUNS[name]
        for h in steps:
            out = folder / f"{re.sub('[^a-z]+', '-', name)}-{h:g}"
            count = min(MOST, math.ceil(end / h))
            if not (out / "measured.json").exists():
                args = [program, "run", model, "-o", out, "--force", "--step", repr(h), "--end", repr(count * h)]
                every = max(1, min(100, count // 300))
                more = [a for x in [f"simulation.every={every}", *sets] for a in ("--set", x)]
                subprocess.run([*args, *more], capture_output=True)
                json.dump(measure(out, since), open(out / "measured.json", "w"))
            m = json.load(open(out / "measured.json"))
            ended = "done" if m["status"] == "done" else f"fails at {m['failure']['step']}"
            scale = m["largest_kinetic"]
            print(f"| {name} | {h * 1e3:g} | {m['steps']} | {ended} | {m['E'] / scale:.0e} | {m['balance'] / scale:.0e} "
                  f"({m['balance_halves'][0] / scale:.0e}, {m['balance_halves'][1] / scale:.0e}) | {m['Lz']:.0e} | {m['L']:.0e} "
                  f"| {m['P']:.0e} | {m['residual']:.0e} | {m['newton']:.2f} | {m['seconds_per_step'] * 1e3:.2f} |", flush=True)


if __name__ == "__main__":
    main()
