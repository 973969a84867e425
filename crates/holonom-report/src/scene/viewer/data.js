  // ---- the page ------------------------------------------------------------------------------------------------
  const data = JSON.parse(document.getElementById("scene-data").textContent); // of scene/mod.rs
  const root = document.getElementById("scene");
  const canvas = root.querySelector("canvas");
  const say = (text) => { root.querySelector(".scene-note").textContent = text; };

