// Every drone over time: lines or, of many drones, bands of the fleet, with the picked drone and its error band.
for (const chart of document.querySelectorAll(".series")) {
  updraft.near(chart, () => {
    const key = chart.closest(".explorer").dataset.flight;
    const flight = updraft.flight(key);
    const count = flight.names.length;
    const room = chart.querySelector(".plot");
    const reading = chart.querySelector(".reading");
    const choice = chart.querySelector(".quantity");
    const each = chart.querySelector(".each");
    const alone = chart.querySelector(".alone");
    const ink = (name) => updraft.ink(chart, name);
    each.checked = count <= 120;
    let now = (flight.air ?? flight.tracks).times[0];
    let plot = null;
    let hovered = -1;
    const picked = () => flight.picks.indexOf(updraft.picked);
    const together = () => choice.value === "air" && flight.air.posterior && alone.getAttribute("aria-pressed") !== "true";

    // The shown quantity: times of all drones, and what is known of one.
    const quantity = () => {
      const { air, tracks } = flight;
      if (choice.value === "air") {
        const name = together() ? "posterior" : "estimate";
        return { times: air.times, rows: air[name], unit: "m/s", digits: 2, signed: true, one: (drone) => [drone.air.times, drone.air[name]] };
      }
      const of = { climb: ["m/s", 2, true], height: ["m", 1, false], effort: [flight.effort[1], 1, false] }[choice.value];
      const rows = choice.value === "height" ? tracks.place[2] : tracks[choice.value];
      return {
        times: tracks.times,
        rows: rows ?? [],
        unit: of[0],
        digits: of[1],
        signed: of[2],
        one: ({ tracks }) => [tracks.times, choice.value === "height" ? tracks.place[2] : tracks[choice.value]],
      };
    };
    let shown = null;
    const known = (time) => shown.rows.map((row) => row?.[time] ?? null).filter((v) => v !== null);
    const summed = () => {
      shown = quantity();
      shown.mean = shown.times.map((_, time) => {
        const all = known(time);
        return all.length ? all.reduce((a, b) => a + b, 0) / all.length : null;
      });
    };
    // From the lowest of 5, 25, 75 and 95 % to the highest, at each time.
    const bands = () => {
      shown.bands ??= shown.times.map((_, time) => {
        const all = Float64Array.from(known(time)).sort();
        return all.length ? [0.05, 0.25, 0.75, 0.95].map((share) => all[Math.round(share * (all.length - 1))]) : null;
      });
      return shown.bands;
    };
    // The picked drone: its times, values and the ends of its error band.
    const one = () => {
      const i = picked();
      if (i < 0) return null;
      const drone = updraft.drone(key, i);
      const [times, values] = shown.one(drone);
      if (!values) return null;
      let ends = null;
      if (choice.value === "air") {
        const { sd, below, above } = drone.air;
        if (together() && sd) ends = values.map((v, t) => (v === null || sd[t] === null ? null : [v - 1.96 * sd[t], v + 1.96 * sd[t]]));
        else if (!together() && below) ends = values.map((v, t) => (v === null || below[t] === null ? null : [v - below[t], v + above[t]]));
      }
      return { i, times, values, ends, truth: choice.value === "air" ? drone.air.truth : null };
    };

    // The values between two times, with a margin.
    const range = (min, max) => {
      let [low, high] = [Infinity, -Infinity];
      const take = (v) => {
        if (v !== null && v < low) low = v;
        if (v !== null && v > high) high = v;
      };
      const within = (times, each) => times.forEach((s, t) => s >= min && s <= max && each(t));
      within(shown.times, (t) => {
        if (each.checked) for (const row of shown.rows) take(row?.[t] ?? null);
        else bands()[t]?.forEach(take);
      });
      const drone = one();
      if (drone) {
        within(drone.times, (t) => {
          take(drone.values[t]);
          drone.ends?.[t]?.forEach(take);
        });
      }
      if (low > high) return [-1, 1];
      const margin = 0.05 * (high - low) || 0.5;
      return [low - margin, high + margin];
    };

    const clipped = (u, draw) => {
      const { left, top, width, height } = u.bbox;
      u.ctx.save();
      u.ctx.beginPath();
      u.ctx.rect(left, top, width, height);
      u.ctx.clip();
      draw(u.ctx, devicePixelRatio);
      u.ctx.restore();
    };
    // A line through the values that are there.
    const line = (u, times, values) => {
      const path = new Path2D();
      const { min, max } = u.scales.x;
      let drawn = false;
      for (let t = 0; t < times.length; t++) {
        const near = (times[t + 1] ?? times[t]) >= min && (times[t - 1] ?? times[t]) <= max;
        const value = values[t];
        if (value === null || value === undefined || !near) drawn = false;
        else {
          const [x, y] = [u.valToPos(times[t], "x", true), u.valToPos(value, "y", true)];
          if (drawn) path.lineTo(x, y);
          else path.moveTo(x, y);
          drawn = true;
        }
      }
      return path;
    };
    const area = (u, times, ends, low, high) => {
      const path = new Path2D();
      const close = (from, to) => {
        for (let t = from; t < to; t++) path[t === from ? "moveTo" : "lineTo"](u.valToPos(times[t], "x", true), u.valToPos(ends[t][high], "y", true));
        for (let t = to - 1; t >= from; t--) path.lineTo(u.valToPos(times[t], "x", true), u.valToPos(ends[t][low], "y", true));
        path.closePath();
      };
      let from = -1;
      for (let t = 0; t <= times.length; t++) {
        const here = t < times.length && ends[t];
        if (here && from < 0) from = t;
        if (!here && from >= 0) {
          close(from, t);
          from = -1;
        }
      }
      return path;
    };
    const crowd = (u) =>
      clipped(u, (pen, ratio) => {
        pen.lineWidth = ratio;
        if (each.checked) {
          pen.strokeStyle = ink("muted");
          pen.globalAlpha = Math.max(0.12, Math.min(0.5, 12 / count));
          for (const row of shown.rows) if (row) pen.stroke(line(u, shown.times, row));
        } else {
          pen.fillStyle = ink("muted");
          pen.globalAlpha = 0.2;
          pen.fill(area(u, shown.times, bands(), 0, 3));
          pen.fill(area(u, shown.times, bands(), 1, 2));
        }
      });
    const front = (u) =>
      clipped(u, (pen, ratio) => {
        const drone = one();
        if (!drone) return;
        pen.strokeStyle = pen.fillStyle = ink("warn");
        if (drone.ends) {
          pen.globalAlpha = 0.22;
          pen.fill(area(u, drone.times, drone.ends, 0, 1));
        }
        pen.globalAlpha = 1;
        pen.lineWidth = 2 * ratio;
        pen.stroke(line(u, drone.times, drone.values));
        if (drone.truth) {
          pen.strokeStyle = ink("accent");
          pen.setLineDash([5 * ratio, 4 * ratio]);
          pen.lineWidth = 1.5 * ratio;
          pen.stroke(line(u, drone.times, drone.truth));
        }
      });

    summed();
    const said = (value) => {
      if (value === null || value === undefined) return "no value";
      return (shown.signed ? updraft.signed(value, shown.digits) : value.toFixed(shown.digits).replace("-", "−")) + " " + shown.unit;
    };
    const font = "12px " + getComputedStyle(chart).fontFamily;
    const axis = (more) => ({
      stroke: () => ink("muted"),
      font,
      labelFont: font,
      labelSize: 18,
      grid: { stroke: () => ink("rule"), width: 1 },
      ticks: { stroke: () => ink("rule"), width: 1 },
      values: (u, all) => all.map((v) => (v === null ? "" : String(v).replace("-", "−"))),
      ...more,
    });
    const height = () => Math.max(220, Math.min(340, 0.5 * room.clientWidth));
    plot = new uPlot(
      {
        width: room.clientWidth,
        height: height(),
        legend: { show: false },
        cursor: { y: false, points: { show: false }, drag: { x: true, y: false, dist: 5 } },
        scales: { x: { time: false }, y: { auto: false } },
        axes: [axis({ label: "show time (s)", size: 34 }), axis({ size: 56, label: () => `${choice.selectedOptions[0].textContent.replace(/ \(.*/, "")} (${shown.unit})` })],
        series: [{}, { stroke: () => ink("ink"), width: 1.5, points: { show: false } }],
        hooks: {
          drawAxes: [crowd],
          draw: [front],
          setCursor: [(u) => point(u)],
          setScale: [
            (u, name) => {
              if (name !== "x") return;
              chart.dataset.from = u.scales.x.min;
              chart.dataset.to = u.scales.x.max;
              const [min, max] = range(u.scales.x.min, u.scales.x.max);
              u.setScale("y", { min, max });
              settle();
            },
          ],
        },
      },
      [shown.times, shown.mean],
      room,
    );
    const mark = (name) => {
      const made = document.createElement("div");
      made.className = name;
      made.hidden = true;
      plot.over.append(made);
      return made;
    };
    const [nowLine, dot] = [mark("now"), mark("dot")];
    function settle() {
      if (!plot) return;
      const { min, max } = plot.scales.x;
      nowLine.hidden = now < min || now > max;
      if (!nowLine.hidden) nowLine.style.transform = `translateX(${plot.valToPos(now, "x")}px)`;
    }

    // The drone whose value is closest to the cursor.
    const closest = (u) => {
      const { left, top, idx } = u.cursor;
      if (left < 0 || idx === null || idx === undefined) return -1;
      let [best, found] = [30, -1];
      shown.rows.forEach((row, i) => {
        if (!row || row[idx] === null || row[idx] === undefined) return;
        const away = Math.abs(u.valToPos(row[idx], "y") - top) - (i === picked() ? 2 : 0);
        if (away < best) [best, found] = [away, i];
      });
      return found;
    };
    const read = () => {
      const i = hovered >= 0 ? hovered : picked();
      const time = hovered >= 0 ? shown.times[plot.cursor.idx] : now;
      const t = updraft.before(shown.times, time);
      const all = t < 0 ? [] : known(t);
      const fleet = all.length ? `mean of ${updraft.drones(all.length)} ${said(shown.mean[t])}` : "no values";
      let words = "";
      if (i >= 0) {
        const drone = updraft.drone(key, i);
        const [times, values] = shown.one(drone);
        words = `${flight.names[i]}: ${said(values?.[updraft.before(times, time)])}`;
        const mine = i === picked() ? one() : null;
        const ends = mine?.ends?.[updraft.before(mine.times, time)];
        if (ends) words += ` (95 %: ${updraft.signed(ends[0])} to ${updraft.signed(ends[1])})`;
        words += "; ";
      }
      reading.textContent = `${Math.round(time).toString().replace("-", "−")} s: ${words}${fleet}`;
    };
    let at = [];
    const point = (u) => {
      const { left, top } = u.cursor;
      // What is drawn anew below a pointer that rests is not pointed at.
      if (left !== at[0] || top !== at[1]) hovered = closest(u);
      at = [left, top];
      chart.dataset.hovered = hovered < 0 ? "" : flight.names[hovered];
      dot.hidden = hovered < 0;
      if (hovered >= 0) {
        const idx = u.cursor.idx;
        dot.style.transform = `translate(${u.valToPos(shown.times[idx], "x")}px, ${u.valToPos(shown.rows[hovered][idx], "y")}px)`;
      }
      read();
    };

    const unpoint = () => {
      hovered = -1;
      dot.hidden = true;
      chart.dataset.hovered = "";
    };

    const ends = () => [shown.times[0], shown.times[shown.times.length - 1]];
    const view = (min, max) => {
      const [first, last] = ends();
      const least = Math.min(last - first, 4);
      // Before the first drawing there is no view yet.
      let [from, to] = [Math.max(first, min ?? first), Math.min(last, max ?? last)];
      if (to - from < least) to = Math.min(last, from + least);
      const [low, high] = range(from, to);
      plot.batch(() => {
        plot.setScale("x", { min: from, max: to });
        plot.setScale("y", { min: low, max: high });
      });
    };
    const zoom = (factor, centre) => {
      const { min, max } = plot.scales.x;
      const at = centre ?? (now > min && now < max ? now : (min + max) / 2);
      view(at - (at - min) * factor, at + (max - at) * factor);
    };
    const go = (seconds) => {
      const [first, last] = ends();
      now = Math.max(first, Math.min(last, seconds));
      settle();
      read();
      updraft.time(key, now, chart);
    };
    const pickNext = (step) => {
      const i = picked();
      updraft.pick(flight.picks[i < 0 ? (step > 0 ? 0 : count - 1) : (i + step + count) % count], chart);
    };
    let pressed = null;
    plot.over.addEventListener("mousedown", (event) => {
      pressed = [event.clientX, event.clientY];
      chart.focus({ preventScroll: true });
    });
    plot.over.addEventListener("click", (event) => {
      if (!pressed || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) return;
      const time = shown.times[plot.cursor.idx];
      if (hovered >= 0) updraft.pick(flight.picks[hovered], chart);
      if (time !== undefined) go(time);
    });
    plot.over.addEventListener(
      "wheel",
      (event) => {
        // The page scrolls on, unless one works in the chart.
        if (!event.ctrlKey && !chart.contains(document.activeElement)) return;
        event.preventDefault();
        zoom(1.0015 ** event.deltaY, plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));
      },
      { passive: false },
    );
    chart.addEventListener("keydown", (event) => {
      if (event.target.closest("select, input, button")) return;
      const step = shown.times[1] - shown.times[0];
      const at = now;
      const keys = {
        ArrowRight: () => go(at + step),
        ArrowLeft: () => go(at - step),
        PageDown: () => go(at + 10 * step),
        PageUp: () => go(at - 10 * step),
        Home: () => go(ends()[0]),
        End: () => go(ends()[1]),
        ArrowDown: () => pickNext(1),
        ArrowUp: () => pickNext(-1),
        "+": () => zoom(0.7),
        "=": () => zoom(0.7),
        "-": () => zoom(1 / 0.7),
        0: () => view(...ends()),
        Escape: () => view(...ends()),
      };
      if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
      keys[event.key]();
      event.preventDefault();
    });
    const renew = () => {
      summed();
      const { min, max } = plot.scales.x;
      plot.setData([shown.times, shown.mean], false);
      const [first, last] = ends();
      if (min >= first && max <= last && max - min < last - first) view(min, max);
      else view(first, last);
      settle();
      read();
    };
    chart.querySelector(".closer").addEventListener("click", () => zoom(0.7));
    chart.querySelector(".wider").addEventListener("click", () => zoom(1 / 0.7));
    chart.querySelector(".whole").addEventListener("click", () => view(...ends()));
    choice.addEventListener("change", () => {
      if (alone) alone.hidden = choice.value !== "air";
      renew();
    });
    each.addEventListener("change", () => view(plot.scales.x.min, plot.scales.x.max));
    alone?.addEventListener("click", () => {
      alone.setAttribute("aria-pressed", String(alone.getAttribute("aria-pressed") !== "true"));
      renew();
    });
    const pickChanged = () => {
      const i = picked();
      if (i !== hovered) unpoint();
      chart.dataset.picked = i < 0 ? "" : flight.names[i];
      view(plot.scales.x.min, plot.scales.x.max);
      read();
      if (i >= 0) updraft.finely(key, i, pickChanged);
    };
    document.addEventListener("updraft:pick", pickChanged);
    document.addEventListener("updraft:time", ({ detail }) => {
      if (detail.flight !== key || detail.from === chart) return;
      unpoint();
      now = detail.seconds;
      settle();
      read();
    });
    new ResizeObserver(() => {
      if (!room.clientWidth) return;
      plot.setSize({ width: room.clientWidth, height: height() });
      settle();
    }).observe(room);
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => plot.redraw(false));
    chart.dataset.ready = "yes";
    pickChanged();
  });
}
