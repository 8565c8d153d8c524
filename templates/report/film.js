// The film of Fig. 5: fields over the grid from the data beside it, drawn on canvases.
for (const film of document.querySelectorAll(".film")) {
  const data = JSON.parse(film.querySelector('script[type="application/json"]').textContent);
  const NONE = -32768;
  const decoded = (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    return Int16Array.from({ length: bytes.length / 2 }, (_, i) => view.getInt16(2 * i, true));
  };
  const estimate = decoded(data.estimate);
  const truth = data.truth ? decoded(data.truth) : null;
  const less = (values) => truth && values.map((w, i) => (w === NONE || truth[i] === NONE ? NONE : w - truth[i]));
  const alone = { estimate, truth, difference: less(estimate), names: { estimate: "Estimated W*", difference: "W* − W" } };
  // The posterior, if there is one: all drones, seconds and the calibration together.
  const together = data.posterior && decoded(data.posterior.values);
  const sd = data.posterior && decoded(data.posterior.sd);
  const posterior = together && {
    estimate: together,
    truth,
    difference: less(together),
    names: { estimate: "Posterior W", difference: "Posterior W − W" },
  };
  const field = data.posterior?.field ?? null;
  const cells = field && decoded(field.values);
  const lost = data.posterior?.lost ?? [];
  let shown = posterior || alone;
  const drones = data.places.length;
  const frames = data.times.length;

  // Colours in 1,023 steps from one end of a scale to the other.
  const rgb = data.colours.map((hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)));
  const STEPS = 1022;
  const palette = new Uint8Array(3 * (STEPS + 1));
  for (let i = 0; i <= STEPS; i++) {
    const place = (i / STEPS) * (rgb.length - 1);
    const low = Math.min(Math.floor(place), rgb.length - 2);
    for (let c = 0; c < 3; c++) {
      palette[3 * i + c] = Math.round(rgb[low][c] + (place - low) * (rgb[low + 1][c] - rgb[low][c]));
    }
  }
  const step = (mms, limit) =>
    Math.max(0, Math.min(STEPS, Math.round(((mms / 1000 / limit + 1) / 2) * STEPS)));
  const colour = (mms, limit) => {
    const i = 3 * step(mms, limit);
    return `rgb(${palette[i]},${palette[i + 1]},${palette[i + 2]})`;
  };

  // The part of the ground that is shown, metres: forward is up, left is left.
  const known = data.places.filter(Boolean);
  const extent = (axis) => {
    const all = known.concat(lost).map((p) => p[axis]);
    return [all.reduce((a, b) => Math.min(a, b)), all.reduce((a, b) => Math.max(a, b))];
  };
  const [x, y] = [extent(0), extent(1)];
  // As wide as the closest two drones are apart.
  let cell = Infinity;
  known.forEach((a, i) => {
    for (const b of known.slice(i + 1)) {
      const apart = Math.hypot(a[0] - b[0], a[1] - b[1]);
      if (apart > 0.5 && apart < cell) cell = apart;
    }
  });
  if (cell === Infinity) cell = 7;
  const margin = 0.5 * cell;
  const forward = [x[1] + margin, x[0] - margin];
  const left = [y[1] + margin, y[0] - margin];
  const wide = left[0] - left[1];
  const tall = forward[0] - forward[1];

  // Which triangle each pixel lies in, and where in it: worked out once.
  const columns = Math.max(1, Math.round((160 * wide) / Math.max(wide, tall)));
  const rows = Math.max(1, Math.round((160 * tall) / Math.max(wide, tall)));
  // Where each pixel lies in the posterior's grid: the four cells around it, and how far between them.
  const spots = field && (() => {
    const between = (axis, v) => {
      if (v < axis[0] || v > axis[axis.length - 1]) return null;
      let low = 0;
      while (low < axis.length - 2 && axis[low + 1] < v) low++;
      return [low, (v - axis[low]) / (axis[low + 1] - axis[low])];
    };
    const down = Array.from({ length: rows }, (_, r) => between(field.x, forward[0] - ((r + 0.5) / rows) * tall));
    const across = Array.from({ length: columns }, (_, k) => between(field.y, left[0] - ((k + 0.5) / columns) * wide));
    return { down, across };
  })();
  // The grid at the time of a frame, mm/s, linear between its times; NaN is not known.
  const gridAt = (s) => {
    const n = field.x.length * field.y.length;
    const times = field.times;
    let low = 0;
    while (low < times.length - 2 && times[low + 1] < s) low++;
    const high = Math.min(low + 1, times.length - 1);
    const share = high > low ? Math.max(0, Math.min(1, (s - times[low]) / (times[high] - times[low]))) : 0;
    return Float32Array.from({ length: n }, (_, i) => {
      const [a, b] = [cells[low * n + i], cells[high * n + i]];
      return a === NONE || b === NONE ? NaN : a + share * (b - a);
    });
  };
  const paintField = (out, limit) => {
    const grid = gridAt(data.times[frame]);
    const width = field.x.length;
    for (let r = 0; r < rows; r++) {
      for (let k = 0; k < columns; k++) {
        const i = r * columns + k;
        out[4 * i + 3] = 0;
        const [along, aside] = [spots.down[r], spots.across[k]];
        if (!along || !aside) continue;
        const at = aside[0] * width + along[0];
        const near = grid[at] + along[1] * (grid[at + 1] - grid[at]);
        const far = grid[at + width] + along[1] * (grid[at + width + 1] - grid[at + width]);
        const value = near + aside[1] * (far - near);
        if (Number.isNaN(value)) continue;
        const c = 3 * step(value, limit);
        out[4 * i] = palette[c];
        out[4 * i + 1] = palette[c + 1];
        out[4 * i + 2] = palette[c + 2];
        out[4 * i + 3] = 255;
      }
    }
  };
  // What is not known shows through as hatching.
  const hatch = (pen, [x0, y0, w, h]) => {
    pen.save();
    pen.beginPath();
    pen.rect(x0, y0, w, h);
    pen.clip();
    pen.strokeStyle = "#d3d9de";
    pen.beginPath();
    for (let at = -h; at < w; at += 8) {
      pen.moveTo(x0 + at, y0 + h);
      pen.lineTo(x0 + at + h, y0);
    }
    pen.stroke();
    pen.restore();
  };

  const corners = new Int32Array(3 * columns * rows).fill(-1);
  const weights = new Float32Array(2 * columns * rows);
  for (let t = 0; t < data.triangles.length; t += 3) {
    const of = data.triangles.slice(t, t + 3);
    const [a, b, c] = of.map((i) => data.places[i]);
    const full = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
    if (!full) continue;
    const row = (v) => ((forward[0] - v) / tall) * rows - 0.5;
    const column = (v) => ((left[0] - v) / wide) * columns - 0.5;
    const range = (f, axis, n) => {
      const all = [a, b, c].map((p) => f(p[axis]));
      return [Math.max(0, Math.ceil(Math.min(...all) - 0.01)), Math.min(n - 1, Math.floor(Math.max(...all) + 0.01))];
    };
    const [top, bottom] = range(row, 0, rows);
    const [first, last] = range(column, 1, columns);
    for (let r = top; r <= bottom; r++) {
      const px = forward[0] - ((r + 0.5) / rows) * tall - a[0];
      for (let k = first; k <= last; k++) {
        const py = left[0] - ((k + 0.5) / columns) * wide - a[1];
        const s = (px * (c[1] - a[1]) - (c[0] - a[0]) * py) / full;
        const u = ((b[0] - a[0]) * py - px * (b[1] - a[1])) / full;
        if (s >= -1e-6 && u >= -1e-6 && s + u <= 1 + 1e-6) {
          corners.set(of, 3 * (r * columns + k));
          weights.set([s, u], 2 * (r * columns + k));
        }
      }
    }
  }

  const pad = { left: 34, right: 6, top: 6, bottom: 22 };
  const screens = [...film.querySelectorAll("canvas")].map((canvas) => {
    const small = document.createElement("canvas");
    small.width = columns;
    small.height = rows;
    const of = canvas.dataset.of;
    return {
      canvas,
      small,
      pixels: new ImageData(columns, rows),
      of,
      heading: canvas.closest(".screen").querySelector("h3"),
      limit: of === "difference" ? data.difference_limit : data.limit,
    };
  });
  const squares = film.querySelector(".squares");
  let frame = 0;

  const ticks = (low, high) => {
    const raw = (high - low) / 4;
    const power = 10 ** Math.floor(Math.log10(raw));
    const size = Math.max(1, [1, 2, 5, 10].map((f) => f * power).find((f) => f >= raw));
    const all = [];
    for (let v = Math.ceil(low / size) * size; v <= high; v += size) all.push(v);
    return all;
  };
  const draw = (screen) => {
    const { canvas, limit } = screen;
    const values = shown[screen.of];
    const whole = field && shown === posterior && screen.of === "estimate" && !squares.checked;
    const ratio = window.devicePixelRatio || 1;
    const width = canvas.clientWidth;
    if (!width) return;
    const scale = (width - pad.left - pad.right) / wide;
    const height = tall * scale + pad.top + pad.bottom;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
      canvas.style.height = height + "px";
    }
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.fillStyle = "#fff";
    pen.fillRect(0, 0, width, height);
    const across = (v) => pad.left + (left[0] - v) * scale;
    const down = (v) => pad.top + (forward[0] - v) * scale;
    screen.place = { across, down };
    const at = frame * drones;
    if (whole) {
      hatch(pen, [pad.left, pad.top, wide * scale, tall * scale]);
      paintField(screen.pixels.data, limit);
    } else if (data.triangles.length && !squares.checked) {
      const out = screen.pixels.data;
      for (let i = 0; i < columns * rows; i++) {
        const a = corners[3 * i];
        out[4 * i + 3] = 0;
        if (a < 0) continue;
        const [va, vb, vc] = [values[at + a], values[at + corners[3 * i + 1]], values[at + corners[3 * i + 2]]];
        if (va === NONE || vb === NONE || vc === NONE) continue;
        const k = 3 * step(va + weights[2 * i] * (vb - va) + weights[2 * i + 1] * (vc - va), limit);
        out[4 * i] = palette[k];
        out[4 * i + 1] = palette[k + 1];
        out[4 * i + 2] = palette[k + 2];
        out[4 * i + 3] = 255;
      }
    }
    if (whole || (data.triangles.length && !squares.checked)) {
      screen.small.getContext("2d").putImageData(screen.pixels, 0, 0);
      pen.imageSmoothingQuality = "high";
      pen.drawImage(screen.small, pad.left, pad.top, wide * scale, tall * scale);
    }
    const side = 0.92 * cell * scale;
    for (let i = 0; i < drones; i++) {
      if (!data.places[i]) continue;
      const [px, py] = [across(data.places[i][1]), down(data.places[i][0])];
      const value = values[at + i];
      if (value === NONE) {
        pen.strokeStyle = "#b4bcc4";
        pen.beginPath();
        for (const sign of [1, -1]) {
          pen.moveTo(px - 4, py - 4 * sign);
          pen.lineTo(px + 4, py + 4 * sign);
        }
        pen.stroke();
      } else if (!whole && (squares.checked || !data.triangles.length)) {
        pen.fillStyle = colour(value, limit);
        pen.fillRect(px - side / 2, py - side / 2, side, side);
      } else {
        pen.fillStyle = "rgba(31,41,51,0.45)";
        pen.fillRect(px - 1, py - 1, 2, 2);
      }
    }
    if (whole) {
      pen.strokeStyle = "rgba(31,41,51,0.6)";
      for (const place of lost) {
        pen.beginPath();
        pen.arc(across(place[1]), down(place[0]), 3.5, 0, 2 * Math.PI);
        pen.stroke();
      }
    }
    const picked = data.picks.indexOf(updraft.picked);
    if (data.places[picked]) {
      pen.strokeStyle = "#d55e00";
      pen.lineWidth = 2.5;
      pen.strokeRect(across(data.places[picked][1]) - side / 2, down(data.places[picked][0]) - side / 2, side, side);
      pen.lineWidth = 1;
    }
    pen.strokeStyle = "#b4bcc4";
    pen.strokeRect(pad.left + 0.5, pad.top + 0.5, wide * scale - 1, tall * scale - 1);
    pen.fillStyle = "#66727f";
    pen.font = "11px " + getComputedStyle(film).fontFamily;
    pen.textAlign = "center";
    for (const v of ticks(left[1], left[0])) pen.fillText(String(v).replace("-", "−"), across(v), height - 7);
    pen.textAlign = "right";
    for (const v of ticks(forward[1], forward[0])) pen.fillText(String(v).replace("-", "−"), pad.left - 5, down(v) + 4);
  };

  const slider = film.querySelector('input[type="range"]');
  const clock = film.querySelector(".clock");
  const reading = film.querySelector(".reading");
  const speed = film.querySelector("select");
  const button = film.querySelector(".play");
  const flight = film.id.replace("film-", "");
  slider.max = frames - 1;
  const signed = (mms) => {
    if (mms === NONE) return "no value";
    const text = (Math.abs(mms) / 1000).toFixed(2);
    return (text === "0.00" ? "" : mms < 0 ? "−" : "+") + text + " m/s";
  };
  let pointed = null;
  const read = () => {
    const at = frame * drones;
    if (pointed !== null) {
      const of = truth ? `, true ${signed(truth[at + pointed])}` : "";
      const own = signed(estimate[at + pointed]);
      const known = posterior && together[at + pointed] !== NONE;
      const error = known ? ` ± ${(sd[at + pointed] / 1000).toFixed(2)} m/s` : "";
      const words = posterior
        ? `posterior ${signed(together[at + pointed]).replace(known ? " m/s" : "", "")}${error}, alone ${own}`
        : own;
      reading.textContent = `${data.names[pointed]}: ${words}${of}`;
      return;
    }
    const all = Array.from(shown.estimate.subarray(at, at + drones)).filter((w) => w !== NONE);
    const mean = all.length ? all.reduce((a, b) => a + b, 0) / all.length : NONE;
    let text = `${shown === posterior ? "posterior " : ""}mean of ${updraft.drones(all.length)} ${signed(mean)}`;
    if (shown.difference) {
      const off = Array.from(shown.difference.subarray(at, at + drones)).filter((w) => w !== NONE);
      const rms = Math.sqrt(off.reduce((a, b) => a + b * b, 0) / Math.max(1, off.length));
      text += `, rms error ${(rms / 1000).toFixed(2)} m/s`;
    }
    reading.textContent = text;
  };
  const show = (index) => {
    frame = Math.max(0, Math.min(frames - 1, index));
    film.dataset.frame = frame;
    slider.value = frame;
    const s = data.times[frame];
    const words = `${String(Math.round(s)).replace("-", "−")} s`;
    clock.textContent = words;
    slider.setAttribute("aria-valuetext", `show time ${words}`);
    screens.forEach(draw);
    read();
    updraft.time(flight, s, film);
  };

  // Playing: show seconds pass `speed` times as fast as real ones.
  const calm = window.matchMedia("(prefers-reduced-motion: reduce)");
  let playing = false;
  let last = null;
  let now = 0;
  const stop = () => {
    playing = false;
    film.dataset.playing = "no";
    button.textContent = "▶ Play";
  };
  const tick = (time) => {
    if (!playing) return;
    if (last === null) last = time;
    // Who asked for less motion sees one still after the other, a second apart.
    if (!calm.matches || time - last >= 1000) {
      now += Math.min(1, (time - last) / 1000) * Number(speed.value);
      last = time;
      let index = frame;
      while (index < frames - 1 && data.times[index + 1] <= now) index++;
      if (index !== frame) show(index);
      if (index >= frames - 1) stop();
    }
    requestAnimationFrame(tick);
  };
  const toggle = () => {
    if (playing) return stop();
    if (frame >= frames - 1) show(0);
    playing = true;
    updraft.plays(film);
    film.dataset.playing = "yes";
    button.textContent = "❚❚ Pause";
    last = null;
    now = data.times[frame];
    requestAnimationFrame(tick);
  };
  const jump = (index) => {
    show(index);
    now = data.times[frame];
  };
  button.addEventListener("click", toggle);
  const choice = film.querySelector(".alone");
  choice?.addEventListener("click", () => {
    shown = shown === alone ? posterior : alone;
    choice.setAttribute("aria-pressed", String(shown === alone));
    for (const screen of screens) {
      if (shown.names[screen.of]) screen.heading.textContent = shown.names[screen.of];
      draw(screen);
    }
    read();
  });
  slider.addEventListener("input", () => jump(Number(slider.value)));
  squares.addEventListener("change", () => screens.forEach(draw));
  film.addEventListener("keydown", (event) => {
    const control = event.target.closest("button, select, input");
    const range = control === slider;
    if (event.key === " " && (!control || range)) toggle();
    else if (control && !range) return;
    else if (event.key === "ArrowRight") jump(frame + 1);
    else if (event.key === "ArrowLeft") jump(frame - 1);
    else if (event.key === "PageDown") jump(frame + 10);
    else if (event.key === "PageUp") jump(frame - 10);
    else if (event.key === "Home") jump(0);
    else if (event.key === "End") jump(frames - 1);
    else return;
    event.preventDefault();
  });
  for (const screen of screens) {
    screen.canvas.addEventListener("pointermove", (event) => {
      if (!screen.place) return;
      const reach = screen.canvas.getBoundingClientRect();
      const [px, py] = [event.clientX - reach.left, event.clientY - reach.top];
      let best = 40 ** 2;
      pointed = null;
      data.places.forEach((place, i) => {
        if (!place) return;
        const away = (screen.place.across(place[1]) - px) ** 2 + (screen.place.down(place[0]) - py) ** 2;
        if (away < best) [best, pointed] = [away, i];
      });
      read();
    });
    screen.canvas.addEventListener("click", () => pointed !== null && updraft.pick(data.picks[pointed], film));
    screen.canvas.addEventListener("pointerleave", () => {
      pointed = null;
      read();
    });
  }
  // What the other parts of the page show.
  document.addEventListener("updraft:pick", () => screens.forEach(draw));
  document.addEventListener("updraft:play", ({ detail }) => detail.from !== film && stop());
  document.addEventListener("updraft:time", ({ detail }) => {
    if (detail.flight !== flight || detail.from === film || playing) return;
    const after = data.times.findIndex((s) => s > detail.seconds);
    jump(after < 0 ? frames - 1 : Math.max(0, after - 1));
  });
  new ResizeObserver(() => screens.forEach(draw)).observe(film);
  stop();
  show(0);
}
