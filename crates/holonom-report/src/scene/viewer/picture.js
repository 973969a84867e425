  // ---- a picture ---------------------------------------------------------------------------------------------
  const tones = motions.map((_, k) => palette[k % palette.length]);
  const several = motions.length > 1;
  const shownMotions = () => motions.filter((motion) => motion.shown);
  // what an event released is gone from then on
  const holds = ({ until }) => until === undefined || state.t <= until;
  const everything = (k) => {
    data.bodies.forEach((body, i) => drawBody(body, i));
    beams.forEach((beam) => drawBeam(beam, k));
    data.points.forEach((member, i) => draw(meshes.sphere, along([0, 0, 1], now[member].c, [1.6 * symbol, 1.6 * symbol, 1.6 * symbol]), paintOf(data.bodies.length + i)));
    data.bars.filter(holds).forEach((bar) => stick(point(bar.from), point(bar.to), 0.4 * symbol, tone ?? theme().ink));
    data.bars.concat(data.springs).filter(holds).forEach(({ from, to }) => { drawFoot(from); drawFoot(to); });
    data.joints.filter(holds).forEach(drawJoint);
    // on the child, with the tip at the joint; one that is not unique is no number and not drawn
    if (options.reactions) reactions.forEach((reaction) => {
      const force = scale(reactionAt(reaction, k), (0.5 * size) / largestReaction);
      if (force.every(Number.isFinite)) arrow(point(reaction.end), force, palette[7]);
    });
    // a dot at each point of contact, filled where it sticks; the force on the second body has its tip there
    if (options.reactions) contactsAt(k).forEach(({ point: at, force, state }) => {
      const filled = state === 1 ? theme().back : state === 2 ? palette[3] : theme().ink, r = (state === 2 ? 2 : 1.1) * symbol;
      draw(meshes.sphere, along([0, 0, 1], at, [r, r, r]), filled);
      const length = state === 2 ? 0.4 * size : (0.4 * size * norm(force)) / largestContact;
      if (norm(force) > 0) arrow(at, scale(unit(force), length), state === 2 ? palette[3] : palette[7]);
    });
    // on what is held at either end, from there towards the other end under tension
    if (options.reactions) tensions.forEach(({ line, tensions: values }) => {
      const [a, b] = [point(line.from), point(line.to)], length = (0.5 * size * values[k]) / largestReaction;
      if (!Number.isFinite(length) || norm(sub(b, a)) === 0) return;
      const force = scale(unit(sub(b, a)), length);
      if (line.from.member >= 0) arrow(add(a, force), force, palette[7], 0.55);
      if (line.to.member >= 0) arrow(sub(b, force), scale(force, -1), palette[7], 0.55);
    });
    if (!options.loads) return;
    loads.forEach((load) => {
      const length = (0.5 * size * (load.factors[k] ?? 0)) / strongest;
      for (const end of load.ends) {
        const force = load.follower ? direction(end, load.force) : load.force;
        arrow(point(end), scale(force, length), palette[4]);
      }
    });
  };
  const STRIPE = 9; // px
  const labels = root.querySelector(".scene-labels");
  // lines on a plane go along with what is followed, by whole squares
  const beneath = ({ along, spacing }) => {
    if (!options.follow) return identity;
    const gone = sub(camera.target, middle), place = identity.slice();
    const way = along.map((e) => scale(e, spacing * Math.round(dot(gone, e) / spacing)));
    place.set(add(way[0], way[1]), 12);
    return place;
  };
  const paint = () => {
    const ratio = window.devicePixelRatio || 1, [w, h] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.max(1, Math.round(x * ratio)));
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    const moved = shownMotions();
    if (options.follow && moved.length) camera.target = centerOf(moved[0], instant(moved[0], state.t)); // before the view
    const colors = theme(), { matrix, eye, near, far } = viewMatrix();
    const behind = (0.02 * size * near * far) / (far - near);
    stage.begin({ width: w, height: h, ratio, back: colors.back, matrix, eye, up, behind, stripe: STRIPE * ratio });
    moved.forEach((motion, order) => {
      const k = place(motion);
      tone = several ? tones[motion.index] : null;
      stage.turn(order, moved.length);
      stage.shadeless(false);
      everything(k);
      stage.shadeless(true);
      data.springs.filter(holds).forEach(drawSpring);
      if (options.trails) drawTrails(motion, k);
      if (options.trails && (path || modes.length)) drawShapes(motion);
    });
    stage.turn(0, 1);
    if (options.grid && camera.pitch > -0.05) {
      [grid, ...planes].forEach((plane) => draw(plane.mesh, beneath(plane), colors.grid, { lines: "pairs" }));
      if (data.grounded) stage.shadows(squash, colors.shadow, () => moved.forEach((motion) => everything(place(motion))));
    }
    stage.shadeless(false);
    if (data.bodies.some((body) => body.opacity < 1)) stage.glass(() => moved.forEach((motion) => {
      place(motion);
      tone = several ? tones[motion.index] : null;
      data.bodies.forEach((body, i) => drawBody(body, i, true));
    }));
    stage.end();
    tone = null;
    place(moved[0] ?? motions[0]); // names stand at the first one
    labels.textContent = "";
    if (options.labels) {
      const named = data.bodies.filter((b) => b.visible).map((b) => [b.name, b.member]).concat(data.points.map((m) => [data.members[m].name, m]));
      for (const [name, member] of named) {
        const tag = document.createElement("span"), [x, y] = pixel(now[member].c);
        tag.textContent = name;
        tag.style.transform = `translate(${x}px, ${y}px)`;
        labels.append(tag);
      }
    }
  };
