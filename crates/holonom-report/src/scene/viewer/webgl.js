  // ---- WebGL: a stage on which meshes are drawn -----------------------------------------------------------------
  // begin, then draw in any number of turns, then shadows and glass, then end
  const webgl = (gl) => {
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
    const upload = (mesh, vertices, indices, moving = false) => {
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
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(vertices), moving ? gl.DYNAMIC_DRAW : gl.STATIC_DRAW);
      mesh.length = vertices.length / 9;
      if (indices) {
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(indices), moving ? gl.DYNAMIC_DRAW : gl.STATIC_DRAW);
        mesh.count = indices.length;
      }
      return mesh;
    };
    const draw = (mesh, model, color, { tinted = false, lines = null, opacity = 1 } = {}) => {
      gl.bindVertexArray(mesh.array);
      gl.uniformMatrix4fv(uniform.model, false, model);
      gl.uniform4f(uniform.color, ...color, opacity);
      gl.uniform1i(uniform.tinted, tinted ? 1 : 0);
      if (lines) gl.drawArrays(lines === "strip" ? gl.LINE_STRIP : gl.LINES, 0, mesh.length);
      else gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
    };
    const begin = ({ width, height, back, matrix, eye, up, behind, stripe }) => {
      gl.viewport(0, 0, width, height);
      gl.clearColor(...back, 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      gl.uniformMatrix4fv(uniform.view, false, matrix);
      gl.uniform3f(uniform.eye, ...eye);
      gl.uniform3f(uniform.up, ...up);
      gl.uniformMatrix4fv(uniform.squash, false, identity);
      gl.uniform1f(uniform.behind, behind);
      gl.uniform1f(uniform.stripe, stripe);
    };
    // surfaces that coincide show the colours of all motions in stripes
    const turn = (order, count) => gl.uniform2i(uniform.turn, order, count);
    const shadeless = (on) => gl.uniform1i(uniform.shadeless, on ? 1 : 0);
    // every pixel of the ground once
    const shadows = (squash, strength, paint) => {
      gl.enable(gl.STENCIL_TEST);
      gl.stencilFunc(gl.EQUAL, 0, 255);
      gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ZERO, gl.CONSTANT_COLOR);
      const d = 1 - strength;
      gl.blendColor(d, d, d, 1);
      gl.depthMask(false);
      gl.uniformMatrix4fv(uniform.squash, false, squash);
      paint();
      gl.uniformMatrix4fv(uniform.squash, false, identity);
      gl.depthMask(true);
      gl.disable(gl.BLEND);
      gl.disable(gl.STENCIL_TEST);
    };
    // what lets see through
    const glass = (paint) => {
      gl.enable(gl.BLEND);
      gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE); // the canvas itself covers the page
      gl.depthMask(false);
      paint();
      gl.depthMask(true);
      gl.disable(gl.BLEND);
    };
    return { fine: true, upload, draw, begin, turn, shadeless, shadows, glass, end: () => {} };
  };
