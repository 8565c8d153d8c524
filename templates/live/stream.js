/* The station's events. The secret leaves the address bar at once. */
function secret() {
  const given = location.hash.slice(1);
  if (given) {
    history.replaceState(null, "", location.pathname);
    sessionStorage.setItem("token", given);
  }
  return given || sessionStorage.getItem("token") || "";
}

let lastFrame_ms = 0;
let frames = 0;
let drawn = 0;

function connection(kind, words) {
  document.body.dataset.connection = kind;
  setText(byId("connection"), words);
}

function gone(text) {
  byId("gone").hidden = !text;
  setText(byId("gone"), text);
}

function takeFacts(facts) {
  state.facts = facts;
  bounds = null;
  document.title = `${facts.flight}: updraft ${facts.is_replay ? "replay" : "live"}`;
  setText(byId("kind"), facts.is_replay ? "Replay" : "Live");
  setText(byId("flight"), facts.flight);
  setText(byId("title"), facts.title);
  setText(byId("made"), `${facts.made_by}, ${facts.site || "site"} ${fixed(facts.origin_deg[0], 5)}°, ${fixed(facts.origin_deg[1], 5)}°`);
  drawScope();
}

/** Pages of the campaign that are there already; they open beside this one. */
function takeLinks(links) {
  byId("beside").hidden = !links.length;
  byId("beside").replaceChildren(...links.map(({ title, href }) => {
    const link = document.createElement("a");
    Object.assign(link, { href, target: "_blank", rel: "noopener", textContent: title });
    return link;
  }));
}

function takeFrame(frame) {
  lastFrame_ms = Date.now();
  frames += 1;
  state.ahead_ms = frame.now_ms - lastFrame_ms;
  if (frame.whole) {
    state.drones = [];
    byId("said").replaceChildren();
  }
  state.frame = frame;
  for (const [index, drone] of frame.drones) {
    state.drones[index] = drone;
    drawRow(drone);
  }
  state.drones.length = frame.count;
  addSaid(frame.said);
  if (frame.preflight !== undefined) { state.preflight = frame.preflight; drawPreflight(); }
  if (frame.air !== undefined) { state.air = frame.air; drawAir(); }
  setText(byId("show"), frame.show_s === null ? "–" : clock(frame.show_s));
  setText(byId("step"), STEPS[frame.step] ?? frame.step);
  setText(byId("waits"), frame.waits);
  drawQuestion(frame.question);
  drawReplay(frame.replay);
  if (!drawn) drawn = requestAnimationFrame(drawAll);
}

/** Once a picture of the screen, however many events have come. */
function drawAll() {
  drawn = 0;
  sortRows();
  drawAges();
  drawBoardSum();
  drawMapSum();
  drawScope();
  drawMap();
  document.body.dataset.drawn = String(state.frame.number);
}

function open() {
  state.token = secret();
  if (!state.token) {
    connection("closed", "no secret");
    gone("This address lacks its secret: open the one that the station prints, whole.");
    return;
  }
  const stream = new EventSource(`/events?token=${encodeURIComponent(state.token)}`);
  stream.addEventListener("facts", (event) => takeFacts(JSON.parse(event.data)));
  stream.addEventListener("links", (event) => takeLinks(JSON.parse(event.data)));
  stream.addEventListener("message", (event) => takeFrame(JSON.parse(event.data)));
  stream.addEventListener("over", () => { over = true; });
  stream.onopen = () => { over = false; connection("open", "connected"); gone(""); drawScope(); drawBoardSum(); };
  stream.onerror = () => {
    const flying = state.drones.filter((drone) => drone.armed).length;
    connection(over && !flying ? "ended" : "lost", over ? "station ended" : "lost");
    drawScope();
    drawBoardSum();
    gone(!over ? "No word from the station: what is shown is old. Trying again."
      : flying ? `The station has ended with ${flying} ${flying === 1 ? "drone" : "drones"} in the air: nobody watches them. ` +
        "“updraft fleet watch --live” takes over, “updraft fleet abort” sends them home."
      : "The station has ended. The page goes on when it is started again.");
    if (stream.readyState === EventSource.CLOSED) {
      tellRefusal();
      setTimeout(open, 1500);
    }
  };
}

/** A station that answers, but not to this secret: another flight's, or one that was made anew. */
async function tellRefusal() {
  const stop = new AbortController();
  try {
    const answer = await fetch(`/events?token=${encodeURIComponent(state.token)}`, { signal: stop.signal });
    if (answer.status === 401) {
      connection("closed", "wrong secret");
      gone("The station does not know the secret of this page: open the address that it has printed last.");
      drawScope();
    }
  } catch { /* It does not answer, as is said already. */ }
  stop.abort();
}

let over = false;
setInterval(() => {
  if (!state.frame) return;
  drawAges();
  const age = (Date.now() - lastFrame_ms) / 1000;
  if (document.body.dataset.connection === "open" && age > 6) connection("open", `quiet for ${fixed(age, 0)} s`);
  else if (document.body.dataset.connection === "open") connection("open", "connected");
}, 1000);
new ResizeObserver(() => { if (state.facts) drawMap(); }).observe(byId("plan"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawMap);
open();
