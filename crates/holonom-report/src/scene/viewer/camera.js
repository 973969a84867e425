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
    return { matrix: multiply(projection, world), eye, x, y, near, far };
  };
  // pixel of a point in space, from the upper left corner of the canvas
  const pixel = (x) => {
    const m = viewMatrix().matrix, at = (r) => m[r] * x[0] + m[4 + r] * x[1] + m[8 + r] * x[2] + m[12 + r];
    const w = at(3);
    return [0.5 * (1 + at(0) / w) * canvas.clientWidth, 0.5 * (1 - at(1) / w) * canvas.clientHeight];
  };
