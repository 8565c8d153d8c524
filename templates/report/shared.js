// What the interactive parts of the page share: the picked drone, the time of each flight, and reading of data.
// `updraft:pick` and `updraft:time` are events of the document; `from` is the part that caused them.
const updraft = (() => {
  let picked = null;
  let telling = false;
  const tell = (name, detail) => {
    // What a part does because it was told is no news.
    if (telling) return;
    telling = true;
    document.dispatchEvent(new CustomEvent("updraft:" + name, { detail }));
    telling = false;
  };
  const flights = new Map();
  const waiting = new Map();
  const NONE = -32768;
  // Rows of `length` values: see src/report/delta.rs.
  const rows = (text, length, step) => {
    const bytes = atob(text);
    const all = [];
    let row = null;
    let sum = 0;
    for (let at = 0; at < bytes.length; ) {
      if (!row || row.length === length) all.push((row = [])), (sum = 0);
      let code = 0;
      let unit = 1;
      for (;;) {
        const byte = bytes.charCodeAt(at++);
        code += (byte & 127) * unit;
        unit *= 128;
        if (byte < 128) break;
      }
      if (code === 0) row.push(null);
      else {
        code -= 1;
        sum += code % 2 ? -(code + 1) / 2 : code / 2;
        row.push(sum * step);
      }
    }
    return all;
  };
  // The film's values: 16 bits, time by time.
  const filmed = (text, drones) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    const times = bytes.length / 2 / drones;
    return Array.from({ length: drones }, (_, drone) =>
      Array.from({ length: times }, (_, time) => {
        const value = view.getInt16(2 * (time * drones + drone), true);
        return value === NONE ? null : value / 1000;
      }),
    );
  };
  const airOf = (air) => {
    if (!air) return null;
    let times, estimate, posterior, sd, truth;
    if (air.film) {
      const film = JSON.parse(document.querySelector(`#${CSS.escape(air.film)} script`).textContent);
      const drones = film.places.length;
      times = film.times;
      estimate = filmed(film.estimate, drones);
      truth = film.truth && filmed(film.truth, drones);
      posterior = film.posterior && filmed(film.posterior.values, drones);
      sd = film.posterior && filmed(film.posterior.sd, drones);
    } else {
      times = air.times;
      const read = (text) => rows(text, times.length, 0.001);
      estimate = read(air.estimate);
      posterior = air.posterior && read(air.posterior[0]);
      sd = air.posterior && read(air.posterior[1]);
    }
    const [below, above] = (air.reach ?? [null, null]).map((text) => text && rows(text, times.length, 0.001));
    // From the map's drones to those of the flight.
    const spread = (of) => of && air.rows.map((row) => (row === null ? null : of[row]));
    const all = { times, estimate, posterior, sd, truth, below, above };
    for (const name of Object.keys(all)) if (name !== "times") all[name] = spread(all[name]);
    return all;
  };
  const tracksOf = (tracks) => {
    if (!tracks) return null;
    const read = (text, step) => text && rows(text, tracks.count, step);
    return {
      times: Array.from({ length: tracks.count }, (_, i) => tracks.start + i * tracks.step),
      step: tracks.step,
      place: tracks.place.map((text) => read(text, 0.01)),
      climb: read(tracks.climb, 0.01),
      effort: read(tracks.effort, 0.1),
    };
  };
  const rowOf = ({ air, tracks }, i) => {
    const row = (of) => of?.[i] ?? null;
    const { estimate, posterior, sd, truth, below, above } = air ?? {};
    return {
      air: air && {
        times: air.times,
        estimate: row(estimate),
        posterior: row(posterior),
        sd: row(sd),
        truth: row(truth),
        below: row(below),
        above: row(above),
      },
      tracks: tracks && {
        times: tracks.times,
        place: tracks.place.map(row),
        climb: row(tracks.climb),
        effort: row(tracks.effort),
      },
    };
  };
  return {
    rows,
    get picked() {
      return picked;
    },
    // Picks a drone everywhere; null picks none.
    pick(pick, from) {
      picked = pick === "" ? null : pick;
      tell("pick", { pick: picked, from });
    },
    // Tells the time that a part shows.
    time(flight, seconds, from) {
      tell("time", { flight, seconds, from });
    },
    // Tells that a part plays: others stop.
    plays(from) {
      tell("play", { from });
    },
    // The data of a flight, read once.
    flight(key) {
      if (!flights.has(key)) {
        const text = document.querySelector(`.explorer[data-flight="${CSS.escape(key)}"] script`).textContent;
        const data = JSON.parse(text);
        flights.set(key, { ...data, air: airOf(data.air), tracks: tracksOf(data.tracks), fine: new Map() });
      }
      return flights.get(key);
    },
    // Loads the file beside the page that has everything about a drone, if there is one.
    finely(key, drone, then) {
      const flight = this.flight(key);
      if (!flight.files || flight.fine.has(drone)) return;
      const file = `data/${key}-${Math.floor(drone / flight.files) + 1}.js`;
      const first = !waiting.has(file);
      if (first) waiting.set(file, []);
      waiting.get(file).push(then);
      if (!first) return;
      const script = document.createElement("script");
      script.addEventListener("load", () => {
        for (const then of waiting.get(file)) then();
        waiting.delete(file);
      });
      // Without the file the page goes on with what it has.
      script.setAttribute("src", file);
      document.head.append(script);
    },
    // Called by the files beside the page.
    detail(key, { first, air, tracks }) {
      const flight = this.flight(key);
      const some = { air: airOf(air), tracks: tracksOf(tracks) };
      const count = some.tracks ? some.tracks.climb.length : air.rows.length;
      for (let i = 0; i < count; i++) flight.fine.set(first + i, rowOf(some, i));
    },
    // What is known of one drone.
    drone(key, i) {
      const flight = this.flight(key);
      return flight.fine.get(i) ?? rowOf(flight, i);
    },
    // Index of the last time that is not later; -1 before the first.
    before(times, seconds) {
      let [low, high] = [-1, times.length - 1];
      while (low < high) {
        const middle = Math.ceil((low + high) / 2);
        if (times[middle] <= seconds) low = middle;
        else high = middle - 1;
      }
      return low;
    },
    // The value at a time, linear between its neighbours; null where one has none.
    at(times, values, seconds) {
      const i = this.before(times, seconds);
      if (i < 0 || !values) return null;
      if (times[i] === seconds || i === times.length - 1) return times[i] === seconds ? values[i] : null;
      if (values[i] === null || values[i + 1] === null) return null;
      return values[i] + ((seconds - times[i]) / (times[i + 1] - times[i])) * (values[i + 1] - values[i]);
    },
    // A colour of the scale, as red, green and blue.
    shade(colours, place) {
      const at = Math.max(0, Math.min(1, (place + 1) / 2)) * (colours.length - 1);
      const low = Math.min(Math.floor(at), colours.length - 2);
      const part = (of, c) => parseInt(colours[of].slice(1 + 2 * c, 3 + 2 * c), 16);
      return [0, 1, 2].map((c) => Math.round(part(low, c) + (at - low) * (part(low + 1, c) - part(low, c))));
    },
    // A number with its sign and a true minus.
    signed: (value, digits = 2) => {
      const text = Math.abs(value).toFixed(digits);
      return (Number(text) === 0 ? "" : value < 0 ? "−" : "+") + text;
    },
    // 1 drone, 2 drones.
    drones: (n) => `${n} ${n === 1 ? "drone" : "drones"}`,
    // Colours of the page, light or dark.
    ink: (element, name) => getComputedStyle(element).getPropertyValue("--" + name).trim() || "#888",
    // Begins with a part when it is near the window, or printed.
    near(element, begin) {
      let begun = false;
      const once = () => {
        if (begun) return;
        begun = true;
        watch.disconnect();
        begin();
      };
      const watch = new IntersectionObserver((seen) => seen.some((one) => one.isIntersecting) && once(), { rootMargin: "400px" });
      watch.observe(element);
      window.addEventListener("beforeprint", once);
    },
  };
})();
