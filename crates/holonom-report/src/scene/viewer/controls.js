  // ---- controls ----------------------------------------------------------------------------------------------
  const ui = Object.fromEntries(["play", "slider", "clock", "speed", "modes", "trails", "grid", "labels", "loads", "reactions", "follow", "full"].map((name) => [name, root.querySelector(`[data-${name}]`)]));
  const decimals = clamp(2 - Math.floor(Math.log10(Math.max((shownValue(end) - shownValue(begin)) / 100, 1e-12))) - 1, 0, 9);
  const watchers = [];
  const still = end === begin; // one configuration: nothing to play
  // of the parameter in a second at speed 1: a period of a mode takes 2 s, a load path 6 s
  const pace = { load: end / 6, mode: 0.5 }[data.parameter] ?? 1;
  const words = () => {
    if (path) return `load factor ${shownValue(state.t).toFixed(decimals)}`;
    if (!modes.length) return `t = ${state.t.toFixed(decimals)} s`;
    const { kind } = modes[state.mode];
    if (kind === "vibration") return `phase ${Math.round(360 * state.t)}°`;
    if (kind === "zero" || kind === "buckling") return `${Math.round(100 * factors(modes[state.mode], state.t)[0])} %`;
    return `t = ${(SPAN * (kind === "decay" ? state.t : state.t - 1)).toFixed(2)}/δ`;
  };
  const refresh = () => {
    ui.slider.value = end > begin ? ((state.t - begin) / (end - begin)) * 1000 : 0;
    ui.clock.textContent = words();
    ui.slider.setAttribute("aria-valuetext", ui.clock.textContent);
    ui.play.textContent = state.playing ? "❚❚" : "▶";
    ui.play.setAttribute("aria-label", state.playing ? "pause" : "play");
    paint();
    if (!state.playing) announce();
    watchers.forEach((watch) => watch(shownValue(state.t)));
  };
  // where a member is on the canvas, for those who read the page without seeing it: `name x y` in px
  const announce = () => {
    const { left, top } = canvas.getBoundingClientRect();
    Object.assign(canvas.dataset, { time: shownValue(state.t), view, left, top });
    if (modes.length) canvas.dataset.mode = state.mode + 1;
    canvas.dataset.members = data.members.map((m, k) => [m.name, ...pixel(now[k].c).map((x) => x.toFixed(1))].join(" ")).join("; ");
  };
  const remember = () => {
    const at = { time: () => `t=${state.t.toFixed(decimals)}&`, load: () => `t=${shownValue(state.t).toFixed(decimals)}&n=${state.t.toFixed(2)}&` };
    at.mode = () => `mode=${state.mode + 1}&${state.playing ? "" : `phase=${state.t.toFixed(3)}&`}`;
    if (location.protocol === "about:") return; // in a frame of a notebook
    history.replaceState(null, "", `#${(at[data.parameter] ?? (() => ""))()}view=${view}`);
  };
  const seek = (t) => { state.t = clamp(t, begin, end); refresh(); };
  let clock = null;
  const tick = (ms) => {
    if (!state.playing) return;
    if (clock !== null) {
      let t = state.t + ((ms - clock) / 1000) * state.speed * pace;
      if (t > end) { t = state.loop ? begin : end; }
      state.t = t;
      refresh();
    }
    clock = ms;
    requestAnimationFrame(tick);
  };
  const play = (on) => {
    if (still) return;
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
  state.speed = data.parameter !== "time" || (end - begin >= 3 && end - begin <= 30) ? 1 : usual;
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
  for (const name of ["play", "slider", "clock", "speed"]) ui[name].hidden = still;
  ui.trails.hidden = still;
  ui.loads.hidden = loads.length === 0;
  ui.reactions.hidden = reactions.length + tensions.length + contacts.values.length === 0;
  ui.follow.hidden = !travels;
  ui.full.onclick = () => (document.fullscreenElement ? document.exitFullscreen() : root.requestFullscreen());
  for (const button of root.querySelectorAll("[data-view]")) button.onclick = () => { look(button.dataset.view); remember(); refresh(); };
  // to a neighbouring instant or equilibrium; of a mode 1/24 of the period
  const stepBy = (n) => {
    state.playing = false;
    const { times } = motions[0], k = clamp(instant(motions[0], state.t + 1e-9).k + n, 0, final(motions[0]));
    seek(modes.length ? (((state.t + n / 24) % 1) + 1) % 1 : path ? k : times[k]);
    remember();
  };
  root.addEventListener("keydown", (event) => {
    if (event.target === ui.slider && event.key.startsWith("Arrow")) return;
    if (event.target.tagName === "SELECT") return;
    const many = event.shiftKey ? 10 : 1;
    const keys = {
      " ": () => play(!state.playing), ArrowRight: () => stepBy(many), ArrowLeft: () => stepBy(-many),
      Home: () => seek(begin), End: () => seek(end), t: () => toggle("trails"), g: () => toggle("grid"), n: () => toggle("labels"), f: () => toggle("follow"), l: () => toggle("loads"), r: () => toggle("reactions"),
      1: () => look("iso"), 2: () => look("front"), 3: () => look("side"), 4: () => look("top"),
      "+": () => { camera.distance *= 0.9; }, "-": () => { camera.distance /= 0.9; },
    };
    if (modes.length) Object.assign(keys, { ArrowUp: () => choose(state.mode - 1), ArrowDown: () => choose(state.mode + 1) });
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

