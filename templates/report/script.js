"use strict";
// Swaps the drawing of the chosen drone in, from the list or from a cell of the fleet; the page works
// without, showing the first, and the cells then lead to the files.
for (const gallery of document.querySelectorAll(".gallery")) {
  const select = gallery.querySelector("select");
  if (!select) continue; // one drone: nothing to choose
  const figure = gallery.querySelector("figure");
  const drawing = figure.querySelector(".drawing");
  const title = figure.querySelector("figcaption b");
  const link = figure.querySelector("figcaption a");
  const first = select.value;
  const kept = drawing.firstElementChild;
  const show = () => {
    const template = [...gallery.querySelectorAll("template")].find((t) => t.dataset.name === select.value);
    if (template) drawing.replaceChildren(template.content.cloneNode(true));
    else if (select.value === first) drawing.replaceChildren(kept);
    const label = drawing.querySelector("title");
    title.textContent = "Figure " + select.value.replace(/^fig(?=\d)/, "") + ". " + (label ? label.textContent : "") + ".";
    drawing.setAttribute("aria-label", label ? label.textContent : "");
    link.textContent = select.value + ".svg";
    link.href = "figures/" + link.textContent;
  };
  select.addEventListener("change", show);
  const fleet = gallery.closest("section").querySelector("svg a[data-drone]")?.closest("svg");
  fleet?.addEventListener("click", (event) => {
    const cell = event.target.closest("a[data-drone]");
    if (!cell || ![...select.options].some((option) => option.value === cell.dataset.drone)) return;
    event.preventDefault();
    select.value = cell.dataset.drone;
    show();
    fleet.querySelector("a.chosen")?.classList.remove("chosen");
    cell.classList.add("chosen");
    gallery.scrollIntoView({ block: "start" });
    gallery.focus({ preventScroll: true });
  });
  for (const button of gallery.querySelectorAll("button")) {
    button.addEventListener("click", () => {
      const count = select.options.length;
      select.selectedIndex = (select.selectedIndex + Number(button.dataset.step) + count) % count;
      show();
    });
  }
}
