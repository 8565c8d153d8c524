/* The table of drones, worst first; the table before a start; what was said. */
const LEVELS = ["good", "notice", "warning", "alarm"];
const rows = new Map();
let order = "";

/** Key of a drone that stays while its slot or identifier does. */
const keyOf = (drone) => (drone.slot !== null ? `s${drone.slot}` : `d${drone.drone}`);

function makeRow(key) {
  const row = document.createElement("tr");
  const pick = document.createElement("input");
  pick.type = "checkbox";
  pick.addEventListener("change", () => choose(key, pick.checked));
  const cells = Array.from({ length: 11 }, (_, index) => {
    const cell = document.createElement("td");
    if (index === 0) { cell.className = "pick"; cell.append(pick); }
    if (index === 4) cell.className = "words";
    row.append(cell);
    return cell;
  });
  const made = { row, pick, cells };
  rows.set(key, made);
  return made;
}

function choose(key, yes) {
  if (yes) state.chosen.add(key); else state.chosen.delete(key);
  rows.get(key)?.row.classList.toggle("chosen", yes);
  drawScope();
  drawMap();
}

const FIXES = { 0: "none", 1: "none", 2: "2-D", 3: "3-D", 4: "DGPS", 5: "RTK float", 6: "RTK" };

function drawRow(drone) {
  const key = keyOf(drone);
  const { row, pick, cells } = rows.get(key) ?? makeRow(key);
  const name = drone.slot !== null ? `slot ${drone.slot}` : `drone ${drone.drone}`;
  if (pick.getAttribute("aria-label") !== name) pick.setAttribute("aria-label", name);
  pick.disabled = !drone.drone;
  if (row.dataset.level !== drone.level) row.dataset.level = drone.level;
  const battery = drone.battery_percent !== null ? `${fixed(drone.battery_percent, 0)} %`
    : drone.battery_v !== null ? `${fixed(drone.battery_v, 1)} V` : "–";
  const minutes = drone.minutes_left !== null ? ` · ${fixed(drone.minutes_left, drone.minutes_left < 10 ? 1 : 0)} min` : "";
  const gps = drone.gps_fix === null ? "–" : `${FIXES[drone.gps_fix] ?? drone.gps_fix} · ${drone.satellites}`;
  const air = drone.air_mps === null ? "–" : `${signed(drone.air_mps, 2)} ± ${fixed(drone.air_se_mps, 2)}`;
  const signal = drone.signal_percent !== null ? ` · ${fixed(drone.signal_percent, 0)} %` : "";
  const loss = drone.loss_percent === null ? "–" : `${fixed(drone.loss_percent, 0)} %`;
  /* The identifier is named where it is not the slot's own number. */
  const slot = drone.slot === null ? `drone ${drone.drone}`
    : drone.drone && drone.drone !== String(drone.slot) ? `${drone.slot} (drone ${drone.drone})` : String(drone.slot);
  const parts = [drone.trouble, drone.order, drone.words].filter((text) => text && text !== drone.stage);
  [
    slot, drone.stage || "–", air, parts.filter((text, i) => parts.indexOf(text) === i).join(" · "), null, loss + signal, gps,
    battery + minutes, drone.place_m ? `${fixed(drone.place_m[2], 1)} m` : "–",
    drone.distance_m === null ? "–" : `${fixed(drone.distance_m, 1)} m`,
  ].forEach((text, index) => { if (text !== null) setText(cells[index + 1], text); });
}

/** How long ago each drone was heard: it grows without a word from the station. */
function drawAges() {
  const now = Date.now() + state.ahead_ms;
  for (const drone of state.drones) {
    const cell = rows.get(keyOf(drone))?.cells[5];
    if (!cell) continue;
    if (drone.heard_ms === null) { setText(cell, "–"); continue; }
    const age = Math.max(0, (now - drone.heard_ms) / 1000);
    setText(cell, age < 10 ? `${fixed(age, 1)} s` : `${fixed(age, 0)} s`);
  }
}

/** Worst first; among equals by slot. */
function sortRows() {
  const rank = (drone) => LEVELS.indexOf(drone.level);
  const sorted = [...state.drones].sort((a, b) =>
    rank(b) - rank(a) || (a.slot ?? 1e6) - (b.slot ?? 1e6) || String(a.drone).localeCompare(String(b.drone)));
  const keys = sorted.map(keyOf);
  const now = keys.join();
  if (now === order) return;
  order = now;
  const known = new Set(keys);
  for (const [key, { row }] of rows) {
    if (!known.has(key)) { row.remove(); rows.delete(key); state.chosen.delete(key); }
  }
  const body = byId("rows");
  const focused = document.activeElement;
  keys.forEach((key, index) => {
    const { row } = rows.get(key);
    if (body.children[index] !== row) body.insertBefore(row, body.children[index] ?? null);
  });
  if (focused !== document.activeElement && body.contains(focused)) focused.focus({ preventScroll: true });
}

/* Who was heard within this time counts. */
const HEARD_MS = 10000;

function drawBoardSum() {
  const count = { good: 0, notice: 0, warning: 0, alarm: 0, landed: 0 };
  const kind = (drone) => (drone.level === "good" && drone.stage === "landed" ? "landed" : drone.level);
  for (const drone of state.drones) count[kind(drone)] += 1;
  const parts = [["alarm", "alarm"], ["warning", "in trouble"], ["notice", "to look at"], ["good", "good"], ["landed", "landed"]]
    .filter(([level]) => count[level]).map(([level, word]) => `${count[level]} ${word}`);
  const isOld = ["lost", "ended"].includes(document.body.dataset.connection);
  setText(byId("board-sum"), (parts.join(", ") || "no drone yet") + (isOld && parts.length ? ", when they were heard last" : ""));
  const since = Date.now() + state.ahead_ms - HEARD_MS;
  const heard = state.drones.filter((drone) => drone.heard_ms !== null && drone.heard_ms > since).length;
  const of = state.facts?.is_replay ? `${state.drones.length}` : `${heard} of ${state.drones.length}`;
  setText(byId("count"), state.drones.length ? of : "–");
}

function drawPreflight() {
  const table = state.preflight;
  byId("preflight").hidden = !table;
  if (!table) return;
  const bad = table.rows.filter(([, cells]) => cells.some(([, why]) => why)).length;
  setText(byId("preflight-sum"), table.go ? `Go: all ${table.rows.length} drones are ready`
    : `No go yet: ${bad} of ${table.rows.length} drones are not ready`);
  byId("preflight-fleet").replaceChildren(...table.fleet.map((text) => {
    const item = document.createElement("li");
    item.textContent = text;
    return item;
  }));
  const cell = (kind, text, level) => {
    const made = document.createElement(kind);
    made.textContent = text;
    if (level) made.className = level;
    if (kind === "th") made.scope = "col";
    return made;
  };
  byId("preflight-head").replaceChildren(...["slot", ...table.columns, "reason"].map((text) => cell("th", text)));
  const sorted = [...table.rows].sort((a, b) =>
    Number(b[1].some(([, why]) => why)) - Number(a[1].some(([, why]) => why)) || a[0] - b[0]);
  byId("preflight-rows").replaceChildren(...sorted.map(([slot, cells]) => {
    const row = document.createElement("tr");
    row.append(cell("td", String(slot)));
    for (const [text, why] of cells) row.append(cell("td", text, why ? "warning" : ""));
    row.append(cell("td", cells.map(([, why]) => why).filter((why) => why).join("; ")));
    return row;
  }));
}

const MOST_SAID = 300;

function addSaid(said) {
  const list = byId("said");
  for (const { at_ms, level, text } of said) {
    const item = document.createElement("li");
    const time = document.createElement("time");
    const at = new Date(at_ms);
    time.dateTime = at.toISOString();
    time.textContent = at.toLocaleTimeString([], { hour12: false });
    if (level !== "good") item.className = level;
    item.append(time, text);
    list.prepend(item);
  }
  while (list.children.length > MOST_SAID) list.lastChild.remove();
}
