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
  const tensions = data.tensions.map((tension) => ({ ...tension, tensions: floats(tension.tensions) }));
  const largest = (size) => motions[0].times.reduce((all, _, k) => Math.max(all, size(k) || 0), 0);
  const largestReaction = Math.max(...reactions.map((r) => largest((k) => norm(reactionAt(r, k)))), ...tensions.map((t) => largest((k) => Math.abs(t.tensions[k]))), 1e-300);
  // point, force, state of each contact; impacts have forces of another size
  const contacts = { starts: data.contacts.starts, values: floats(data.contacts.values) };
  const contactsAt = (k) => {
    const found = [];
    for (let i = contacts.starts[k] ?? 0; i < (contacts.starts[k + 1] ?? 0); i += 1) {
      const own = [...contacts.values.subarray(7 * i, 7 * i + 7)];
      found.push({ point: own.slice(0, 3), force: own.slice(3, 6), state: own[6] });
    }
    return found;
  };
  const largestContact = Math.max(largest((k) => Math.max(0, ...contactsAt(k).filter((c) => c.state < 2).map((c) => norm(c.force)))), 1e-300);
  const options = { trails: path || modes.length > 0, grid: true, loads: true, reactions: true, labels: false, follow: travels };
  let tone = null; // the colour of everything that moves, where several motions are shown
  const paintOf = (k) => tone ?? palette[k % palette.length];
  const axes = ({ c, q }, [x, y, z], offset = [0, 0, 0]) => frame(
    scale(rotate(q, [1, 0, 0]), x), scale(rotate(q, [0, 1, 0]), y), scale(rotate(q, [0, 0, 1]), z), add(c, rotate(q, offset)));
  const stick = (a, b, thickness, color, options) => {
    const d = sub(b, a), length = norm(d);
    if (length > 0) draw(meshes.cylinder, along(d, lerp(a, b, 0.5), [thickness, thickness, length]), color, options);
  };
  const arrow = (tip, d, color, thick = 0.35) => {
    const length = norm(d), head = Math.min(0.35 * length, 5 * symbol);
    if (length < 1e-3 * size) return;
    const neck = sub(tip, scale(unit(d), head));
    stick(sub(tip, d), neck, thick * symbol, color);
    draw(meshes.cone, along(scale(d, -1), neck, [symbol, symbol, head]), color);
  };
  // symbols are smaller on small bodies, which they would cover
  const fitted = ({ limit }) => Math.min(symbol, limit);
  const drawBody = (body, k, seeThrough = false) => {
    if (!body.visible || seeThrough !== body.opacity < 1) return;
    const at = now[body.member], options = { opacity: body.opacity }, small = fitted(body);
    const own = { c: at.c, q: product(at.q, body.rotation) };
    const color = tone ?? (body.color ? body.color.map((c) => c / 255) : body.fixed ? theme().grid : paintOf(k));
    const [a, b, c] = body.dimensions;
    switch (body.shape) {
      case "mesh": draw(surfaces[body.mesh], axes(own, [1, 1, 1]), color, options); break;
      case "box": draw(meshes.box, axes(own, [a, b, c]), color, options); break;
      case "cylinder": draw(meshes.cylinder, axes(own, [a, a, b]), color, options); break;
      case "rod": draw(meshes.cylinder, axes(own, [b, b, a]), color, options); break;
      case "sphere": draw(meshes.sphere, axes(own, [a, a, a]), color, options); break;
      case "cone": draw(meshes.cone, axes(own, [a, a, b], [0, 0, b / 4]), color, options); break;
      default: // the links to its joints; else the ellipsoid of inertia
        if (body.link) draw(meshes.sphere, axes(at, [1.6 * small, 1.6 * small, 1.6 * small]), color, options);
        else draw(meshes.sphere, axes(at, body.dimensions), color, options);
    }
    for (const anchor of body.anchors) stick(at.c, add(at.c, rotate(at.q, anchor)), (body.link ? 0.8 : 0.35) * small, color, options);
  };
  const drawJoint = (joint) => {
    const [a, b] = [point(joint.parent), point(joint.child)];
    const axis = joint.axis ? direction(joint.parent, joint.axis) : up;
    const color = tone ?? theme().ink, s = fitted(joint);
    if (norm(sub(b, a)) > 0.5 * s) stick(a, b, 0.3 * s, color);
    for (const { solid, across, along: length, second, on_parent } of data.symbols[joint.type]) {
      const d = second ? direction(joint.child, joint.axis2 || [1, 0, 0]) : axis;
      draw(meshes[solid], along(d, on_parent ? a : b, [across * s, across * s, length * s]), color);
    }
  };
  // where a line ends on the ground
  const drawFoot = (end) => {
    const s = symbol;
    if (end.member < 0) draw(meshes.box, along(up, point(end), [3 * s, 3 * s, 0.9 * s]), tone ?? theme().ink);
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
    upload(coil, v, null, true);
    draw(coil, identity, tone ?? theme().ink, { lines: "strip" });
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
          const tint = tone ? tone : beam.values ? heat(clamp(lerpValue(beam, k, node - beam.first + i, s), 0, 1)) : beam.color;
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
    upload(beam.mesh, v, f, true);
    draw(beam.mesh, identity, beam.color, { tinted: true });
  };
  // the measure of a beam at an instant and an interval between nodes, over its largest value
  const lerpValue = (beam, k, interval, s) => {
    const per = beam.intervals, at = k * per;
    const here = beam.values[at + clamp(interval, 0, per - 1)], next = beam.values[at + clamp(interval + 1, 0, per - 1)];
    return (here * (1 - s) + next * s) / (beam.largest || 1);
  };
  const line = {};
  const polyline = (places, color) => {
    upload(line, places.flatMap((x) => [...x, 0, 0, 0, 1, 1, 1]), null, true);
    draw(line, identity, color, { lines: "strip" });
  };
  // the ways of bodies and point masses up to now
  const drawTrails = (motion, k) => {
    const moving = data.bodies.filter((b) => !b.fixed && b.visible).map((b) => b.member).concat(data.points);
    moving.slice(0, 40).forEach((member, i) => {
      const way = Array.from({ length: k + 1 }, (_, n) => centre(motion, member, n));
      polyline([...way, now[member].c], paintOf(i));
    });
  };
  // centre lines of beams at some equilibria of a path; the configuration that modes are about
  const SHAPES = 9;
  const drawShapes = (motion) => {
    const count = Math.min(SHAPES, final(motion) + 1), color = lerp(theme().ink, theme().back, 0.4);
    for (let i = 0; i < count; i++) for (const beam of beams) {
      const k = Math.round((i * final(motion)) / Math.max(1, count - 1));
      let node = beam.first;
      for (const nodes of beam.legs) {
        polyline(Array.from({ length: nodes }, (_, n) => centre(motion, node + n, k)), color);
        node += nodes;
      }
    }
    if (modes.length) for (const member of data.bodies.map((b) => b.member).concat(data.points)) polyline([centre(motion, member, 0), now[member].c], color);
  };
  // lines on a plane
  const squares = (foot, normal, spacing, count) => {
    const e1 = unit(cross(Math.abs(normal[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], normal)), e2 = cross(normal, e1), v = [];
    const corner = (i, j) => v.push(...add(foot, add(scale(e1, i * spacing), scale(e2, j * spacing))), 0, 0, 0, 1, 1, 1);
    for (let i = -count; i <= count; i++) { corner(i, -count); corner(i, count); corner(-count, i); corner(count, i); }
    return { mesh: upload({}, v, null), along: [e1, e2], spacing };
  };
  const grid = (() => {
    const spacing = 10 ** Math.floor(Math.log10(radius)), count = Math.ceil((2.2 * radius) / spacing);
    const foot = add(middle, scale(up, level - dot(middle, up) - 1e-3 * radius));
    return squares(foot, up, spacing, count);
  })();
  // planes on which something rolls, about the middle of the picture
  const planes = data.planes.filter((plane) => plane !== rolledOn).map(({ position, normal }) => {
    const n = unit(normal), off = dot(sub(position, middle), n);
    return squares(add(middle, scale(n, off)), n, radius / 6, 6);
  });
  // the projection along `up` onto the ground
  const squash = new Float32Array(16);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) {
    squash[4 * c + r] = (r === c ? 1 : 0) - (c < 3 && r < 3 ? up[r] * up[c] : 0) + (c === 3 && r < 3 ? up[r] * (level - 5e-4 * radius) : 0);
  }
