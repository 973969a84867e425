  // ---- charts with the same time -----------------------------------------------------------------------------
  // they stand below the scene, and are there when the page has been read
  document.addEventListener("DOMContentLoaded", () => {
    for (const svg of document.querySelectorAll("svg[data-plot], svg[data-rise]")) {
      const rises = svg.dataset.plot === undefined; // the value is on the vertical axis
      const [left, right, top, bottom, first, last] = (svg.dataset.plot ?? svg.dataset.rise).split(" ").map(Number);
      const [from, to] = rises ? [bottom, top] : [left, right];
      const cursor = document.createElementNS("http://www.w3.org/2000/svg", "line");
      cursor.setAttribute("class", "cursor");
      const fixed = rises ? { x1: left, x2: right } : { y1: top, y2: bottom };
      for (const [name, value] of Object.entries(fixed)) cursor.setAttribute(name, value);
      svg.append(cursor);
      watchers.push((value) => {
        const x = from + ((value - first) / (last - first)) * (to - from);
        for (const name of rises ? ["y1", "y2"] : ["x1", "x2"]) cursor.setAttribute(name, x);
        cursor.style.display = x >= Math.min(from, to) - 1 && x <= Math.max(from, to) + 1 ? "" : "none";
      });
      svg.addEventListener("click", (event) => {
        const at = svg.createSVGPoint();
        [at.x, at.y] = [event.clientX, event.clientY];
        const { x, y } = at.matrixTransform(svg.getScreenCTM().inverse());
        seek(parameterAt(first + (((rises ? y : x) - from) / (to - from)) * (last - first), state.t));
        remember();
      });
    }
    rows().forEach((row, k) => { row.onclick = () => choose(k); });
    rows().forEach((row) => row.addEventListener("keydown", (event) => {
      const by = { ArrowUp: -1, ArrowDown: 1 }[event.key];
      if (!by) return;
      event.preventDefault();
      choose(state.mode + by);
      rows()[state.mode].querySelector("button").focus();
    }));
    if (modes.length) mark();
    refresh();
  });

