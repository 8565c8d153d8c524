/* Plan and side view: ways ahead, fence, who is where, and the air. */
const AHEAD_S = 40;
/** Above so many drones labels are left out. */
const LABELLED = 120;

function colour(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }

/** A canvas in the pixels of the screen, cleared. */
function prepare(id) {
  const canvas = byId(id);
  const scale = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "12px system-ui, sans-serif";
  return { pen, width, height };
}

/** Where a slot's way is at a time. */
function wayAt(slot, time_s) {
  const [, home, index] = slot;
  const way = state.facts.ways[index];
  if (!way.length) return home;
  let low = 0;
  let high = way.length - 1;
  if (time_s <= way[0][0]) high = 0;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (way[middle][0] <= time_s) low = middle; else high = middle;
  }
  const [a, b] = [way[low], way[high]];
  const part = b[0] > a[0] ? Math.min(1, Math.max(0, (time_s - a[0]) / (b[0] - a[0]))) : 0;
  return [0, 1, 2].map((i) => home[i] + a[i + 1] * (1 - part) + b[i + 1] * part);
}

/** The next stretch of a slot's way. */
function ahead(slot, from_s) {
  const way = state.facts.ways[slot[2]];
  const home = slot[1];
  const until = from_s + AHEAD_S;
  const between = way.filter(([t]) => t > from_s && t < until).map(([, x, y, z]) => [home[0] + x, home[1] + y, home[2] + z]);
  return [wayAt(slot, from_s), ...between, wayAt(slot, until)];
}

let bounds = null;

/** What must be seen: fence, homes and ways. */
function findBounds() {
  const { slots, ways, fence_m, fence_top_m } = state.facts;
  const box = { x: [Infinity, -Infinity], y: [Infinity, -Infinity], z: [0, 1] };
  const take = (axis, value) => {
    box[axis][0] = Math.min(box[axis][0], value);
    box[axis][1] = Math.max(box[axis][1], value);
  };
  const reach = ways.map((way) => [1, 2, 3].map((i) => [
    Math.min(0, ...way.map((point) => point[i])), Math.max(0, ...way.map((point) => point[i])),
  ]));
  for (const [, home, index] of slots) {
    ["x", "y", "z"].forEach((axis, i) => {
      take(axis, home[i] + (reach[index]?.[i]?.[0] ?? 0));
      take(axis, home[i] + (reach[index]?.[i]?.[1] ?? 0));
    });
  }
  for (const [x, y] of fence_m) { take("x", x); take("y", y); }
  box.z[1] = Math.max(box.z[1] * 1.08, Math.min(fence_top_m, box.z[1] * 1.3));
  if (!Number.isFinite(box.x[0])) { box.x = [-10, 10]; box.y = [-10, 10]; }
  return box;
}

/** A round length for a scale, at most `most`. */
function round(most) {
  const power = 10 ** Math.floor(Math.log10(most));
  return [5, 2, 1].map((k) => k * power).find((length) => length <= most) ?? power;
}

/** Limit of the colours that are shown, m/s. */
let shownLimit = 0;

function largest() {
  const values = state.drones.map((drone) => drone.air_mps).filter((value) => value !== null).map(Math.abs);
  for (const value of state.air?.map?.values_mps ?? []) if (value !== null) values.push(Math.abs(value));
  const most = Math.max(0.25, ...values);
  const limit = [0.25, 0.5, 1, 2, 3, 5, 8, 12].find((round) => round >= most) ?? most;
  // Colours keep their meaning while the air stays near the limit: up at once, down when half would do.
  if (limit > shownLimit || most < shownLimit / 2) shownLimit = limit;
  return shownLimit;
}

const LEVEL_COLOURS = { good: "--drone", notice: "--notice", warning: "--warning", alarm: "--alarm" };

/** Whether any colour stands for air. */
function hasColours() {
  return Boolean(state.air?.map) || state.drones.some((drone) => drone.air_mps !== null);
}

/** Colour of a drone: of its air; hollow without a value where others have one, as its blue would be sinking air. */
function fillOf(drone, most) {
  if (drone.air_mps !== null) return diverging(drone.air_mps, most);
  if (drone.level === "good" && hasColours()) return colour("--paper");
  return colour(LEVEL_COLOURS[drone.level]);
}

function drawMap() {
  if (!state.facts) return;
  bounds ??= findBounds();
  const most = largest();
  const isFlying = state.frame?.show_s !== null && state.frame?.show_s !== undefined;
  drawPlan(most, isFlying);
  drawSide(most, isFlying);
  const hasAir = hasColours();
  byId("legend").hidden = !hasAir;
  if (hasAir) drawScale(most);
}

function drawPlan(most, isFlying) {
  const { pen, width, height } = prepare("plan");
  const { facts } = state;
  const pad = 36;
  const span = [bounds.x[1] - bounds.x[0], bounds.y[1] - bounds.y[0]].map((length) => Math.max(length, 4));
  const scale = Math.min((width - 2 * pad) / span[1], (height - 2 * pad) / span[0]);
  const middle = [(bounds.x[0] + bounds.x[1]) / 2, (bounds.y[0] + bounds.y[1]) / 2];
  /* x along the rows goes up, y goes to the left: as the show frame is seen from above. */
  const at = ([x, y]) => [width / 2 - (y - middle[1]) * scale, height / 2 - (x - middle[0]) * scale];
  const map = state.air?.map;
  if (map) {
    const size = map.step_m * scale;
    map.values_mps.forEach((value, index) => {
      if (value === null) return;
      const [left, top] = at([map.origin_m[0] + (index % map.columns) * map.step_m, map.origin_m[1] + Math.floor(index / map.columns) * map.step_m]);
      pen.fillStyle = diverging(value, most);
      pen.fillRect(left - size / 2 - 0.5, top - size / 2 - 0.5, size + 1, size + 1);
    });
  }
  const line = (points, close) => {
    pen.beginPath();
    points.forEach((point, index) => { const [x, y] = at(point); if (index) pen.lineTo(x, y); else pen.moveTo(x, y); });
    if (close) pen.closePath();
    pen.stroke();
  };
  pen.strokeStyle = colour("--alarm");
  pen.lineWidth = 1.5;
  pen.setLineDash([6, 4]);
  if (facts.fence_m.length) line(facts.fence_m, true);
  pen.setLineDash([]);
  pen.strokeStyle = colour("--way");
  const show_s = isFlying ? state.frame.show_s : 0;
  for (const slot of facts.slots) {
    const [x, y] = at(slot[1]);
    pen.strokeRect(x - 3.5, y - 3.5, 7, 7);
    line(ahead(slot, show_s), false);
  }
  const isFew = state.drones.length <= LABELLED;
  for (const drone of state.drones) {
    if (!drone.place_m) continue;
    const [x, y] = at(drone.place_m);
    const hasAir = drone.air_mps !== null;
    pen.beginPath();
    pen.arc(x, y, hasAir ? 7 : 5, 0, 2 * Math.PI);
    pen.fillStyle = fillOf(drone, most);
    pen.fill();
    pen.lineWidth = drone.level === "good" ? 1 : 3;
    pen.strokeStyle = drone.level === "good" ? colour("--ink") : colour(LEVEL_COLOURS[drone.level]);
    pen.stroke();
    if (state.chosen.has(keyOf(drone))) {
      pen.beginPath();
      pen.arc(x, y, 11, 0, 2 * Math.PI);
      pen.lineWidth = 2;
      pen.strokeStyle = colour("--accent");
      pen.stroke();
    }
    if ((isFew && scale > 1.2) || drone.level === "alarm") {
      pen.fillStyle = colour("--ink");
      pen.textAlign = "left";
      pen.fillText(drone.slot !== null ? String(drone.slot) : drone.drone, x + 9, y - 6);
    }
  }
  drawNorth(pen, width);
  const length = round((width - 2 * pad) / 3 / scale);
  pen.strokeStyle = colour("--ink");
  pen.fillStyle = colour("--ink");
  pen.lineWidth = 2;
  pen.beginPath();
  pen.moveTo(pad, height - 12);
  pen.lineTo(pad + length * scale, height - 12);
  pen.stroke();
  pen.textAlign = "left";
  pen.fillText(`${length} m`, pad + length * scale + 6, height - 8);
}

/** Arrow to the north: the x axis, which goes up, points `orientation_deg` clockwise from it. */
function drawNorth(pen, width) {
  const angle = -state.facts.orientation_deg * Math.PI / 180;
  pen.save();
  pen.translate(width - 20, 34);
  pen.rotate(angle);
  pen.fillStyle = colour("--ink");
  pen.beginPath();
  pen.moveTo(0, -16); pen.lineTo(5, 4); pen.lineTo(0, 1); pen.lineTo(-5, 4);
  pen.closePath();
  pen.fill();
  pen.restore();
  pen.textAlign = "center";
  pen.fillStyle = colour("--ink");
  pen.fillText("N", width - 20 + 22 * Math.sin(angle), 38 - 22 * Math.cos(angle));
}

function drawSide(most, isFlying) {
  const { pen, width, height } = prepare("side");
  const { facts } = state;
  const [left, right, top, bottom] = [44, 16, 12, 24];
  const span = Math.max(bounds.y[1] - bounds.y[0], 4);
  const across = (width - left - right) / span;
  const up = (height - top - bottom) / Math.max(bounds.z[1] - bounds.z[0], 1);
  const at = (y, z) => [left + (bounds.y[1] - y) * across, height - bottom - (z - bounds.z[0]) * up];
  pen.strokeStyle = colour("--rule");
  pen.fillStyle = colour("--muted");
  pen.textAlign = "right";
  pen.lineWidth = 1;
  const step = round(Math.max((bounds.z[1] - bounds.z[0]) / 3, 1));
  for (let z = Math.ceil(bounds.z[0] / step) * step; z <= bounds.z[1]; z += step) {
    const [, y] = at(0, z);
    pen.beginPath(); pen.moveTo(left, y); pen.lineTo(width - right, y); pen.stroke();
    pen.fillText(`${z} m`, left - 6, y + 4);
  }
  if (facts.fence_top_m <= bounds.z[1]) {
    const [, y] = at(0, facts.fence_top_m);
    pen.strokeStyle = colour("--alarm");
    pen.setLineDash([6, 4]);
    pen.beginPath(); pen.moveTo(left, y); pen.lineTo(width - right, y); pen.stroke();
    pen.setLineDash([]);
  }
  const show_s = isFlying ? state.frame.show_s : 0;
  pen.strokeStyle = colour("--way");
  for (const slot of facts.slots) {
    pen.beginPath();
    ahead(slot, show_s).forEach(([, y, z], index) => { const [px, py] = at(y, z); if (index) pen.lineTo(px, py); else pen.moveTo(px, py); });
    pen.stroke();
  }
  for (const drone of state.drones) {
    if (!drone.place_m) continue;
    const [x, y] = at(drone.place_m[1], drone.place_m[2]);
    pen.beginPath();
    pen.arc(x, y, 4.5, 0, 2 * Math.PI);
    pen.fillStyle = fillOf(drone, most);
    pen.fill();
    pen.lineWidth = drone.level === "good" ? 1 : 3;
    pen.strokeStyle = drone.level === "good" ? colour("--ink") : colour(LEVEL_COLOURS[drone.level]);
    pen.stroke();
  }
  pen.fillStyle = colour("--muted");
  pen.textAlign = "left";
  pen.fillText("from behind the first row", left, height - 7);
}

function drawScale(most) {
  const canvas = byId("scale");
  const pen = canvas.getContext("2d");
  for (let x = 0; x < canvas.width; x += 1) {
    pen.fillStyle = diverging((2 * x / (canvas.width - 1) - 1) * most, most);
    pen.fillRect(x, 0, 1, canvas.height);
  }
  setText(byId("scale-words"), `from −${most} to +${most} m/s`);
}

function drawAir() {
  const { air } = state;
  byId("air").hidden = !air;
  if (!air) return;
  const mark = byId("air-mark");
  setText(mark, air.provisional ? "provisional" : "final");
  mark.classList.toggle("final", !air.provisional);
  setText(byId("air-fleet"), air.fleet_mps
    ? `Mean of the fleet ${signed(air.fleet_mps[0], 2)} m/s (95 %: ${signed(air.fleet_mps[1], 2)} to ${signed(air.fleet_mps[2], 2)})`
    : "No mean of the fleet yet");
  setText(byId("air-note"), air.time_s > 0 ? `At ${clock(air.time_s)} of the show. ${air.note}` : air.note);
}

function drawMapSum() {
  const placed = state.drones.filter((drone) => drone.place_m).length;
  const far = state.drones.filter((drone) => drone.distance_m !== null);
  const worst = far.reduce((most, drone) => Math.max(most, drone.distance_m), 0);
  setText(byId("map-sum"), `${placed} ${placed === 1 ? "drone has" : "drones have"} said where ${placed === 1 ? "it is" : "they are"}` +
    (far.length ? `; ${fixed(worst, 1)} m off their trajectories at most` : ""));
}
