// The animated scene of a run: WebGL 2, no library. Data: the JSON of scene/mod.rs in the element `scene-data`.
// Vectors are arrays of 3, quaternions are [x, y, z, w], matrices are column-major Float32Arrays of 16.
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("scene-data").textContent);
  const root = document.getElementById("scene");
  const canvas = root.querySelector("canvas");
  const say = (text) => { root.querySelector(".scene-note").textContent = text; };

  // ---- numbers -----------------------------------------------------------------------------------------------
  const floats = (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  };
  const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
  const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const norm = (a) => Math.hypot(a[0], a[1], a[2]);
  const unit = (a) => scale(a, 1 / (norm(a) || 1));
  const lerp = (a, b, s) => add(scale(a, 1 - s), scale(b, s));
  const clamp = (x, low, high) => Math.min(high, Math.max(low, x));
  const rotate = (q, v) => {
    const u = [q[0], q[1], q[2]];
    const t = scale(cross(u, v), 2);
    return add(add(v, scale(t, q[3])), cross(u, t));
  };
  const nlerp = (a, b, s) => {
    const sign = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0 ? -1 : 1;
    const q = a.map((x, i) => x * (1 - s) + sign * b[i] * s);
    const n = Math.hypot(...q) || 1;
    return q.map((x) => x / n);
  };
  const multiply = (a, b) => {
    const out = new Float32Array(16);
    for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[4 * k + r] * b[4 * c + k];
      out[4 * c + r] = sum;
    }
    return out;
  };
  // columns x, y, z (with their lengths) and the origin
  const frame = (x, y, z, o) => new Float32Array([...x, 0, ...y, 0, ...z, 0, ...o, 1]);
  // a frame whose third axis is along `axis`
  const along = (axis, o, [sx, sy, sz]) => {
    const z = unit(axis);
    const x = unit(cross(Math.abs(z[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], z));
    return frame(scale(x, sx), scale(cross(z, x), sy), scale(z, sz), o);
  };

  // ---- the motion --------------------------------------------------------------------------------------------
  const times = floats(data.times);
  const poses = floats(data.poses);
  const stride = data.members.reduce((sum, m) => sum + (m.frame ? 7 : 3), 0);
  const offsets = [];
  data.members.reduce((at, m) => { offsets.push(at); return at + (m.frame ? 7 : 3); }, 0);
  const last = times.length - 1;
  const index = (t) => {
    let [low, high] = [0, last];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= t) low = middle; else high = middle;
    }
    return low;
  };
  // { c, q } of a member at time t; the chart of times is piecewise linear
  const pose = (member, k, s) => {
    const at = (n) => offsets[member] + stride * n;
    const [a, b] = [at(k), at(Math.min(k + 1, last))];
    const c = lerp([poses[a], poses[a + 1], poses[a + 2]], [poses[b], poses[b + 1], poses[b + 2]], s);
    if (!data.members[member].frame) return { c, q: [0, 0, 0, 1] };
    const q = (n) => [poses[n + 3], poses[n + 4], poses[n + 5], poses[n + 6]];
    return { c, q: nlerp(q(a), q(b), s) };
  };
  let now = [];
  const place = (t) => {
    const k = index(t);
    const span = times[Math.min(k + 1, last)] - times[k];
    const s = span > 0 ? clamp((t - times[k]) / span, 0, 1) : 0;
    if (options.follow) camera.target = center(k, s);
    now = data.members.map((_, member) => pose(member, k, s));
    return k;
  };
  const ground = { c: [0, 0, 0], q: [0, 0, 0, 1] };
  const holder = (end) => (end.member < 0 ? ground : now[end.member]);
  const point = (end) => { const h = holder(end); return add(h.c, rotate(h.q, end.point)); };
  const direction = (end, v) => rotate(holder(end).q, v);

  // ---- extent of the whole motion ----------------------------------------------------------------------------
  const extent = () => ({ low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity] });
  const grow = (box, x, margin) => {
    for (let i = 0; i < 3; i++) {
      box.low[i] = Math.min(box.low[i], x[i] - margin);
      box.high[i] = Math.max(box.high[i], x[i] + margin);
    }
  };
  const half = (box) => 0.5 * norm(sub(box.high, box.low));
  const reach = data.members.map(() => 0);
  for (const body of data.bodies) reach[body.member] = body.reach;
  const at = (member, k) => { const i = offsets[member] + stride * k; return [poses[i], poses[i + 1], poses[i + 2]]; };
  const whole = extent();
  const center = (k, s) => data.members.reduce((sum, _, m) => add(sum, scale(lerp(at(m, k), at(m, Math.min(k + 1, last)), s), 1 / data.members.length)), [0, 0, 0]);
  let momentary = extent(); // the largest of an instant
  const seen = []; // points of the motion that the camera must see: place, place from the centre, reach
  const every = Math.max(1, last >> 8, Math.floor((last * data.members.length) / 20000));
  for (let k = 0; k <= last; k += every) {
    const box = extent(), c = center(k, 0);
    data.members.forEach((_, m) => {
      grow(box, at(m, k), reach[m]);
      grow(whole, at(m, k), reach[m]);
      seen.push([at(m, k), sub(at(m, k), c), reach[m]]);
    });
    if (k === 0 || half(box) > half(momentary)) momentary = box;
  }
  for (const end of data.fixed) { grow(whole, end, 0); seen.push([end, [0, 0, 0], 0]); }
  if (!Number.isFinite(whole.low[0])) [whole.low, whole.high] = [[-1, -1, -1], [1, 1, 1]];
  const { low, high } = whole;
  const middle = lerp(low, high, 0.5);
  const radius = Math.max(1e-6, half(whole));
  // free systems that travel far: the camera goes with them
  const travels = data.fixed.length === 0 && !data.bodies.some((b) => b.fixed) && radius > 2.5 * half(momentary);
  const up = data.up;
  const level = Math.min(...[low, high].flatMap((a) => [low, high].flatMap((b) => [low, high].map((c) => dot([a[0], b[1], c[2]], up)))));

  // ---- WebGL -------------------------------------------------------------------------------------------------
  const gl = canvas.getContext("webgl2", { antialias: true, stencil: true, preserveDrawingBuffer: true });
  if (!gl) { say("This browser offers no WebGL 2: the motion cannot be shown here. The plots below show the numbers."); return; }
  const compile = (type, source) => {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    return shader;
  };
  const program = gl.createProgram();
  gl.attachShader(program, compile(gl.VERTEX_SHADER, `#version 300 es
    in vec3 position; in vec3 normal; in vec3 tint;
    uniform mat4 model, view; uniform bool shadeless; uniform mat4 squash;
    out vec3 n; out vec3 world; out vec3 shade;
    void main() {
      vec4 w = squash * (model * vec4(position, 1.0));
      mat3 m = mat3(model);
      n = shadeless ? vec3(0.0) : m * (normal / vec3(dot(m[0], m[0]), dot(m[1], m[1]), dot(m[2], m[2])));
      world = w.xyz; shade = tint; gl_Position = view * w;
    }`));
  gl.attachShader(program, compile(gl.FRAGMENT_SHADER, `#version 300 es
    precision highp float;
    in vec3 n; in vec3 world; in vec3 shade;
    uniform vec4 color; uniform vec3 eye, up; uniform bool tinted;
    out vec4 fragment;
    void main() {
      vec4 base = tinted ? vec4(shade, color.a) : color;
      if (dot(n, n) == 0.0) { fragment = base; return; }
      vec3 N = normalize(n), E = normalize(eye - world);
      if (dot(N, E) < 0.0) N = -N;
      vec3 L = normalize(E + 0.8 * up + 0.35 * cross(up, E));
      float diffuse = pow(0.5 + 0.5 * dot(N, L), 1.5), sky = 0.5 + 0.5 * dot(N, up); // wrapped: no side is black
      float gloss = pow(max(dot(reflect(-L, N), E), 0.0), 32.0);
      fragment = vec4(base.rgb * (0.34 + 0.22 * sky + 0.5 * diffuse) + 0.12 * gloss, base.a);
    }`));
  gl.bindAttribLocation(program, 0, "position");
  gl.bindAttribLocation(program, 1, "normal");
  gl.bindAttribLocation(program, 2, "tint");
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  gl.useProgram(program);
  const uniform = {};
  for (const name of ["model", "view", "shadeless", "squash", "color", "eye", "up", "tinted"]) uniform[name] = gl.getUniformLocation(program, name);

  // vertices: 9 numbers each (position, normal, tint)
  const upload = (mesh, vertices, indices, usage = gl.STATIC_DRAW) => {
    if (!mesh.array) {
      mesh.array = gl.createVertexArray();
      mesh.vertices = gl.createBuffer();
      mesh.indices = gl.createBuffer();
      gl.bindVertexArray(mesh.array);
      gl.bindBuffer(gl.ARRAY_BUFFER, mesh.vertices);
      for (let i = 0; i < 3; i++) {
        gl.enableVertexAttribArray(i);
        gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 36, 12 * i);
      }
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.indices);
    }
    gl.bindVertexArray(mesh.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.vertices);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(vertices), usage);
    if (indices) {
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(indices), usage);
      mesh.count = indices.length;
    }
    return mesh;
  };
  // surface of revolution about the third axis: [radius, height, slope of the normal] along the profile
  const lathe = (profile, sides = 36) => {
    const v = [], f = [];
    profile.forEach(([r, z, nr, nz]) => {
      for (let i = 0; i <= sides; i++) {
        const a = (2 * Math.PI * i) / sides;
        v.push(r * Math.cos(a), r * Math.sin(a), z, nr * Math.cos(a), nr * Math.sin(a), nz, 1, 1, 1);
      }
    });
    for (let p = 0; p + 1 < profile.length; p++) for (let i = 0; i < sides; i++) {
      const a = p * (sides + 1) + i, b = a + sides + 1;
      f.push(a, a + 1, b, b, a + 1, b + 1);
    }
    return upload({}, v, f);
  };
  const cube = () => {
    const v = [], f = [];
    for (let axis = 0; axis < 3; axis++) for (const side of [-1, 1]) {
      const n = [0, 0, 0];
      n[axis] = side;
      const first = v.length / 9;
      for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
        const x = [0, 0, 0];
        x[axis] = side / 2; x[(axis + 1) % 3] = a / 2; x[(axis + 2) % 3] = b / 2;
        v.push(...x, ...n, 1, 1, 1);
      }
      f.push(first, first + 1, first + 2, first, first + 2, first + 3);
    }
    return upload({}, v, f);
  };
  // a surface of triangles: smooth where neighbours meet at less than 40°
  const surface = ({ corners, triangles }) => {
    const x = floats(corners), t = new Uint32Array(floats(triangles).buffer), v = [], f = [];
    const corner = (k) => [x[3 * k], x[3 * k + 1], x[3 * k + 2]];
    const normals = [], around = Array.from({ length: x.length / 3 }, () => []);
    for (let i = 0; i < t.length; i += 3) {
      const [a, b, c] = [0, 1, 2].map((k) => corner(t[i + k]));
      normals.push(cross(sub(b, a), sub(c, a)));
      for (let k = 0; k < 3; k++) around[t[i + k]].push(i / 3);
    }
    const units = normals.map(unit);
    t.forEach((k, i) => {
      const own = units[Math.floor(i / 3)];
      const sum = (around[k].length > 64 ? [] : around[k]).reduce((n, j) => (dot(units[j], own) > 0.77 ? add(n, normals[j]) : n), [0, 0, 0]);
      const n = unit(sum);
      v.push(...corner(k), ...(norm(n) > 0 ? n : own), 1, 1, 1);
      f.push(i);
    });
    return upload({}, v, f);
  };
  const surfaces = data.meshes.map(surface);
  const meridian = Array.from({ length: 19 }, (_, i) => -Math.PI / 2 + (Math.PI * i) / 18);
  const meshes = {
    box: cube(),                                                                    // edges of length 1
    cylinder: lathe([[0, -0.5, 0, -1], [1, -0.5, 0, -1], [1, -0.5, 1, 0], [1, 0.5, 1, 0], [1, 0.5, 0, 1], [0, 0.5, 0, 1]]),
    cone: lathe([[0, 0, 0, 1], [1, 0, 0, 1], [1, 0, 1, -1], [0, -1, 1, -1]]),       // base at 0, tip at −1
    sphere: lathe(meridian.map((a) => [Math.cos(a), Math.sin(a), Math.cos(a), Math.sin(a)])),
  };

  // ---- colours -----------------------------------------------------------------------------------------------
  const palette = data.palette.map((color) => color.map((c) => c / 255));
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const theme = () => (dark.matches
    ? { back: [0.075, 0.09, 0.11], grid: [0.32, 0.36, 0.42], ink: [0.8, 0.83, 0.87], shadow: 0.45 }
    : { back: [0.965, 0.97, 0.98], grid: [0.78, 0.8, 0.84], ink: [0.25, 0.28, 0.33], shadow: 0.16 });
  // blue, white, red over 0 … 1, for strains and moments
  const heat = (s) => {
    const [cold, warm, hot] = [[0.23, 0.42, 0.75], [0.95, 0.85, 0.35], [0.8, 0.15, 0.12]];
    return s < 0.5 ? lerp(cold, warm, 2 * s) : lerp(warm, hot, 2 * s - 1);
  };

  // ---- what is drawn -----------------------------------------------------------------------------------------
  const size = travels ? half(momentary) : radius, symbol = 0.014 * size;
  const beams = data.beams.map((beam, k) => ({ ...beam, mesh: {}, color: palette[(data.bodies.length + k) % palette.length], values: beam.values ? floats(beam.values) : null }));
  const loads = data.loads.map((load) => ({ ...load, factors: floats(load.factors) }));
  const strongest = Math.max(...loads.map((l) => norm(l.force) * Math.max(...l.factors.map(Math.abs))), 1e-300);
  const reactions = data.reactions.map((reaction) => ({ ...reaction, forces: floats(reaction.forces) }));
  const reactionAt = (reaction, k) => [...reaction.forces.subarray(3 * k, 3 * k + 3)];
  const largestReaction = Math.max(...reactions.flatMap((r) => times.reduce((all, _, k) => Math.max(all, norm(reactionAt(r, k)) || 0), 0)), 1e-300);
  const options = { trails: false, grid: true, loads: true, reactions: true, labels: false, follow: travels };
  const draw = (mesh, model, color, { tinted = false, mode = gl.TRIANGLES } = {}) => {
    gl.bindVertexArray(mesh.array);
    gl.uniformMatrix4fv(uniform.model, false, model);
    gl.uniform4f(uniform.color, ...color, 1);
    gl.uniform1i(uniform.tinted, tinted ? 1 : 0);
    if (mode === gl.TRIANGLES) gl.drawElements(mode, mesh.count, gl.UNSIGNED_INT, 0);
    else gl.drawArrays(mode, 0, mesh.length);
  };
  const axes = ({ c, q }, [x, y, z], offset = [0, 0, 0]) => frame(
    scale(rotate(q, [1, 0, 0]), x), scale(rotate(q, [0, 1, 0]), y), scale(rotate(q, [0, 0, 1]), z), add(c, rotate(q, offset)));
  const product = (a, b) => {
    const v = add(add(scale([b[0], b[1], b[2]], a[3]), scale([a[0], a[1], a[2]], b[3])), cross(a, b));
    return [...v, a[3] * b[3] - dot(a, b)];
  };
  const stick = (a, b, thickness, color) => {
    const d = sub(b, a), length = norm(d);
    if (length > 0) draw(meshes.cylinder, along(d, lerp(a, b, 0.5), [thickness, thickness, length]), color);
  };
  const arrow = (tip, d, color) => {
    const length = norm(d), head = Math.min(0.35 * length, 5 * symbol);
    if (length < 1e-3 * size) return;
    const neck = sub(tip, scale(unit(d), head));
    stick(sub(tip, d), neck, 0.35 * symbol, color);
    draw(meshes.cone, along(scale(d, -1), neck, [symbol, symbol, head]), color);
  };
  const drawBody = (body, k) => {
    const at = now[body.member];
    const own = { c: at.c, q: product(at.q, body.rotation) };
    const color = body.fixed ? theme().grid : palette[k % palette.length];
    const [a, b, c] = body.dimensions;
    switch (body.shape) {
      case "mesh": draw(surfaces[body.mesh], axes(own, [1, 1, 1]), color); break;
      case "box": draw(meshes.box, axes(own, [a, b, c]), color); break;
      case "cylinder": draw(meshes.cylinder, axes(own, [a, a, b]), color); break;
      case "rod": draw(meshes.cylinder, axes(own, [b, b, a]), color); break;
      case "sphere": draw(meshes.sphere, axes(own, [a, a, a]), color); break;
      case "cone": draw(meshes.cone, axes(own, [a, a, b], [0, 0, b / 4]), color); break;
      default: // the links to its joints; else the ellipsoid of inertia
        if (body.link) draw(meshes.sphere, axes(at, [1.6 * symbol, 1.6 * symbol, 1.6 * symbol]), color);
        else draw(meshes.sphere, axes(at, body.dimensions), color);
    }
    for (const anchor of body.anchors) stick(at.c, add(at.c, rotate(at.q, anchor)), (body.link ? 0.8 : 0.35) * symbol, color);
  };
  const drawJoint = (joint) => {
    const [a, b] = [point(joint.parent), point(joint.child)];
    const axis = joint.axis ? direction(joint.parent, joint.axis) : up;
    const color = theme().ink, s = symbol;
    const pin = (x, length, thick = s) => draw(meshes.cylinder, along(axis, x, [thick, thick, length]), color);
    if (norm(sub(b, a)) > 0.5 * s) stick(a, b, 0.3 * s, color);
    switch (joint.type) {
      case "revolute": pin(b, 4 * s); break;
      case "screw": pin(b, 5 * s); pin(b, 1.2 * s, 1.5 * s); break;
      case "cylindrical": pin(a, 6 * s, 0.8 * s); pin(b, 2.5 * s, 1.3 * s); break;
      case "prismatic": draw(meshes.box, along(axis, b, [2.2 * s, 2.2 * s, 4 * s]), color); break;
      case "planar": pin(b, 0.4 * s, 3 * s); break;
      case "fixed": draw(meshes.box, along(axis, b, [2 * s, 2 * s, 2 * s]), color); break;
      case "universal": {
        pin(b, 4 * s, 0.6 * s);
        draw(meshes.cylinder, along(direction(joint.child, joint.axis2 || [1, 0, 0]), b, [0.6 * s, 0.6 * s, 4 * s]), color);
        break;
      }
      default: draw(meshes.sphere, along([0, 0, 1], b, [1.3 * s, 1.3 * s, 1.3 * s]), color);
    }
  };
  // a helix between two points
  const coil = { array: null };
  const drawSpring = (spring) => {
    const [a, b] = [point(spring.from), point(spring.to)];
    const d = sub(b, a), length = norm(d);
    if (length === 0) return;
    const m = along(d, a, [1, 1, 1]), r = 1.2 * symbol, v = [], turns = 10, steps = 16 * turns;
    for (let i = 0; i <= steps; i++) {
      const s = i / steps, eased = clamp((s - 0.1) / 0.8, 0, 1), w = s > 0.1 && s < 0.9 ? r : 0, angle = 2 * Math.PI * turns * eased;
      const x = add(scale([m[0], m[1], m[2]], w * Math.cos(angle)), scale([m[4], m[5], m[6]], w * Math.sin(angle)));
      v.push(...add(add(a, scale(d, s)), x), 0, 0, 0, 1, 1, 1);
    }
    upload(coil, v, null, gl.DYNAMIC_DRAW);
    coil.length = steps + 1;
    draw(coil, identity, theme().ink, { mode: gl.LINE_STRIP });
  };
  // a beam as a tube: a cubic between nodes along d_3, sections along d_1 and d_2
  const drawBeam = (beam, k) => {
    const v = [], f = [], sides = beam.round ? 14 : 4, parts = 3;
    let node = beam.first, rings = 0;
    for (const count of beam.legs) {
      for (let i = 0; i + 1 < count; i++) {
        const [p, q] = [now[node + i], now[node + i + 1]], chord = norm(sub(q.c, p.c));
        const [tp, tq] = [p, q].map((n) => scale(rotate(n.q, [0, 0, 1]), chord));
        for (let part = i === 0 ? 0 : 1; part <= parts; part++) {
          const s = part / parts, h = [(1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2, s * s * (3 - 2 * s), s * s * (s - 1)];
          const c = add(add(scale(p.c, h[0]), scale(tp, h[1])), add(scale(q.c, h[2]), scale(tq, h[3])));
          const turn = nlerp(p.q, q.q, s), [x, y] = [[1, 0, 0], [0, 1, 0]].map((e) => rotate(turn, e));
          const tint = beam.values ? heat(clamp(lerpValue(beam, k, node - beam.first + i, s), 0, 1)) : beam.color;
          for (let j = 0; j <= sides; j++) {
            const a = (2 * Math.PI * (j + (beam.round ? 0 : 0.5))) / sides, wide = beam.round ? 1 : Math.SQRT2;
            const e = [Math.cos(a), Math.sin(a)];
            const at = add(c, add(scale(x, wide * beam.half[0] * e[0]), scale(y, wide * beam.half[1] * e[1])));
            v.push(...at, ...add(scale(x, e[0] / beam.half[0]), scale(y, e[1] / beam.half[1])), ...tint);
          }
          if (part > 0 || i > 0) for (let j = 0; j < sides; j++) {
            const b = rings * (sides + 1) + j, a = b - sides - 1;
            f.push(a, a + 1, b, b, a + 1, b + 1);
          }
          rings++;
        }
      }
      node += count;
    }
    upload(beam.mesh, v, f, gl.DYNAMIC_DRAW);
    draw(beam.mesh, identity, beam.color, { tinted: true });
  };
  // the measure of a beam at an instant and an interval between nodes, over its largest value
  const lerpValue = (beam, k, interval, s) => {
    const per = beam.intervals, at = k * per;
    const here = beam.values[at + clamp(interval, 0, per - 1)], next = beam.values[at + clamp(interval + 1, 0, per - 1)];
    return (here * (1 - s) + next * s) / (beam.largest || 1);
  };
  const line = {}, identity = frame([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]);
  const drawTrails = (k) => {
    const moving = data.bodies.filter((b) => !b.fixed).map((b) => b.member).concat(data.points);
    moving.slice(0, 40).forEach((member, i) => {
      const v = [];
      for (let n = 0; n <= k; n++) {
        const at = offsets[member] + stride * n;
        v.push(poses[at], poses[at + 1], poses[at + 2], 0, 0, 0, 1, 1, 1);
      }
      v.push(...now[member].c, 0, 0, 0, 1, 1, 1);
      upload(line, v, null, gl.DYNAMIC_DRAW);
      line.length = v.length / 9;
      draw(line, identity, palette[i % palette.length], { mode: gl.LINE_STRIP });
    });
  };
  const grid = (() => {
    const spacing = 10 ** Math.floor(Math.log10(radius)), count = Math.ceil((2.2 * radius) / spacing);
    const e1 = unit(cross(Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], up)), e2 = cross(up, e1);
    const foot = add(middle, scale(up, level - dot(middle, up) - 1e-3 * radius)), v = [];
    const corner = (i, j) => v.push(...add(foot, add(scale(e1, i * spacing), scale(e2, j * spacing))), 0, 0, 0, 1, 1, 1);
    for (let i = -count; i <= count; i++) { corner(i, -count); corner(i, count); corner(-count, i); corner(count, i); }
    const mesh = upload({}, v, null);
    mesh.length = v.length / 9;
    return mesh;
  })();
  // the projection along `up` onto the ground
  const squash = new Float32Array(16);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) {
    squash[4 * c + r] = (r === c ? 1 : 0) - (c < 3 && r < 3 ? up[r] * up[c] : 0) + (c === 3 && r < 3 ? up[r] * (level - 5e-4 * radius) : 0);
  }

  // ---- camera ------------------------------------------------------------------------------------------------
  // the horizontal direction from which the front is seen
  const facing = Math.abs(up[2]) > 0.9 ? [0, -1, 0] : Math.abs(up[1]) > 0.9 ? [0, 0, 1] : cross(up, unit(cross([0, 0, 1], up)));
  const presets = { iso: [0.65, 0.42], front: [0, 0], side: [Math.PI / 2, 0], top: [0, Math.PI / 2 - 1e-3] };
  const camera = { yaw: 0, pitch: 0, distance: 0, target: middle };
  let view = data.planar ? "front" : "iso";
  const look = (name) => {
    view = name;
    [camera.yaw, camera.pitch] = presets[name];
    camera.target = middle;
    // everything that moves inside the picture
    const z = outward(), x = unit(cross(up, z)), y = cross(z, x), slope = 0.88 * Math.tan(0.3);
    camera.distance = 0.2 * size;
    for (const [where, relative, margin] of seen) {
      const r = options.follow ? relative : sub(where, middle);
      const across = Math.max((Math.abs(dot(r, x)) + margin) / (slope * Math.max(aspect(), 1e-3)), (Math.abs(dot(r, y)) + margin) / slope);
      camera.distance = Math.max(camera.distance, dot(r, z) + across);
    }
  };
  const aspect = () => canvas.clientWidth / Math.max(1, canvas.clientHeight);
  // unit vector from the target to the eye
  const outward = () => {
    const horizontal = add(scale(facing, Math.cos(camera.yaw)), scale(cross(up, facing), Math.sin(camera.yaw)));
    return add(scale(horizontal, Math.cos(camera.pitch)), scale(up, Math.sin(camera.pitch)));
  };
  const viewMatrix = () => {
    const z = outward(), x = unit(cross(up, z)), y = cross(z, x);
    const eye = add(camera.target, scale(z, camera.distance));
    const near = Math.max(camera.distance - 4 * radius, camera.distance * 0.01), far = camera.distance + 8 * radius;
    const f = 1 / Math.tan(0.3), a = aspect();
    const projection = new Float32Array([f / a, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0]);
    const world = new Float32Array([x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, eye), -dot(y, eye), -dot(z, eye), 1]);
    return { matrix: multiply(projection, world), eye, x, y };
  };
  // pixel of a point in space, from the upper left corner of the canvas
  const pixel = (x) => {
    const m = viewMatrix().matrix, at = (r) => m[r] * x[0] + m[4 + r] * x[1] + m[8 + r] * x[2] + m[12 + r];
    const w = at(3);
    return [0.5 * (1 + at(0) / w) * canvas.clientWidth, 0.5 * (1 - at(1) / w) * canvas.clientHeight];
  };

  // ---- a picture ---------------------------------------------------------------------------------------------
  const state = { t: times[0], playing: false, speed: 1, loop: true };
  const everything = (k) => {
    data.bodies.forEach(drawBody);
    beams.forEach((beam) => drawBeam(beam, k));
    data.points.forEach((member, i) => draw(meshes.sphere, along([0, 0, 1], now[member].c, [1.6 * symbol, 1.6 * symbol, 1.6 * symbol]), palette[(data.bodies.length + i) % palette.length]));
    data.bars.forEach((bar) => stick(point(bar.from), point(bar.to), 0.4 * symbol, theme().ink));
    data.joints.forEach(drawJoint);
    // on the child, with the tip at the joint; one that is not unique is no number and not drawn
    if (options.reactions) reactions.forEach((reaction) => {
      const force = scale(reactionAt(reaction, k), (0.5 * size) / largestReaction);
      if (force.every(Number.isFinite)) arrow(point(reaction.end), force, palette[7]);
    });
    if (!options.loads) return;
    loads.forEach((load) => {
      const length = (0.5 * size * load.factors[k]) / strongest;
      for (const end of load.ends) {
        const force = load.follower ? direction(end, load.force) : load.force;
        arrow(point(end), scale(force, length), palette[4]);
      }
    });
  };
  const labels = root.querySelector(".scene-labels");
  const paint = () => {
    const ratio = window.devicePixelRatio || 1, [w, h] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.max(1, Math.round(x * ratio)));
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    gl.viewport(0, 0, w, h);
    const k = place(state.t); // first: the camera may follow
    const colors = theme(), { matrix, eye } = viewMatrix();
    gl.clearColor(...colors.back, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.uniformMatrix4fv(uniform.view, false, matrix);
    gl.uniform3f(uniform.eye, ...eye);
    gl.uniform3f(uniform.up, ...up);
    gl.uniformMatrix4fv(uniform.squash, false, identity);
    gl.uniform1i(uniform.shadeless, 0);
    everything(k);
    gl.uniform1i(uniform.shadeless, 1);
    data.springs.forEach(drawSpring);
    if (options.trails) drawTrails(k);
    if (options.grid && camera.pitch > -0.05) {
      draw(grid, identity, colors.grid, { mode: gl.LINES });
      // shadows: every pixel of the ground once
      gl.enable(gl.STENCIL_TEST);
      gl.stencilFunc(gl.EQUAL, 0, 255);
      gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ZERO, gl.CONSTANT_COLOR);
      const d = 1 - colors.shadow;
      gl.blendColor(d, d, d, 1);
      gl.depthMask(false);
      if (data.grounded) { gl.uniformMatrix4fv(uniform.squash, false, squash); everything(k); }
      gl.depthMask(true);
      gl.disable(gl.BLEND);
      gl.disable(gl.STENCIL_TEST);
    }
    labels.textContent = "";
    if (options.labels) {
      const named = data.bodies.map((b) => [b.name, b.member]).concat(data.points.map((m) => [data.members[m].name, m]));
      for (const [name, member] of named) {
        const tag = document.createElement("span"), [x, y] = pixel(now[member].c);
        tag.textContent = name;
        tag.style.transform = `translate(${x}px, ${y}px)`;
        labels.append(tag);
      }
    }
  };

  // ---- controls ----------------------------------------------------------------------------------------------
  const ui = Object.fromEntries(["play", "slider", "clock", "speed", "trails", "grid", "labels", "loads", "reactions", "follow", "full"].map((name) => [name, root.querySelector(`[data-${name}]`)]));
  const [begin, end] = [times[0], times[last]];
  const decimals = clamp(2 - Math.floor(Math.log10(Math.max((end - begin) / 100, 1e-12))) - 1, 0, 9);
  const watchers = [];
  const refresh = () => {
    ui.slider.value = end > begin ? ((state.t - begin) / (end - begin)) * 1000 : 0;
    ui.clock.textContent = `t = ${state.t.toFixed(decimals)} s`;
    ui.slider.setAttribute("aria-valuetext", ui.clock.textContent);
    ui.play.textContent = state.playing ? "❚❚" : "▶";
    ui.play.setAttribute("aria-label", state.playing ? "pause" : "play");
    paint();
    if (!state.playing) announce();
    watchers.forEach((watch) => watch(state.t));
  };
  // where a member is on the canvas, for those who read the page without seeing it: `name x y` in px
  const announce = () => {
    const { left, top } = canvas.getBoundingClientRect();
    Object.assign(canvas.dataset, { time: state.t, view, left, top });
    canvas.dataset.members = data.members.map((m, k) => [m.name, ...pixel(now[k].c).map((x) => x.toFixed(1))].join(" ")).join("; ");
  };
  const remember = () => history.replaceState(null, "", `#t=${state.t.toFixed(decimals)}&view=${view}`);
  const seek = (t) => { state.t = clamp(t, begin, end); refresh(); };
  let clock = null;
  const tick = (ms) => {
    if (!state.playing) return;
    if (clock !== null) {
      let t = state.t + ((ms - clock) / 1000) * state.speed;
      if (t > end) { t = state.loop ? begin : end; }
      state.t = t;
      refresh();
    }
    clock = ms;
    requestAnimationFrame(tick);
  };
  const play = (on) => {
    if (on && state.t >= end) state.t = begin;
    state.playing = on;
    clock = null;
    if (on) requestAnimationFrame(tick); else remember();
    refresh();
  };
  // a speed at which the whole motion takes between 3 s and half a minute, a power of two
  const speeds = [1 / 64, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1, 2, 4, 8, 16, 64, 256, 1024];
  for (const s of speeds) ui.speed.add(new Option(s < 1 ? `1/${1 / s} ×` : `${s} ×`, s));
  const usual = speeds.reduce((best, s) => (Math.abs(Math.log((end - begin) / s / 8)) < Math.abs(Math.log((end - begin) / best / 8)) ? s : best), 1);
  state.speed = end - begin >= 3 && end - begin <= 30 ? 1 : usual;
  ui.speed.value = state.speed;
  const toggle = (name) => {
    options[name] = !options[name];
    ui[name].setAttribute("aria-pressed", options[name]);
    if (name === "follow") look(view);
    refresh();
  };
  ui.play.onclick = () => play(!state.playing);
  ui.slider.oninput = () => { state.playing = false; seek(begin + (ui.slider.value / 1000) * (end - begin)); remember(); };
  ui.speed.onchange = () => { state.speed = Number(ui.speed.value); };
  for (const name of ["trails", "grid", "labels", "loads", "reactions", "follow"]) { ui[name].setAttribute("aria-pressed", options[name]); ui[name].onclick = () => toggle(name); }
  ui.loads.hidden = loads.length === 0;
  ui.reactions.hidden = reactions.length === 0;
  ui.follow.hidden = !travels;
  ui.full.onclick = () => (document.fullscreenElement ? document.exitFullscreen() : root.requestFullscreen());
  for (const button of root.querySelectorAll("[data-view]")) button.onclick = () => { look(button.dataset.view); remember(); refresh(); };
  const stepBy = (n) => { state.playing = false; seek(times[clamp(index(state.t + 1e-9) + n, 0, last)]); remember(); };
  root.addEventListener("keydown", (event) => {
    if (event.target === ui.slider && event.key.startsWith("Arrow")) return;
    if (event.target === ui.speed) return;
    const many = event.shiftKey ? 10 : 1;
    const keys = {
      " ": () => play(!state.playing), ArrowRight: () => stepBy(many), ArrowLeft: () => stepBy(-many),
      Home: () => seek(begin), End: () => seek(end), t: () => toggle("trails"), g: () => toggle("grid"), n: () => toggle("labels"), f: () => toggle("follow"), l: () => toggle("loads"), r: () => toggle("reactions"),
      1: () => look("iso"), 2: () => look("front"), 3: () => look("side"), 4: () => look("top"),
      "+": () => { camera.distance *= 0.9; }, "-": () => { camera.distance /= 0.9; },
    };
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === " " && event.target.tagName === "BUTTON" && event.target !== ui.play) return;
    event.preventDefault();
    keys[event.key]();
    refresh();
  });
  const pointers = new Map();
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); pointers.set(event.pointerId, event); canvas.focus({ preventScroll: true }); });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
    if (pointers.size === 2) {
      const other = [...pointers.entries()].find(([id]) => id !== event.pointerId)[1];
      const gap = (e) => Math.hypot(e.clientX - other.clientX, e.clientY - other.clientY);
      camera.distance *= gap(before) / Math.max(1, gap(event));
    } else if (event.buttons === 2 || event.shiftKey) {
      const { x, y } = viewMatrix(), size = (2 * camera.distance * Math.tan(0.3)) / canvas.clientHeight;
      camera.target = add(camera.target, add(scale(x, -dx * size), scale(y, dy * size)));
    } else {
      camera.yaw -= 0.008 * dx;
      camera.pitch = clamp(camera.pitch + 0.008 * dy, -1.55, 1.55);
    }
    pointers.set(event.pointerId, event);
    refresh();
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && document.activeElement !== canvas) return; // the page scrolls
    event.preventDefault();
    camera.distance *= Math.exp(0.0012 * event.deltaY);
    refresh();
  }, { passive: false });

  // ---- charts with the same time -----------------------------------------------------------------------------
  // they stand below the scene, and are there when the page has been read
  document.addEventListener("DOMContentLoaded", () => {
    for (const svg of document.querySelectorAll("svg[data-plot]")) {
      const [left, right, top, bottom, first, final] = svg.dataset.plot.split(" ").map(Number);
      const cursor = document.createElementNS("http://www.w3.org/2000/svg", "line");
      cursor.setAttribute("class", "cursor");
      cursor.setAttribute("y1", top);
      cursor.setAttribute("y2", bottom);
      svg.append(cursor);
      watchers.push((t) => {
        const x = left + ((t - first) / (final - first)) * (right - left);
        cursor.setAttribute("x1", x);
        cursor.setAttribute("x2", x);
        cursor.style.display = x >= left - 1 && x <= right + 1 ? "" : "none";
      });
      svg.addEventListener("click", (event) => {
        const at = svg.createSVGPoint();
        [at.x, at.y] = [event.clientX, event.clientY];
        const x = at.matrixTransform(svg.getScreenCTM().inverse()).x;
        seek(first + ((x - left) / (right - left)) * (final - first));
        remember();
      });
    }
    refresh();
  });

  // ---- begin -------------------------------------------------------------------------------------------------
  const fragment = () => {
    const wanted = new URLSearchParams(location.hash.slice(1));
    look(presets[wanted.get("view")] ? wanted.get("view") : view);
    const t = Number.parseFloat(wanted.get("t"));
    seek(Number.isFinite(t) ? t : state.t);
    return Number.isFinite(t);
  };
  new ResizeObserver(refresh).observe(canvas);
  dark.addEventListener("change", refresh);
  window.addEventListener("hashchange", fragment);
  const asked = fragment();
  if (!asked && !matchMedia("(prefers-reduced-motion: reduce)").matches) play(true);
})();
