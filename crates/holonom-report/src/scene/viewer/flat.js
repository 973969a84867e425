  // ---- without WebGL: the same stage on a plane canvas, far triangles first ------------------------------------------
  const flat = (context) => {
    let at = null, plain = false, pieces = [];
    const upload = (mesh, vertices, indices) => Object.assign(mesh, { vertices, indices, length: vertices.length / 9 });
    const shade = (color, light) => `rgb(${color.map((c) => Math.round(255 * clamp(c * light, 0, 1))).join(" ")})`;
    const light = (a, b, c) => {
      const towards = unit(sub(at.eye, a));
      let normal = unit(cross(sub(b, a), sub(c, a)));
      if (dot(normal, towards) < 0) normal = scale(normal, -1);
      const lamp = unit(add(towards, add(scale(at.up, 0.8), scale(cross(at.up, towards), 0.35))));
      return 0.34 + 0.22 * (0.5 + 0.5 * dot(normal, at.up)) + 0.5 * (0.5 + 0.5 * dot(normal, lamp)) ** 1.5;
    };
    const draw = (mesh, model, color, { tinted = false, lines = null, opacity = 1 } = {}) => {
      const { vertices: v, indices: f, length } = mesh, whole = multiply(at.matrix, model);
      const row = (m, r, i) => m[r] * v[i] + m[4 + r] * v[i + 1] + m[8 + r] * v[i + 2] + m[12 + r];
      const places = [], world = [];
      for (let i = 0; i < 9 * length; i += 9) {
        const w = row(whole, 3, i), x = row(whole, 0, i) / w, y = row(whole, 1, i) / w;
        places.push([0.5 * (1 + x) * at.width, 0.5 * (1 - y) * at.height, w]);
        if (!lines) world.push([row(model, 0, i), row(model, 1, i), row(model, 2, i)]);
      }
      const add = (corners, paint, line) => {
        const own = corners.map((k) => places[k]), depth = own.reduce((sum, p) => sum + p[2], 0) / own.length;
        if (own.every((p) => p[2] > 0)) pieces.push({ own, depth, paint, line, opacity });
      };
      if (lines) for (let k = 0; k + 1 < length; k += lines === "strip" ? 1 : 2) add([k, k + 1], shade(color, 1), true);
      else for (let k = 0; k < f.length; k += 3) {
        const corners = [f[k], f[k + 1], f[k + 2]], own = tinted ? [...v.slice(9 * f[k] + 6, 9 * f[k] + 9)] : color;
        add(corners, shade(own, plain ? 1 : light(...corners.map((c) => world[c]))), false);
      }
    };
    const end = () => {
      pieces.sort((a, b) => b.depth - a.depth);
      context.lineJoin = "round";
      context.lineWidth = at.ratio;
      for (const { own, paint, line, opacity } of pieces) {
        context.globalAlpha = opacity;
        context.beginPath();
        own.forEach(([x, y], k) => (k === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
        context.strokeStyle = context.fillStyle = paint;
        if (!line) context.fill();
        if (line || opacity === 1) context.stroke();
      }
      context.globalAlpha = 1;
    };
    const begin = (now) => {
      at = now;
      pieces = [];
      context.fillStyle = shade(at.back, 1);
      context.fillRect(0, 0, at.width, at.height);
    };
    return { fine: false, upload, draw, begin, turn: () => {}, shadeless: (on) => { plain = on; }, shadows: () => {}, glass: (paint) => paint(), end };
  };

  const stage = (() => {
    const gl = canvas.getContext("webgl2", { antialias: true, stencil: true, preserveDrawingBuffer: true });
    if (gl) return webgl(gl);
    const context = canvas.getContext("2d");
    if (!context) return null;
    root.querySelector(".scene-note").classList.add("low");
    say("drawn without WebGL: coarse surfaces, no shadows");
    return flat(context);
  })();
  if (!stage) { say("This browser draws nothing here. The numbers are below."); return; }
  canvas.dataset.stage = stage.fine ? "webgl" : "flat";
  const { upload, draw } = stage;
