/* A flight from its logs: play, pause, faster, anywhere. */
let dragging = false;

function drawReplay(replay) {
  byId("replay").hidden = !replay;
  if (!replay) return;
  const time = byId("replay-time");
  [time.min, time.max] = replay.ends_s.map(String);
  const at = state.frame.show_s ?? replay.ends_s[0];
  if (!dragging) time.value = String(at);
  setText(byId("replay-clock"), clock(dragging ? Number(time.value) : at));
  setText(byId("replay-play"), replay.plays ? "Pause" : "Play");
  byId("replay-play").dataset.plays = replay.plays ? "yes" : "no";
  const speed = byId("replay-speed");
  if (![...speed.options].some((option) => Number(option.value) === replay.speed)) {
    speed.prepend(new Option(String(replay.speed)));
  }
  if (document.activeElement !== speed) speed.value = String(replay.speed);
}

byId("replay-play").addEventListener("click", () =>
  wish({ wish: "replay", plays: byId("replay-play").dataset.plays !== "yes" }));
byId("replay-time").addEventListener("input", () => {
  dragging = true;
  wish({ wish: "replay", at_s: Number(byId("replay-time").value) });
});
byId("replay-time").addEventListener("change", () => { dragging = false; });
byId("replay-speed").addEventListener("change", () => wish({ wish: "replay", speed: Number(byId("replay-speed").value) }));
