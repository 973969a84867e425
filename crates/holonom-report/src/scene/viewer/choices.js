
  // ---- which mode, which motions -------------------------------------------------------------------------------
  const note = root.querySelector(".scene-words");
  const rows = () => [...document.querySelectorAll("tr[data-mode]")]; // of the table below
  const mark = () => {
    ui.modes.value = state.mode;
    note.textContent = modes[state.mode].words;
    rows().forEach((row, i) => (i === state.mode ? row.setAttribute("aria-current", "true") : row.removeAttribute("aria-current")));
  };
  const choose = (k) => {
    state.mode = clamp(k, 0, modes.length - 1);
    state.t = modes[state.mode].kind === "unstable" ? end : begin; // where it is largest
    mark();
    remember();
    refresh();
  };
  if (modes.length) {
    modes.forEach((mode, k) => ui.modes.add(new Option(mode.name, k)));
    ui.modes.onchange = () => choose(Number(ui.modes.value));
  }
  ui.modes.hidden = modes.length === 0;
  // one button for each motion, in its colour, that shows and hides it
  if (several) {
    const legend = root.querySelector(".scene-legend");
    motions.forEach((motion, k) => {
      const button = document.createElement("button"), sample = document.createElement("i");
      sample.style.background = `rgb(${data.palette[k % data.palette.length]})`;
      button.append(sample, motion.name);
      button.setAttribute("aria-pressed", motion.shown);
      button.onclick = () => {
        motion.shown = !motion.shown;
        button.setAttribute("aria-pressed", motion.shown);
        refresh();
      };
      legend.append(button);
    });
  }
