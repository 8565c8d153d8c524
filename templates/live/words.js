"use strict";
/* Elements, numbers and words. */
const byId = (id) => document.getElementById(id);

/** Sets a text only where it changes: nothing is laid out anew for the same words. */
function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** A number with a real minus, or a dash. */
function fixed(value, digits) {
  if (value === null || value === undefined) return "–";
  return value.toFixed(digits).replace("-", "−").replace(/^−(0(\.0*)?)$/, "$1");
}

/** A number that is read as a difference. */
function signed(value, digits) {
  const text = fixed(value, digits);
  return value > 0 && Number(text) !== 0 ? `+${text}` : text;
}

/** Seconds as minutes and seconds. */
function clock(seconds) {
  const whole = Math.round(Math.abs(seconds));
  const minutes = Math.floor(whole / 60);
  const sign = seconds < 0 && whole > 0 ? "−" : "";
  return `${sign}${minutes}:${String(whole % 60).padStart(2, "0")}`;
}

const STEPS = {
  listening: "listening", greeting: "greeting", assigning: "finding slots", uploading: "uploading",
  parameters: "parameters", preflight: "preflight", start: "start", flying: "flying",
  logs: "logs", over: "over", replay: "replay",
};

/** RdBu of ColorBrewer, reversed: blue goes down, red goes up. */
const DIVERGING = [
  [5, 48, 97], [33, 102, 172], [67, 147, 195], [146, 197, 222], [209, 229, 240], [247, 247, 247],
  [253, 219, 199], [244, 165, 130], [214, 96, 77], [178, 24, 43], [103, 0, 31],
];

/** Colour of a value between −most and most. */
function diverging(value, most) {
  const at = Math.min(1, Math.max(0, (value / most + 1) / 2)) * (DIVERGING.length - 1);
  const low = Math.min(Math.floor(at), DIVERGING.length - 2);
  const part = at - low;
  const mix = (i) => Math.round(DIVERGING[low][i] * (1 - part) + DIVERGING[low + 1][i] * part);
  return `rgb(${mix(0)}, ${mix(1)}, ${mix(2)})`;
}

/** What the page knows. */
const state = {
  facts: null, drones: [], chosen: new Set(), frame: null, air: null, preflight: null, token: "",
  /** How much the station's clock is ahead of this one's, ms. */
  ahead_ms: 0,
};
