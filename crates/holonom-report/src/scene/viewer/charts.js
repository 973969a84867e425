  // ---- charts with the same time -----------------------------------------------------------------------------
  // they stand below the scene, and are there when the page has been read
  const shape = (svg, tag, attributes) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    svg.append(element);
    return element;
  };
  // on a load path, which may come back to a load factor: a mark on the curve of each member at its displacement
  const markMembers = (svg, height) => {
    const [left, right, , , first, last] = svg.dataset.across.split(" ").map(Number);
    for (const name of svg.dataset.curves.split("\n")) {
      const member = data.members.findIndex((m) => m.name === name);
      if (member < 0) continue;
      const mark = shape(svg, "circle", { class: "cursor-mark", r: 5 });
      watchers.push((value) => {
        const way = norm(sub(pose(motions[0], member, instant(motions[0], state.t)).c, centre(motions[0], member, 0)));
        mark.setAttribute("cx", left + ((way - first) / (last - first)) * (right - left));
        mark.setAttribute("cy", height(value));
      });
    }
  };
  document.addEventListener("DOMContentLoaded", () => {
    for (const svg of document.querySelectorAll("svg[data-plot], svg[data-rise]")) {
      const rises = svg.dataset.plot === undefined; // the value is on the vertical axis
      const [left, right, top, bottom, first, last] = (svg.dataset.plot ?? svg.dataset.rise).split(" ").map(Number);
      const [from, to] = rises ? [bottom, top] : [left, right];
      const cursor = shape(svg, "line", { class: "cursor", ...(rises ? { x1: left, x2: right } : { y1: top, y2: bottom }) });
      const placed = (value) => from + ((value - first) / (last - first)) * (to - from);
      if (rises) markMembers(svg, placed);
      watchers.push((value) => {
        const x = placed(value);
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

