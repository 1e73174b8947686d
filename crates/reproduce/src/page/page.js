"use strict";
// The source lies over one of the others; a slider moves the line between them.
for (const comparison of document.querySelectorAll(".comparison")) {
  const wipe = comparison.querySelector(".wipe");
  if (!wipe) continue;
  const [source, ...others] = comparison.querySelectorAll("img.picture");
  const stage = wipe.querySelector(".stage");
  const range = stage.querySelector("input");
  const above = source.cloneNode();
  const below = others[0].cloneNode();
  above.className = "above";
  below.className = "below";
  // A screen reader has them side by side, where they are named.
  above.alt = below.alt = "";
  stage.prepend(below, above);

  let other = others[0];
  const show = () => {
    stage.style.setProperty("--at", range.value + "%");
    range.setAttribute("aria-valuetext", `${range.value} % ${source.dataset.title}, ${100 - range.value} % ${other.dataset.title}`);
  };
  range.addEventListener("input", show);
  wipe.querySelector("fieldset").addEventListener("change", (event) => {
    other = others[Number(event.target.value)];
    below.src = other.src;
    stage.querySelector(".right").textContent = other.dataset.title;
    show();
  });
  wipe.hidden = false;
  show();
}
