// The tracks of a flight in space, drawn in parallel perspective: lengths compare wherever they are.
for (const replay of document.querySelectorAll(".replay")) {
  updraft.near(replay, () => {
    const key = replay.closest(".explorer").dataset.flight;
    const flight = updraft.flight(key);
    const { tracks, air, limit, colours } = flight;
    const count = flight.names.length;
    const canvas = replay.querySelector("canvas");
    const slider = replay.querySelector('input[type="range"]');
    const clock = replay.querySelector(".clock");
    const button = replay.querySelector(".play");
    const speed = replay.querySelector(".speed");
    const trail = replay.querySelector(".trail");
    const reading = replay.querySelector(".reading");
    const times = tracks.times;
    const last = times[times.length - 1];
    // What the colours stand for: the air where it was measured, else the climb.
    const [shadeTimes, shadeRows] = air ? [air.times, air.posterior ?? air.estimate] : [times, tracks.climb];
    const north = (Number(replay.dataset.turn) * Math.PI) / 180;
    let now = times[0];
    let [turn, tilt, zoom] = [-0.6, 0.5, 1];
    let playing = false;
    let visible = true;

    // Colours along each track, as steps of the scale; 255 is no value.
    const steps = colours.length - 1;
    const rgb = colours.map((_, i) => updraft.shade(colours, (2 * i) / steps - 1));
    const along = Array.from({ length: count }, (_, i) =>
      Uint8Array.from(times, (time) => {
        const value = updraft.at(shadeTimes, shadeRows[i], time);
        return value === null ? 255 : Math.round((Math.max(-1, Math.min(1, value / limit)) + 1) * (steps / 2));
      }),
    );

    // Where the drones were: nearly all of it, so that one wrong place does not hide the rest.
    const reach = tracks.place.map((rows) => {
      const stride = Math.max(1, Math.floor((count * times.length) / 20000));
      const some = rows.flatMap((row) => (row ?? []).filter((v, t) => v !== null && t % stride === 0)).sort((a, b) => a - b);
      if (!some.length) return [0, 1];
      return [some[Math.floor(0.002 * (some.length - 1))], some[Math.ceil(0.998 * (some.length - 1))]];
    });
    const widest = Math.max(reach[0][1] - reach[0][0], reach[1][1] - reach[1][0], 5);
    const nice = (raw) => {
      const power = 10 ** Math.floor(Math.log10(raw));
      return [1, 2, 5, 10].map((f) => f * power).find((f) => f >= raw);
    };
    const cell = nice(Math.max(widest / 8, reach[2][1] / 30));
    const ground = [0, 1].map((axis) => [Math.floor(reach[axis][0] / cell - 0.5) * cell, Math.ceil(reach[axis][1] / cell + 0.5) * cell]);
    const top = Math.max(reach[2][1], cell);
    const centre = [(ground[0][0] + ground[0][1]) / 2, (ground[1][0] + ground[1][1]) / 2, top / 2];
    // The arrow to the north begins where the ground ends, and its sign lies ahead of it.
    const halves = [ground[0][1] - centre[0], ground[1][1] - centre[1]];
    const edge = Math.min(halves[0] / Math.max(1e-9, Math.abs(Math.cos(north))), halves[1] / Math.max(1e-9, Math.abs(Math.sin(north))));
    const around = Math.max(Math.hypot(...halves), edge + 1.9 * cell);
    replay.querySelector(".cell").textContent = `${cell} m`;

    // A picture of the ground, if the map has one.
    const below = document.querySelector(`#map-${CSS.escape(key)} image.basemap, #posterior-${CSS.escape(key)} image.basemap`);
    let picture = null;
    if (below) {
      picture = new Image();
      picture.addEventListener("load", () => draw());
      picture.src = below.getAttribute("href");
      picture.corners = JSON.parse(below.dataset.corners);
    }

    let view = null;
    const look = () => {
      const [width, height] = [canvas.clientWidth, canvas.clientHeight];
      const [sin, cos, sinTilt, cosTilt] = [Math.sin(turn), Math.cos(turn), Math.sin(tilt), Math.cos(tilt)];
      // All of it fits, however it is turned.
      const scale = zoom * 0.45 * Math.min(width / around, height / (around * sinTilt + (top / 2) * cosTilt));
      view = {
        width,
        height,
        // Right, down and away from whoever looks, pixels; forward lies ahead where nothing is turned.
        x: (x, y) => width / 2 + scale * (sin * (x - centre[0]) - cos * (y - centre[1])),
        y: (x, y, z) => height / 2 - scale * (sinTilt * (cos * (x - centre[0]) + sin * (y - centre[1])) + cosTilt * (z - centre[2])),
        depth: (x, y, z) => cosTilt * (cos * x + sin * y) - sinTilt * z,
      };
    };
    const placeOf = (i, time) => {
      if (flight.fine.has(i)) {
        const own = flight.fine.get(i).tracks;
        return own && own.place.map((axis) => updraft.at(own.times, axis, time));
      }
      return tracks.place.map((rows) => updraft.at(times, rows[i], time));
    };
    const valueOf = (i, time) => {
      const own = flight.fine.get(i);
      if (!own) return updraft.at(shadeTimes, shadeRows[i], time);
      return air ? own.air && updraft.at(own.air.times, own.air.posterior ?? own.air.estimate, time) : updraft.at(own.tracks.times, own.tracks.climb, time);
    };

    let markers = [];
    const line = (pen, from, to) => {
      pen.moveTo(view.x(from[0], from[1]), view.y(...from));
      pen.lineTo(view.x(to[0], to[1]), view.y(...to));
    };
    const drawGround = (pen, ink) => {
      const [[back, front], [right, left]] = ground;
      if (picture?.complete && picture.naturalWidth) {
        const [a, b, c] = picture.corners.map(([x, y]) => [view.x(x, y), view.y(x, y, 0)]);
        pen.save();
        pen.globalAlpha = 0.55;
        // Its ground alone.
        pen.beginPath();
        for (const [x, y] of [[back, right], [back, left], [front, left], [front, right]]) pen.lineTo(view.x(x, y), view.y(x, y, 0));
        pen.clip();
        const [w, h] = [picture.naturalWidth, picture.naturalHeight];
        pen.transform((b[0] - a[0]) / w, (b[1] - a[1]) / w, (c[0] - a[0]) / h, (c[1] - a[1]) / h, a[0], a[1]);
        pen.drawImage(picture, 0, 0);
        pen.restore();
      }
      pen.strokeStyle = ink.rule;
      pen.lineWidth = 1;
      pen.beginPath();
      for (let x = back; x <= front + 1e-6; x += cell) line(pen, [x, right, 0], [x, left, 0]);
      for (let y = right; y <= left + 1e-6; y += cell) line(pen, [back, y, 0], [front, y, 0]);
      pen.stroke();
      // North, beside the ground.
      const middle = [centre[0], centre[1]];
      const ahead = [Math.cos(north), Math.sin(north)];
      const at = (along, aside) => [middle[0] + ahead[0] * along - ahead[1] * aside, middle[1] + ahead[1] * along + ahead[0] * aside, 0];
      const [tail, tip] = [edge + 0.2 * cell, edge + 1.1 * cell];
      pen.strokeStyle = pen.fillStyle = ink.muted;
      pen.lineWidth = 1.5;
      pen.beginPath();
      line(pen, at(tail, 0), at(tip, 0));
      line(pen, at(tip, 0), at(tip - 0.4 * cell, 0.25 * cell));
      line(pen, at(tip, 0), at(tip - 0.4 * cell, -0.25 * cell));
      pen.stroke();
      const sign = at(tip + 0.5 * cell, 0);
      pen.textAlign = "center";
      pen.fillText("N", view.x(sign[0], sign[1]), view.y(...sign) + 4);
      // Heights, at the corner that is farthest to the left.
      const corners = [[back, right], [back, left], [front, left], [front, right]];
      const foot = corners.reduce((a, b) => (view.x(...a) <= view.x(...b) ? a : b));
      if (Math.cos(tilt) > 0.2) {
        pen.beginPath();
        line(pen, [...foot, 0], [...foot, top]);
        pen.stroke();
        pen.textAlign = "right";
        const step = nice(top / 5);
        const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
        for (let i = 0; i * step <= top + 1e-6; i++) pen.fillText(`${(i * step).toFixed(digits)} m`, view.x(...foot) - 6, view.y(...foot, i * step) + 4);
      }
    };
    const drawTrails = (pen, ink) => {
      const seconds = Number(trail.value);
      if (!seconds) return;
      const to = updraft.before(times, now);
      const from = Math.max(0, updraft.before(times, now - seconds));
      const paths = new Map();
      for (let i = 0; i < count; i++) {
        const [xs, ys, zs] = tracks.place.map((rows) => rows[i]);
        if (!xs || !zs) continue;
        for (let t = from; t < to; t++) {
          if (xs[t] === null || xs[t + 1] === null || zs[t] === null || zs[t + 1] === null) continue;
          const shade = along[i][t + 1];
          if (!paths.has(shade)) paths.set(shade, new Path2D());
          const path = paths.get(shade);
          path.moveTo(view.x(xs[t], ys[t]), view.y(xs[t], ys[t], zs[t]));
          path.lineTo(view.x(xs[t + 1], ys[t + 1]), view.y(xs[t + 1], ys[t + 1], zs[t + 1]));
        }
      }
      pen.lineWidth = 1.6;
      pen.globalAlpha = 0.8;
      for (const [shade, path] of paths) {
        pen.strokeStyle = shade === 255 ? ink.rule : `rgb(${rgb[shade]})`;
        pen.stroke(path);
      }
      pen.globalAlpha = 1;
    };
    const draw = () => {
      const ratio = devicePixelRatio || 1;
      const [width, height] = [canvas.clientWidth, canvas.clientHeight];
      if (!width || !visible) return;
      if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
        canvas.width = Math.round(width * ratio);
        canvas.height = Math.round(height * ratio);
      }
      look();
      const pen = canvas.getContext("2d");
      const ink = Object.fromEntries(["paper", "ink", "muted", "rule", "warn"].map((name) => [name, updraft.ink(replay, name)]));
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      pen.fillStyle = ink.paper;
      pen.fillRect(0, 0, width, height);
      pen.font = "12px " + getComputedStyle(replay).fontFamily;
      drawGround(pen, ink);
      drawTrails(pen, ink);
      const picked = flight.picks.indexOf(updraft.picked);
      markers = [];
      for (let i = 0; i < count; i++) {
        const place = placeOf(i, now);
        if (!place || place.includes(null)) continue;
        markers.push({ i, place, at: [view.x(place[0], place[1]), view.y(...place)], depth: view.depth(...place), value: valueOf(i, now) });
      }
      markers.sort((a, b) => b.depth - a.depth);
      // What shows nothing but drones on the ground is not printed.
      replay.classList.toggle("grounded", !markers.some((one) => one.place[2] > 1));
      const size = count > 400 ? 2.5 : count > 100 ? 3.5 : 5;
      for (const one of markers) {
        const [x, y] = one.at;
        const chosen = one.i === picked;
        one.colour = one.value === null ? null : updraft.shade(colours, one.value / limit);
        if (chosen) {
          // Where it is above the ground.
          pen.strokeStyle = ink.warn;
          pen.lineWidth = 1;
          pen.beginPath();
          line(pen, one.place, [one.place[0], one.place[1], 0]);
          pen.stroke();
        }
        pen.beginPath();
        pen.arc(x, y, chosen ? size + 3 : size, 0, 2 * Math.PI);
        pen.fillStyle = one.colour ? `rgb(${one.colour})` : ink.paper;
        pen.fill();
        pen.strokeStyle = chosen ? ink.warn : ink.muted;
        pen.lineWidth = chosen ? 2.5 : 0.8;
        pen.stroke();
      }
      const chosen = markers.find((one) => one.i === picked);
      if (chosen) {
        pen.fillStyle = ink.ink;
        pen.textAlign = "left";
        pen.lineWidth = 3;
        pen.strokeStyle = ink.paper;
        for (const way of ["strokeText", "fillText"]) pen[way](flight.names[picked], chosen.at[0] + size + 8, chosen.at[1] + 4);
      }
    };
    // For whoever wants to know what is where.
    replay.markers = () => markers;

    const words = (value) => (value === null ? "no value" : `${air ? "W" : "climb"} ${updraft.signed(value)} m/s`);
    const read = () => {
      const i = flight.picks.indexOf(updraft.picked);
      const values = markers.map((one) => one.value).filter((v) => v !== null);
      const mean = values.length ? values.reduce((a, b) => a + b, 0) / values.length : null;
      let text = `mean of ${updraft.drones(values.length)}: ${words(mean)}`;
      if (i >= 0) {
        const place = placeOf(i, now);
        const height = place && place[2] !== null ? `, ${place[2].toFixed(1).replace("-", "−")} m above its home` : "";
        text = `${flight.names[i]}: ${words(valueOf(i, now))}${height}; ` + text;
      }
      reading.textContent = text;
    };
    const show = (seconds, quiet) => {
      now = Math.max(times[0], Math.min(last, seconds));
      const said = `${Math.round(now).toString().replace("-", "−")} s`;
      slider.value = now;
      clock.textContent = said;
      slider.setAttribute("aria-valuetext", `show time ${said}`);
      replay.dataset.time = now;
      draw();
      read();
      if (!quiet) updraft.time(key, now, replay);
    };
    const rotate = (aside, up) => {
      turn += aside;
      tilt = Math.max(0.05, Math.min(Math.PI / 2, tilt + up));
      replay.dataset.turned = `${turn.toFixed(3)} ${tilt.toFixed(3)} ${zoom.toFixed(3)}`;
      draw();
    };
    const magnify = (factor) => {
      zoom = Math.max(0.4, Math.min(30, zoom * factor));
      rotate(0, 0);
    };

    const calm = window.matchMedia("(prefers-reduced-motion: reduce)");
    let [before, told] = [null, 0];
    const stop = () => {
      if (playing) updraft.time(key, now, replay);
      playing = false;
      replay.dataset.playing = "no";
      button.textContent = "▶ Play";
    };
    const tick = (time) => {
      if (!playing) return;
      before ??= time;
      // Who asked for less motion sees one still after the other, a second apart.
      if (!calm.matches || time - before >= 1000) {
        const seconds = now + Math.min(1, (time - before) / 1000) * Number(speed.value);
        before = time;
        // The other parts follow ten times a second.
        const tell = time - told >= 100;
        if (tell) told = time;
        show(seconds, !tell);
        if (now >= last) stop();
      }
      requestAnimationFrame(tick);
    };
    const toggle = () => {
      if (playing) return stop();
      if (now >= last) show(times[0]);
      playing = true;
      updraft.plays(replay);
      replay.dataset.playing = "yes";
      button.textContent = "❚❚ Pause";
      before = null;
      requestAnimationFrame(tick);
    };
    slider.min = times[0];
    slider.max = last;
    slider.step = tracks.step;
    button.addEventListener("click", toggle);
    slider.addEventListener("input", () => show(Number(slider.value)));
    trail.addEventListener("change", draw);
    replay.querySelector(".closer").addEventListener("click", () => magnify(1.3));
    replay.querySelector(".wider").addEventListener("click", () => magnify(1 / 1.3));
    replay.querySelector(".above").addEventListener("click", () => {
      [turn, tilt] = [0, Math.PI / 2];
      rotate(0, 0);
    });
    replay.addEventListener("keydown", (event) => {
      const control = event.target.closest("button, select, input");
      if (event.key === " " && (!control || control === slider)) toggle();
      else if (control || event.ctrlKey || event.metaKey || event.altKey) return;
      else if (event.key === "ArrowRight") rotate(0.1, 0);
      else if (event.key === "ArrowLeft") rotate(-0.1, 0);
      else if (event.key === "ArrowUp") rotate(0, 0.1);
      else if (event.key === "ArrowDown") rotate(0, -0.1);
      else if (event.key === "+" || event.key === "=") magnify(1.3);
      else if (event.key === "-") magnify(1 / 1.3);
      else if (event.key === "PageDown") show(now + 10);
      else if (event.key === "PageUp") show(now - 10);
      else if (event.key === "Home") show(times[0]);
      else if (event.key === "End") show(last);
      else return;
      event.preventDefault();
    });

    // One pointer turns, two magnify.
    const pointers = new Map();
    let moved = 0;
    const apart = () => {
      const [a, b] = [...pointers.values()];
      return Math.hypot(a[0] - b[0], a[1] - b[1]);
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (!pointers.size) moved = 0;
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      canvas.setPointerCapture(event.pointerId);
      replay.focus({ preventScroll: true });
    });
    canvas.addEventListener("pointermove", (event) => {
      const from = pointers.get(event.pointerId);
      if (!from) return;
      const step = [event.clientX - from[0], event.clientY - from[1]];
      const wide = pointers.size > 1 ? apart() : null;
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      moved += Math.hypot(...step);
      if (wide) magnify(apart() / Math.max(1, wide));
      else if (moved > 4) rotate(-0.008 * step[0], 0.008 * step[1]);
    });
    const lift = (event) => {
      const tapped = pointers.delete(event.pointerId) && event.type === "pointerup" && !pointers.size && moved <= 4;
      if (!tapped) return;
      const edge = canvas.getBoundingClientRect();
      let [best, found] = [20, null];
      for (const one of markers) {
        const away = Math.hypot(one.at[0] - event.clientX + edge.left, one.at[1] - event.clientY + edge.top);
        if (away <= best) [best, found] = [away, one.i];
      }
      if (found !== null) updraft.pick(flight.picks[found], replay);
    };
    canvas.addEventListener("pointerup", lift);
    canvas.addEventListener("pointercancel", lift);
    canvas.addEventListener(
      "wheel",
      (event) => {
        // The page scrolls on, unless one works in the replay.
        if (!event.ctrlKey && !replay.contains(document.activeElement)) return;
        event.preventDefault();
        magnify(1.0015 ** -event.deltaY);
      },
      { passive: false },
    );
    const pickChanged = () => {
      const i = flight.picks.indexOf(updraft.picked);
      replay.dataset.picked = i < 0 ? "" : flight.names[i];
      draw();
      read();
      if (i >= 0) updraft.finely(key, i, pickChanged);
    };
    document.addEventListener("updraft:pick", pickChanged);
    document.addEventListener("updraft:play", ({ detail }) => detail.from !== replay && stop());
    document.addEventListener("updraft:time", ({ detail }) => {
      if (detail.flight === key && detail.from !== replay && !playing) show(detail.seconds, true);
    });
    new IntersectionObserver((seen) => {
      visible = seen[seen.length - 1].isIntersecting;
      draw();
    }).observe(canvas);
    new ResizeObserver(draw).observe(canvas);
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
    window.addEventListener("beforeprint", draw);
    stop();
    rotate(0, 0);
    show(air ? Math.max(times[0], air.times[0]) : times[0], true);
    replay.dataset.ready = "yes";
    pickChanged();
  });
}
