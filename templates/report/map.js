// Picking in drawings and lists: cells of the map and of the fleet, the list of drones, the gallery of Figure 3.
{
  const lists = [...document.querySelectorAll("select.pick")];
  const galleries = [...document.querySelectorAll(".gallery select")];
  const cells = [...document.querySelectorAll(".drawing [data-pick]")];
  const pickOf = (gallery) => gallery.selectedOptions[0]?.dataset.pick;
  document.addEventListener("updraft:pick", ({ detail }) => {
    for (const list of lists) list.value = [...list.options].some((one) => one.value === detail.pick) ? detail.pick : "";
    for (const cell of cells) cell.classList.toggle("picked", cell.dataset.pick === detail.pick);
    for (const gallery of galleries) {
      const option = [...gallery.options].find((one) => one.dataset.pick === detail.pick);
      if (!option || option.selected || detail.from === gallery) continue;
      gallery.value = option.value;
      gallery.dispatchEvent(new Event("change"));
    }
  });
  for (const list of lists) {
    list.addEventListener("change", () => updraft.pick(list.value, list));
    for (const button of list.closest(".picker").querySelectorAll("button")) {
      button.addEventListener("click", () => {
        const count = list.options.length;
        list.selectedIndex = (list.selectedIndex + Number(button.dataset.step) + count) % count;
        updraft.pick(list.value, list);
      });
    }
  }
  for (const gallery of galleries) {
    const changed = () => pickOf(gallery) && updraft.pick(pickOf(gallery), gallery);
    gallery.addEventListener("change", changed);
    // Its buttons do not tell of a change.
    for (const button of gallery.closest(".gallery").querySelectorAll("button")) button.addEventListener("click", changed);
  }
  for (const cell of cells) cell.addEventListener("click", () => updraft.pick(cell.dataset.pick, cell));

  // Arrow keys go from a drone of the map to the next one in their direction.
  for (const map of new Set(cells.filter((cell) => !cell.closest("a")).map((cell) => cell.closest(".drawing")))) {
    const own = cells.filter((cell) => cell.closest(".drawing") === map);
    const middle = (cell) => {
      const { x, y, width, height } = cell.getBoundingClientRect();
      return [x + width / 2, y + height / 2];
    };
    map.tabIndex = 0;
    map.setAttribute("role", "group");
    map.setAttribute("aria-label", "Map: arrow keys go from drone to drone");
    map.addEventListener("keydown", (event) => {
      const way = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowDown: [0, 1], ArrowUp: [0, -1] }[event.key];
      if (!way || event.target !== map) return;
      event.preventDefault();
      const here = own.find((cell) => cell.dataset.pick === updraft.picked);
      if (!here) return updraft.pick(own[0].dataset.pick, map);
      const [x, y] = middle(here);
      let [best, found] = [Infinity, null];
      for (const cell of own) {
        const [dx, dy] = [middle(cell)[0] - x, middle(cell)[1] - y];
        const [ahead, aside] = [dx * way[0] + dy * way[1], Math.abs(dx * way[1]) + Math.abs(dy * way[0])];
        if (ahead > 1 && ahead + 2 * aside < best) [best, found] = [ahead + 2 * aside, cell];
      }
      if (found) updraft.pick(found.dataset.pick, map);
    });
  }

  // How much of the ground shows through the colours.
  for (const slider of document.querySelectorAll(".through input")) {
    const drawing = slider.closest("figure, section").querySelector(".drawing svg image.basemap")?.closest(".drawing");
    slider.addEventListener("input", () => drawing?.style.setProperty("--cells", slider.value / 100));
  }
}
