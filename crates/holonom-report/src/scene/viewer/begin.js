
  // ---- begin -------------------------------------------------------------------------------------------------
  // what the fragment of the address asks for; whether it names an instant
  const fragment = () => {
    const wanted = new URLSearchParams(location.hash.slice(1));
    const number = (name) => Number.parseFloat(wanted.get(name));
    look(presets[wanted.get("view")] ? wanted.get("view") : view);
    if (modes.length && number("mode") >= 1) state.mode = clamp(Math.floor(number("mode")) - 1, 0, modes.length - 1);
    const named = Number.isFinite(number("t")) ? parameterAt(number("t"), state.t) : NaN;
    const asked = modes.length ? number("phase") : path && Number.isFinite(number("n")) ? number("n") : named;
    seek(Number.isFinite(asked) ? asked : state.t);
    return Number.isFinite(asked);
  };
  new ResizeObserver(refresh).observe(canvas);
  dark.addEventListener("change", refresh);
  window.addEventListener("hashchange", () => {
    if (!location.hash.includes("=")) return; // a section of the page
    fragment();
    if (modes.length) mark();
  });
  const asked = fragment();
  if (!asked && !matchMedia("(prefers-reduced-motion: reduce)").matches) play(true);
