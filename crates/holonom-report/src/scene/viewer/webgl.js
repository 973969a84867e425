  // ---- WebGL -------------------------------------------------------------------------------------------------
  const gl = canvas.getContext("webgl2", { antialias: true, stencil: true, preserveDrawingBuffer: true });
  if (!gl) { say("This browser offers no WebGL 2: the motion cannot be shown here. The numbers are below."); return; }
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
    uniform vec4 color; uniform vec3 eye, up; uniform bool tinted; uniform ivec2 turn; uniform float behind, stripe;
    out vec4 fragment;
    void main() {
      // a motion that has not its turn in this stripe lies a little deeper
      bool last = turn.y > 1 && int((gl_FragCoord.x + gl_FragCoord.y) / stripe) % turn.y != turn.x;
      gl_FragDepth = gl_FragCoord.z + (last ? behind * gl_FragCoord.w * gl_FragCoord.w : 0.0);
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
  for (const name of ["model", "view", "shadeless", "squash", "color", "eye", "up", "tinted", "turn", "behind", "stripe"]) uniform[name] = gl.getUniformLocation(program, name);

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
