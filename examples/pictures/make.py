"""Pictures of all shipped models and the page that shows them, examples/README.md; moving drawings for README.md.

    python examples/pictures/make.py PROGRAM FOLDER [NAME ...]      with Pillow; Chromium draws

Each model is run for at most 1500 steps into FOLDER; the picture is the scene of its page at 60 % of the run, of a model with
controls that of its optimum, by a program with the feature `optimize`. With names, only these pictures are drawn; the page is written
in any case. Moving drawings are those of MOVING, by `holonom export --format svg`.
"""
import io, json, pathlib, subprocess, sys, tomllib
from PIL import Image

HERE = pathlib.Path(__file__).parent
MODELS = HERE / "../models"
MOST = 1500  # steps
ALONE = ("<style>main>*:not(#scene),.scene-bar,#scene>.note{display:none!important}main{max-width:none!important;padding:0!important;"
         "margin:0!important}#scene{margin:0!important;border:0!important;border-radius:0!important}.scene-view{max-height:none!important}</style></head>")
SIZE = (640, 360)
MOVING = {"bricard": 5.0, "heavy_top_steady": 0.628, "flying_beam": 6.0, "flexible_four_bar": 4.0}  # end, s

program, folder = sys.argv[1], pathlib.Path(sys.argv[2])


def run(*arguments):
    return subprocess.run([str(a) for a in arguments], capture_output=True, text=True)


def picture(name):
    whole = tomllib.load(open(MODELS / f"{name}.toml", "rb"))
    model, out = whole["simulation"], folder / name
    end = model["end"] if model.get("scheme") == "static" else min(model["end"], MOST * model["step"])
    if "control" in whole:
        run(program, "optimize", MODELS / f"{name}.toml", "-o", out, "--force", "-q")
        end = json.loads((out / "optimum.json").read_text())["time"]
    else:
        run(program, "run", MODELS / f"{name}.toml", "-o", out, "--force", "--end", end, "-q")
    page = out / "report.html"
    if 'id="scene"' not in page.read_text():
        return False
    (out / "alone.html").write_text(page.read_text().replace("</head>", ALONE, 1))
    address = f"{(out / 'alone.html').resolve().as_uri()}#t={0.6 * end}"
    shot = out / "scene.png"
    run("chromium", "--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--virtual-time-budget=3000",
        "--hide-scrollbars", f"--window-size={SIZE[0]},{SIZE[1]}", f"--screenshot={shot}", address)
    image = Image.open(shot).convert("RGB").crop((0, 0, *SIZE))
    image.quantize(64, dither=Image.Dither.NONE).save(HERE / f"{name}.png", optimize=True)
    return True


def moving(name, end):
    out = folder / f"{name}-moving"
    run(program, "run", MODELS / f"{name}.toml", "-o", out, "--force", "--end", end, "-q")
    run(program, "export", out, "--format", "svg", "--frames", 100, "-o", HERE / f"{name}.svg", "--force")


def main():
    folder.mkdir(parents=True, exist_ok=True)
    listed = [line.split(maxsplit=1) for line in run(program, "examples").stdout.splitlines()]
    for name, _ in listed:
        if not sys.argv[3:] or name in sys.argv[3:]:
            print(name, "drawn" if picture(name) else "has no scene", flush=True)
            if name in MOVING:
                moving(name, MOVING[name])
    page = io.StringIO()
    page.write("# Models\n\n`holonom examples` lists these models, `holonom examples NAME -o FILE` writes one, `holonom run FILE` runs it. "
               "The pictures are from\nthe pages of the runs, at 60 % of the time (`examples/pictures/make.py`).\n\n| | |\n|---|---|\n")
    for name, about in listed:
        about = about[0].upper() + about[1:]
        shown = f"![{name}](pictures/{name}.png)" if (HERE / f"{name}.png").exists() else ""
        page.write(f"| {shown} | [`{name}`](models/{name}.toml)<br>{about.replace('|', ' ')} |\n")
    page.write("\nFrequencies of one blade of `rotor` over its speed, by `holonom modes --speeds`\n([flexible systems](../docs/flexible-systems.md)):\n\n"
               "![Campbell diagram](../docs/figures/campbell.svg)\n\nPrograms in Rust: [`examples/`](.), each with `cargo run -p holonom --example NAME`.\n")
    (HERE / "../README.md").write_text(page.getvalue())


main()
