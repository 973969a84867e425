  // ---- the motion: where members are at a value s of the parameter ---------------------------------------------
  // data.parameter  "time": s is the time, s
  //                 "load": s counts the equilibria of a load path, which may come back to a load factor
  //                 "mode": s from 0 to 1 is a period of the chosen mode, or its growth or decay
  //                 "none": one configuration
  const path = data.parameter === "load";
  const motions = data.motions.map((m, k) => ({ ...m, index: k, times: floats(m.times), poses: floats(m.poses) }));
  const modes = data.modes.map((mode) => ({ ...mode, shape: floats(mode.shape) }));
  const stride = data.members.reduce((sum, m) => sum + (m.frame ? 7 : 3), 0);
  const offsets = [];
  data.members.reduce((at, m) => { offsets.push(at); return at + (m.frame ? 7 : 3); }, 0);
  const final = (motion) => motion.times.length - 1;
  const begin = path || modes.length ? 0 : motions[0].times[0];
  const end = modes.length ? 1 : path ? final(motions[0]) : Math.max(...motions.map((m) => m.times[final(m)]));
  // the last instant at or before s, and the part of the way to the next one
  const instant = (motion, s) => {
    const { times } = motion, last = final(motion);
    if (modes.length) return { k: 0, part: 0 };
    if (path) { const k = clamp(Math.floor(s), 0, last); return { k, part: k < last ? clamp(s - k, 0, 1) : 0 }; }
    let [low, high] = [0, last];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= s) low = middle; else high = middle;
    }
    const span = times[Math.min(low + 1, last)] - times[low];
    return { k: low, part: span > 0 ? clamp((s - times[low]) / span, 0, 1) : 0 };
  };
  // what charts have on their axis: the time, or the load factor
  const shownValue = (s) => {
    if (!path) return s;
    const { k, part } = instant(motions[0], s), { times } = motions[0];
    return times[k] * (1 - part) + times[Math.min(k + 1, final(motions[0]))] * part;
  };
  // the parameter at a time or load factor; on a path that of the nearest equilibria with this factor
  const parameterAt = (value, near) => {
    if (!path) return value;
    const { times } = motions[0], found = [];
    for (let k = 0; k < final(motions[0]); k++) {
      const [a, b] = [times[k], times[k + 1]];
      if ((a - value) * (b - value) <= 0) found.push(k + (a === b ? 0 : (value - a) / (b - a)));
    }
    if (found.length === 0) return value > times[0] ? end : begin;
    return found.reduce((best, s) => (Math.abs(s - near) < Math.abs(best - near) ? s : best));
  };
  const centre = (motion, member, k) => { const i = offsets[member] + stride * k; return [...motion.poses.subarray(i, i + 3)]; };
  const turn = (motion, member, k) => { const i = offsets[member] + stride * k; return [...motion.poses.subarray(i + 3, i + 7)]; };
  // { c, q } of a member; between instants positions are linear
  const pose = (motion, member, { k, part }) => {
    const next = Math.min(k + 1, final(motion));
    const c = lerp(centre(motion, member, k), centre(motion, member, next), part);
    if (!data.members[member].frame) return { c, q: [0, 0, 0, 1] };
    return { c, q: nlerp(turn(motion, member, k), turn(motion, member, next), part) };
  };

  // ---- modes: (u cos φ − u' sin φ) e^{±δt} about the configuration ----------------------------------------------
  const LARGEST = 0.15; // displacement, as a part of the size of the configuration
  const SPAN = 4;       // growth and decay are shown over so many times 1/δ
  const CYCLES = 3;     // periods in it, where they also vibrate
  const part = (mode, member, k) => [...mode.shape.subarray(12 * member + 3 * k, 12 * member + 3 * k + 3)];
  // factors of u and of u'
  const factors = (mode, s) => {
    const envelope = { decay: Math.exp(-SPAN * s), unstable: Math.exp(SPAN * (s - 1)) }[mode.kind] ?? 1;
    const cycles = mode.kind === "unstable" || mode.kind === "decay" ? (mode.vibrates ? CYCLES : 0) : 1;
    const angle = 2 * Math.PI * cycles * s;
    return [envelope * Math.cos(angle), mode.kind === "zero" || mode.kind === "buckling" ? 0 : -envelope * Math.sin(angle)];
  };
  // the tangent of the angle is proportional to the displacement, as it is along the axis of a beam
  const displaced = (mode, member, { c, q }, [now, before]) => {
    const of = (k) => scale(add(scale(part(mode, member, k), now), scale(part(mode, member, k + 2), before)), mode.amplitude);
    const rotation = of(1), size = norm(rotation), angle = Math.atan(size) / 2;
    const about = size > 0 ? [...scale(rotation, Math.sin(angle) / size), Math.cos(angle)] : [0, 0, 0, 1];
    return { c: add(c, of(0)), q: product(about, q) };
  };

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
  for (const body of data.bodies) reach[body.member] = body.visible ? body.reach : 0;
  // what is hidden takes no room, unless everything is
  const hidden = new Set(data.bodies.filter((b) => !b.visible).map((b) => b.member));
  const counts = (m) => !hidden.has(m) || hidden.size === data.members.length;
  const configuration = extent(); // at the first instant
  data.members.forEach((_, m) => counts(m) && grow(configuration, centre(motions[0], m, 0), reach[m]));
  data.fixed.forEach((end) => grow(configuration, end, 0));
  for (const mode of modes) {
    const largest = (k) => Math.max(0, ...data.members.map((_, m) => Math.hypot(norm(part(mode, m, k)), norm(part(mode, m, k + 2)))));
    mode.amplitude = largest(0) > 0 ? (LARGEST * 2 * half(configuration)) / largest(0) : 0.5 / (largest(1) || 1);
  }
  // the centre of all members
  const centerOf = (motion, at) => data.members.reduce((sum, _, m) => add(sum, scale(pose(motion, m, at).c, 1 / data.members.length)), [0, 0, 0]);
  const whole = extent();
  let momentary = extent(); // the largest of an instant
  const seen = []; // points of the motion that the camera must see: place, place from the centre, reach
  const see = (places, c) => {
    const box = extent();
    places.forEach((x, m) => {
      if (!counts(m)) return;
      grow(box, x, reach[m]);
      grow(whole, x, reach[m]);
      seen.push([x, sub(x, c), reach[m]]);
    });
    if (half(box) > half(momentary) || !Number.isFinite(half(momentary))) momentary = box;
  };
  for (const motion of motions) {
    const last = final(motion), every = Math.max(1, last >> 8, Math.floor((last * data.members.length) / 20000));
    for (let k = 0; k <= last; k += every) see(data.members.map((_, m) => centre(motion, m, k)), centerOf(motion, { k, part: 0 }));
  }
  for (const mode of modes) for (const f of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    see(data.members.map((_, m) => displaced(mode, m, pose(motions[0], m, { k: 0, part: 0 }), f).c), centerOf(motions[0], { k: 0, part: 0 }));
  }
  for (const end of data.fixed) { grow(whole, end, 0); seen.push([end, [0, 0, 0], 0]); }
  if (!Number.isFinite(whole.low[0])) [whole.low, whole.high] = [[-1, -1, -1], [1, 1, 1]];
  const { low, high } = whole;
  const middle = lerp(low, high, 0.5);
  const radius = Math.max(1e-6, half(whole));
  // free systems that travel far: the camera goes with them
  const travels = data.fixed.length === 0 && !data.bodies.some((b) => b.fixed) && radius > 2.5 * half(momentary);
  const up = data.up;
  // a plane on which something rolls is the ground where it is level
  const rolledOn = data.planes.find(({ normal }) => dot(unit(normal), up) > 1 - 1e-9);
  const level = rolledOn ? dot(rolledOn.position, up) : Math.min(...[low, high].flatMap((a) => [low, high].flatMap((b) => [low, high].map((c) => dot([a[0], b[1], c[2]], up)))));

  // ---- where everything is now ---------------------------------------------------------------------------------
  // modes begin with the first that is not without stiffness
  const first = Math.max(0, modes.findIndex((mode) => mode.kind !== "zero"));
  const state = { t: begin, mode: first, playing: false, speed: 1, loop: true };
  let now = []; // { c, q } of each member of the motion that is drawn
  // places the members of a motion; its last instant before
  const place = (motion) => {
    const at = instant(motion, state.t);
    now = data.members.map((_, member) => pose(motion, member, at));
    if (modes.length) {
      const mode = modes[state.mode], f = factors(mode, state.t);
      now = now.map((own, member) => displaced(mode, member, own, f));
    }
    return at.k;
  };
  const ground = { c: [0, 0, 0], q: [0, 0, 0, 1] };
  const holder = (end) => (end.member < 0 ? ground : now[end.member]);
  const point = (end) => { const h = holder(end); return add(h.c, rotate(h.q, end.point)); };
  const direction = (end, v) => rotate(holder(end).q, v);
