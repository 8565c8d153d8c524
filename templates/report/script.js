"use strict";
// Swaps the drawing of the chosen drone in; the page works without, showing the first.
for (const gallery of document.querySelectorAll(".gallery")) {
  const select = gallery.querySelector("select");
  if (!select) continue;
  const figure = gallery.querySelector("figure");
  const drawing = figure.querySelector(".drawing");
  const title = figure.querySelector("figcaption b");
  const link = figure.querySelector("figcaption a");
  const first = select.value;
  const kept = drawing.firstElementChild;
  const number = title.textContent.split(".")[0];
  const show = () => {
    const template = [...gallery.querySelectorAll("template")].find((t) => t.dataset.name === select.value);
    if (template) drawing.replaceChildren(template.content.cloneNode(true));
    else if (select.value === first) drawing.replaceChildren(kept);
    const label = drawing.querySelector("title");
    title.textContent = number + ". " + (label ? label.textContent : "") + ".";
    link.href = "figures/" + select.value + ".svg";
  };
  select.addEventListener("change", show);
  for (const button of gallery.querySelectorAll("button")) {
    button.addEventListener("click", () => {
      const count = select.options.length;
      select.selectedIndex = (select.selectedIndex + Number(button.dataset.step) + count) % count;
      show();
    });
  }
}
