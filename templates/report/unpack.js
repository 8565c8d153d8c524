// The drawings of single drones come compressed; script.js shows them.
for (const packed of document.querySelectorAll(".gallery script.packed")) {
  const bytes = Uint8Array.from(atob(packed.textContent), (c) => c.charCodeAt(0));
  const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  new Response(plain).json().then((drawings) => {
    const gallery = packed.closest(".gallery");
    for (const [name, svg] of Object.entries(drawings)) {
      const template = document.createElement("template");
      template.dataset.name = name;
      template.innerHTML = svg;
      gallery.append(template);
    }
    gallery.dataset.unpacked = "yes";
    packed.remove();
    // A drone may have been picked before.
    if (updraft.picked) gallery.querySelector("select").dispatchEvent(new Event("change"));
  });
}
