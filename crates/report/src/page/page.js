"use strict";
// Adds to a complete page: values under the pointer, zoom and pan of panels, of all with a common axis together, curves that can be
// hidden, and tables that can be sorted.
(() => {
  const SVG = "http://www.w3.org/2000/svg", WIDTH = 1000, HEIGHT = 200;
  const make = (name, attributes, text) => {
    const node = document.createElementNS(SVG, name);
    for (const key in attributes) node.setAttribute(key, attributes[key]);
    if (text !== undefined) node.textContent = text;
    return node;
  };
  const button = (text, label, action) => {
    const node = document.createElement("button");
    node.type = "button"; node.textContent = text;
    if (label) { node.title = label; node.setAttribute("aria-label", label); }
    node.addEventListener("click", action);
    return node;
  };

  // Ticks at multiples of 1, 2 or 5 times a power of ten, as in the static drawing.
  const linear = ([low, high], most) => {
    const least = (high - low) / most, power = 10 ** Math.floor(Math.log10(least));
    const step = [1, 2, 5, 10].map(k => k * power).find(s => s >= least * (1 - 1e-12));
    const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step && found.length < 20; k++) {
      const value = k * step, plain = places <= 5 && Math.max(Math.abs(low), Math.abs(high)) < 1e6;
      const digits = Math.min(15, Math.max(0, Math.floor(Math.log10(Math.abs(value))) - Math.floor(Math.log10(step))));
      const text = plain ? value.toFixed(places) : value === 0 ? "0" : value.toExponential(digits).replace("e+", "e");
      found.push([value, text.replaceAll("-", "\u2212")]);
    }
    return found;
  };

  // Ticks of a logarithmic axis, whose range has decimal logarithms.
  const raised = number => [...String(number)].map(c => c === "-" ? "\u207b" : "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"[c]).join("");
  const logarithmic = ([low, high], most) => {
    const plain = low >= -3.5 && high <= 5.5, inside = tick => tick[0] >= low - 1e-9 && tick[0] <= high + 1e-9;
    const power = (exponent, factor) => plain ? (factor * 10 ** exponent).toFixed(Math.max(0, -exponent))
      : `${factor === 1 ? "" : `${factor}\u00b7`}10${raised(exponent)}`;
    const step = high - low >= 2 ? Math.max(1, Math.ceil((high - low) / most)) : 1, found = [];
    for (let exponent = Math.floor(low); exponent <= high + 1; exponent++) {
      for (const factor of high - low >= 2 ? [1] : [1, 2, 5]) {
        if (exponent % step === 0) found.push([exponent + Math.log10(factor), power(exponent, factor)]);
      }
    }
    const round = found.filter(inside);
    if (round.length >= 2) return round;
    return linear([10 ** low, 10 ** high], most).map(([value, text]) => [Math.log10(value), text]).filter(inside);
  };

  // Points of a path, as x and y in the coordinates of the drawing; a vertical stroke is one point at its end or its middle.
  const points = (path) => {
    if (path.points) return path.points;
    const xs = [], ys = [], stems = path.classList.contains("stems");
    if (path.classList.contains("bars")) {
      const ends = [];
      for (const [, x, y, end] of path.getAttribute("d").matchAll(/M(\S+) \S+V([^H]+)H([^V]+)V/g)) {
        xs.push(Number(x)); ys.push(Number(y)); ends.push(Number(end));
      }
      return path.points = { xs, ys, ends };
    }
    let x = 0;
    for (const [, command, rest] of path.getAttribute("d").matchAll(/([MLHV])([^MLHVZ]*)/g)) {
      const numbers = rest.trim().split(/\s+/).map(Number);
      if (command === "M" || command === "L") { x = numbers[0]; xs.push(x); ys.push(numbers[1]); }
      else if (command === "H") { x = numbers[0]; xs.push(x); ys.push(ys[ys.length - 1]); }
      else if (stems || path.classList.contains("line")) ys[ys.length - 1] = numbers[0];
      else ys[ys.length - 1] = (ys[ys.length - 1] + numbers[0]) / 2;
    }
    return path.points = { xs, ys, steps: path.classList.contains("line") && path.getAttribute("d").includes("H") };
  };
  // Index of the point of a series that is shown at a place; -1 for none. Bars and steps hold from their left end, and single marks
  // are shown close to the pointer only.
  const found = (path, x, width) => {
    const { xs, ends, steps } = points(path);
    if (ends) return xs.findLastIndex((left, k) => left <= x && x < ends[k]);
    if (steps) return Math.max(0, xs.findLastIndex(left => left <= x));
    const k = nearest(xs, x);
    return path.classList.contains("marks") && Math.abs(xs[k] - x) > 0.01 * width ? -1 : k;
  };
  const nearest = (xs, x) => {
    let low = 0, high = xs.length - 1;
    while (low < high) { const middle = (low + high) >> 1; if (xs[middle] < x) low = middle + 1; else high = middle; }
    return low > 0 && x - xs[low - 1] < xs[low] - x ? low - 1 : low;
  };
  const significant = value => (value !== 0 && (Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3) ? value.toExponential(3) : value.toPrecision(4)).replaceAll("-", "\u2212");
  const digits = (value, range) => {
    const places = Math.max(0, Math.min(9, 3 - Math.floor(Math.log10(Math.abs(range) || 1))));
    return (Math.abs(value) >= 1e6 ? value.toExponential(3) : value.toFixed(places)).replaceAll("-", "\u2212");
  };

  // Links panels with a common axis and returns the function that draws them again; `hidden` has the names of hidden curves.
  const link = (figure, panels, hidden) => {
    const whole = panels[0].x, log = panels[0].log.x;
    const axis = (panels[panels.length - 1].svg.parentNode.querySelector(".axis") || {}).textContent || "";
    const place = x => log ? 10 ** x : x;
    let view = whole;
    const shown = panel => [...panel.data.querySelectorAll("path.curve, path.bars")].filter(path => !hidden.has(path.dataset.name));

    const draw = () => {
      for (const panel of panels) {
        const [x0, x1] = panel.x, [y0, y1] = panel.y, scale = WIDTH / (x1 - x0);
        const [left, right] = view.map(x => (x - x0) * scale);
        let top = 0, bottom = HEIGHT;
        if (view !== whole && !panel.fixed) {
          let [low, high] = [Infinity, -Infinity];
          for (const path of shown(panel)) {
            const { xs, ys } = points(path);
            for (let k = 0; k < xs.length; k++) {
              if (xs[k] >= left && xs[k] <= right) { low = Math.min(low, ys[k]); high = Math.max(high, ys[k]); }
            }
          }
          if (low <= high) {
            const margin = Math.max(0.08 * (high - low), 0.05);
            [top, bottom] = [low - margin, high + margin];
          }
        }
        panel.data.setAttribute("viewBox", `${left} ${top} ${right - left} ${bottom - top}`);
        const value = ordinate => y1 - ordinate / HEIGHT * (y1 - y0);
        panel.range = [value(bottom), value(top)];
        const ticks = name => panel.log[name] ? logarithmic : linear;
        const lines = panel.svg.querySelector(".lines"), labels = panel.svg.querySelector(".ticks");
        lines.replaceChildren(); labels.replaceChildren();
        for (const [tick, text] of panel.rows ? [] : ticks("y")(panel.range, 6)) {
          const at = `${100 * (panel.range[1] - tick) / (panel.range[1] - panel.range[0])}%`;
          lines.append(make("line", { x1: 0, x2: "100%", y1: at, y2: at }));
          labels.append(make("text", { class: "y", x: -8, y: at, dy: ".35em" }, text));
        }
        for (const [tick, text] of ticks("x")(view, panel.svg.clientWidth < 420 ? 4 : panel.svg.clientWidth < 620 ? 5 : 8)) {
          const at = `${100 * (tick - view[0]) / (view[1] - view[0])}%`;
          lines.append(make("line", { x1: at, x2: at, y1: 0, y2: "100%" }));
          labels.append(make("text", { class: "x", x: at, y: "100%", dy: "1.35em" }, text));
        }
        for (const mark of panel.svg.querySelectorAll("text.mark")) {
          const at = (Number(mark.dataset.at) - view[0]) / (view[1] - view[0]);
          mark.setAttribute("x", `${100 * at}%`);
          mark.style.display = at < 0 || at > 1 ? "none" : "";
        }
      }
    };
    const zoom = (from, to) => {
      const least = (whole[1] - whole[0]) * 1e-4, width = Math.min(Math.max(to - from, least), whole[1] - whole[0]);
      from = Math.min(Math.max(from, whole[0]), whole[1] - width);
      view = width >= (whole[1] - whole[0]) * (1 - 1e-9) ? whole : [from, from + width];
      draw();
    };
    const about = (middle, factor) => {
      const at = middle === undefined ? (view[0] + view[1]) / 2 : middle;
      zoom(at - (at - view[0]) * factor, at + (view[1] - at) * factor);
    };
    const pan = part => { const by = part * (view[1] - view[0]); zoom(view[0] + by, view[1] + by); };

    const tools = document.createElement("div");
    tools.className = "tools";
    tools.setAttribute("role", "group");
    tools.append(
      button("+", "Zoom in", () => about(undefined, 0.5)), button("\u2212", "Zoom out", () => about(undefined, 2)),
      button("\u2190", "Move left", () => pan(-0.25)), button("\u2192", "Move right", () => pan(0.25)),
      button("Reset", "Show everything", () => zoom(...whole)));
    // Panels beside each other are small; dragging zooms them too.
    if (!figure.classList.contains("grid")) figure.querySelector(".panels").before(tools);

    for (const panel of panels) {
      const readout = document.createElement("output");
      panel.label.append(" ", readout);
      panel.readout = readout;
      const at = event => {
        const box = panel.svg.getBoundingClientRect();
        return Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
      };
      const time = part => view[0] + part * (view[1] - view[0]);
      let begun = null;
      const hover = part => {
        const x = time(part), in_drawing = (x - panel.x[0]) / (panel.x[1] - panel.x[0]) * WIDTH;
        for (const other of panels) {
          other.cursor.setAttribute("x1", `${100 * part}%`); other.cursor.setAttribute("x2", `${100 * part}%`);
          other.cursor.style.display = "inline";
          const parts = other.rows ? [] : shown(other).map(path => {
            const { ys } = points(path), [y0, y1] = other.y, k = found(path, in_drawing, (view[1] - view[0]) / (other.x[1] - other.x[0]) * WIDTH);
            if (k < 0) return "";
            const at = y1 - ys[k] / HEIGHT * (y1 - y0);
            const value = other.log.y ? significant(10 ** at) : digits(at, other.range[1] - other.range[0]);
            return `${path.dataset.name} ${value}`.trim();
          }).filter(Boolean);
          const where = log ? significant(place(x)) : digits(x, view[1] - view[0]);
          other.readout.textContent = `${axis.replace(/( \(.*\)|,.*)? \[.*/, "")} ${where}${parts.length ? ": " : ""}${parts.join(", ")}`;
        }
      };
      const leave = () => {
        for (const other of panels) { other.cursor.style.display = "none"; other.readout.textContent = ""; }
      };
      panel.svg.addEventListener("pointermove", event => {
        hover(at(event));
        if (begun === null) return;
        if (event.shiftKey) { const by = time(begun) - time(at(event)); begun = at(event); zoom(view[0] + by, view[1] + by); return; }
        const [from, to] = [begun, at(event)].sort((a, b) => a - b);
        for (const other of panels) {
          other.chosen.setAttribute("x", `${100 * from}%`); other.chosen.setAttribute("width", `${100 * (to - from)}%`);
        }
      });
      panel.svg.addEventListener("pointerleave", leave);
      panel.svg.addEventListener("pointerdown", event => {
        if (event.button === 0 && event.pointerType !== "touch") { begun = at(event); if (event.isTrusted) panel.svg.setPointerCapture(event.pointerId); event.preventDefault(); }
      });
      const end = event => {
        if (begun === null) return;
        const [from, to] = [begun, at(event)].sort((a, b) => a - b);
        begun = null;
        for (const other of panels) other.chosen.setAttribute("width", 0);
        if (!event.shiftKey && to - from > 0.01) zoom(time(from), time(to));
      };
      panel.svg.addEventListener("pointerup", end);
      panel.svg.addEventListener("pointercancel", () => { begun = null; });
      panel.svg.addEventListener("dblclick", () => zoom(...whole));
      panel.svg.addEventListener("wheel", event => {
        if (!event.ctrlKey) return;
        event.preventDefault();
        about(time(at(event)), event.deltaY < 0 ? 0.8 : 1.25);
      }, { passive: false });
    }

    draw();
    return draw;
  };

  for (const figure of document.querySelectorAll("figure.traces")) {
    const panels = [...figure.querySelectorAll("svg.trace")].map(svg => ({
      svg, data: svg.querySelector("svg.curves"), log: { x: "logX" in svg.dataset, y: "logY" in svg.dataset },
      x: svg.dataset.x.split(" ").map(Number), y: svg.dataset.y.split(" ").map(Number),
      rows: "rows" in svg.dataset, fixed: "rows" in svg.dataset || svg.querySelector("path.bars") !== null,
      label: svg.parentNode.querySelector(".quantity"),
      cursor: svg.appendChild(make("line", { class: "cursor", y1: 0, y2: "100%" })),
      chosen: svg.appendChild(make("rect", { class: "chosen", y: 0, height: "100%", width: 0 })),
    }));
    const hidden = new Set(), linked = panels.filter(panel => !("own" in panel.svg.dataset));
    const groups = [linked, ...panels.filter(panel => "own" in panel.svg.dataset).map(panel => [panel])].filter(group => group.length > 0);
    const draws = groups.map(group => link(figure, group, hidden));
    const draw = () => { for (const one of draws) one(); };
    for (const entry of figure.querySelectorAll(".legend li")) {
      const name = entry.dataset.name, toggle = button("", "", () => {
        const is_hidden = !hidden.has(name);
        if (is_hidden) hidden.add(name); else hidden.delete(name);
        toggle.setAttribute("aria-pressed", String(!is_hidden));
        for (const path of figure.querySelectorAll("svg.curves path")) {
          if (path.dataset.name === name) path.style.display = is_hidden ? "none" : "";
        }
        draw();
      });
      toggle.setAttribute("aria-pressed", "true");
      toggle.append(...entry.childNodes);
      entry.append(toggle);
    }
    new ResizeObserver(draw).observe(figure);
  }

  // Tables with at least three rows can be sorted by each column: numbers by value, then words.
  const value = (cell) => {
    const text = cell.textContent.trim().replaceAll("\u2212", "-").replaceAll("\u00a0", "").replace(/(\d),(?=\d{3})/g, "$1");
    const found = /^[<>\u2264\u2265]?\s*([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)\s*([kMG](?=$|\s))?/i.exec(text);
    if (text === "\u221e") return Infinity;
    return found ? Number(found[1]) * ({ k: 1e3, M: 1e6, G: 1e9 }[found[2]] || 1) : text;
  };
  const before = (a, b) => typeof a === "number" ? (typeof b === "number" ? a - b : -1) : typeof b === "number" ? 1 : a.localeCompare(b);
  for (const table of document.querySelectorAll(".table table")) {
    const body = table.tBodies[0];
    if (!body || body.rows.length < 3) continue;
    const original = [...body.rows];
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      const name = head.textContent, sort = button(name, "", () => {
        const now = head.getAttribute("aria-sort"), next = now === "ascending" ? "descending" : now === "descending" ? null : "ascending";
        for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
        const rows = [...original];
        if (next) {
          head.setAttribute("aria-sort", next);
          const sign = next === "ascending" ? 1 : -1;
          rows.sort((a, b) => sign * before(value(a.cells[column]), value(b.cells[column])));
        }
        body.append(...rows);
      });
      if (name) head.replaceChildren(sort);
    });
  }
})();
