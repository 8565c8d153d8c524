/* Orders and answers: each in two deliberate steps. */
let pending = null;

async function wish(body) {
  try {
    const answer = await fetch("/wish", {
      method: "POST", headers: { "Content-Type": "application/json", "X-Token": state.token },
      body: JSON.stringify(body),
    });
    const text = await answer.text();
    return { ok: answer.ok, text: text || `the station answers ${answer.status}` };
  } catch {
    return { ok: false, text: "The station does not answer: use its terminal, or the remote controls" };
  }
}

/** Identifiers of the chosen drones, as the station writes them. */
function chosenDrones() {
  return state.drones.filter((drone) => drone.drone && state.chosen.has(keyOf(drone))).map((drone) => drone.drone);
}

function drawScope() {
  const chosen = chosenDrones();
  const isOperator = Boolean(state.facts?.may_order) && !state.facts?.is_replay;
  /* Nobody carries out an order any more. A lost link may come back while somebody aims at the button. */
  const isOver = ["ended", "closed"].includes(document.body.dataset.connection) || state.frame?.step === "over";
  const may = isOperator && !isOver;
  byId("orders").hidden = Boolean(state.facts?.is_replay);
  for (const id of ["order-return", "order-land"]) byId(id).disabled = !may;
  const whom = chosen.length ? `for ${chosen.length} chosen ${chosen.length === 1 ? "drone" : "drones"}` : "for all drones";
  setText(byId("order-scope"), may ? whom : isOperator ? "The station’s work is done: it sends no orders"
    : "This page may look only: --live-orders prints the operator’s address");
  byId("choose-none").hidden = !chosen.length;
}

function openConfirm(action) {
  const drones = chosenDrones();
  const whom = drones.length ? `${drones.length === 1 ? "drone" : "drones"} ${drones.join(", ")}` : "all drones that are heard";
  pending = { wish: "order", action };
  if (drones.length) pending.drones = drones;
  const one = drones.length === 1;
  const does = action === "return" ? `fly back to where ${one ? "it" : "they"} took off, and land there`
    : `land where ${one ? "it is" : "they are"} now`;
  const rest = one ? "On the ground, it will not start." : "Those on the ground will not start.";
  setText(byId("confirm-text"), `Shall ${whom} leave the show and ${does}? ${rest}`);
  setText(byId("confirm-yes"), action === "return" ? "Yes, return" : "Yes, land");
  byId("confirm").hidden = false;
  byId("confirm-no").focus();
}

function closeConfirm() {
  if (byId("confirm").hidden) return;
  const back = pending?.action === "land" ? "order-land" : "order-return";
  pending = null;
  byId("confirm").hidden = true;
  byId(back).focus();
}

for (const id of ["order-return", "order-land"]) {
  byId(id).addEventListener("click", () => openConfirm(byId(id).dataset.action));
}
byId("confirm-no").addEventListener("click", closeConfirm);
byId("confirm-yes").addEventListener("click", async () => {
  if (!pending) return;
  const order = pending;
  closeConfirm();
  setText(byId("order-said"), "Sending …");
  const { ok, text } = await wish(order);
  byId("order-said").className = ok ? "good" : "alarm";
  setText(byId("order-said"), text);
});
byId("choose-none").addEventListener("click", () => {
  for (const key of [...state.chosen]) {
    rows.get(key).pick.checked = false;
    choose(key, false);
  }
  byId("order-return").focus();
});
document.addEventListener("keydown", (event) => { if (event.key === "Escape") closeConfirm(); });

let asked = 0;

function drawQuestion(question) {
  byId("question").hidden = !question;
  if (question && question.number !== asked) setText(byId("order-said"), "");
  if (!question || question.number === asked) { if (!question) asked = 0; return; }
  asked = question.number;
  setText(byId("question-text"), question.text);
  const may = Boolean(state.facts?.may_order);
  byId("question-answers").replaceChildren(...question.answers.map(([word, does]) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = does;
    button.disabled = !may;
    /* Two steps: the first press asks for the second, for a few seconds. */
    let armed = false;
    button.addEventListener("click", async () => {
      if (!armed) {
        armed = true;
        button.textContent = `Press again: ${does}`;
        button.classList.add("danger");
        setTimeout(() => { armed = false; button.textContent = does; button.classList.remove("danger"); }, 6000);
        return;
      }
      const { ok, text } = await wish({ wish: "answer", question: question.number, answer: word });
      byId("order-said").className = ok ? "good" : "alarm";
      setText(byId("order-said"), ok ? `Answered: ${does}. What follows is said by the station.` : text);
    });
    return button;
  }));
  if (!may) {
    const note = document.createElement("span");
    note.className = "scope";
    note.textContent = "The station’s terminal or the operator’s page answers";
    byId("question-answers").append(note);
  }
}
