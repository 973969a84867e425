  // ---- meshes ------------------------------------------------------------------------------------------------
  // surface of revolution about the third axis: [radius, height, slope of the normal] along the profile
  const lathe = (profile, sides = stage.fine ? 36 : 12) => {
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
  const meridian = Array.from({ length: stage.fine ? 19 : 9 }, (_, i, rings = stage.fine ? 18 : 8) => -Math.PI / 2 + (Math.PI * i) / rings);
  const meshes = {
    box: cube(),                                                                    // edges of length 1
    cylinder: lathe([[0, -0.5, 0, -1], [1, -0.5, 0, -1], [1, -0.5, 1, 0], [1, 0.5, 1, 0], [1, 0.5, 0, 1], [0, 0.5, 0, 1]]),
    cone: lathe([[0, 0, 0, 1], [1, 0, 0, 1], [1, 0, 1, -1], [0, -1, 1, -1]]),       // base at 0, tip at −1
    sphere: lathe(meridian.map((a) => [Math.cos(a), Math.sin(a), Math.cos(a), Math.sin(a)])),
  };
