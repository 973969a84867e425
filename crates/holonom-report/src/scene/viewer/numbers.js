  // ---- numbers: vectors are arrays of 3, quaternions are [x, y, z, w], matrices are column-major Float32Arrays of 16 -------
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
  const product = (a, b) => {
    const v = add(add(scale([b[0], b[1], b[2]], a[3]), scale([a[0], a[1], a[2]], b[3])), cross(a, b));
    return [...v, a[3] * b[3] - dot(a, b)];
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
  const identity = frame([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]);
