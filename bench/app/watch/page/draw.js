// Drawings of the page as SVG. Texts are set as text nodes, never as markup.
"use strict";

const SVG = "http://www.w3.org/2000/svg";

/** An element with attributes and a text, appended to `parent`. */
function add(parent, name, attributes = {}, text = null, space = SVG) {
  const made = document.createElementNS(space, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== null) made.textContent = text;
  parent.append(made);
  return made;
}

/** An empty drawing that fills `holder`, with its width and height in px. */
function canvas(holder) {
  const width = Math.max(holder.clientWidth, 60), height = Math.max(holder.clientHeight, 60);
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  holder.replaceChildren(svg);
  return { svg, width, height };
}

/** Path through points; an absent ordinate interrupts it. */
function path(x, y, across, up) {
  let text = "", joined = false;
  for (let k = 0; k < x.length; k++) {
    if (x[k] === null || y[k] === null) { joined = false; continue; }
    text += `${joined ? "L" : "M"}${across(x[k]).toFixed(1)} ${up(y[k]).toFixed(1)}`;
    joined = true;
  }
  return text;
}

const SHAPES = {
  triangle: "M28 6 L50 50 L6 50 Z", square: "M6 6 H50 V50 H6 Z", cross: "M6 6 L50 50 M50 6 L6 50",
  octagon: "M19 6 H37 L50 19 V37 L37 50 H19 L6 37 V19 Z",
};

/** The lamp of the state: its own shape for each kind of state. */
function drawLamp(svg, shape, level) {
  svg.replaceChildren();
  svg.setAttribute("class", level);
  if (shape === "ring" || shape === "disc") {
    add(svg, "circle", { cx: 28, cy: 28, r: 21, ...(shape === "ring" ? { fill: "none" } : {}) });
  } else add(svg, "path", { d: SHAPES[shape], ...(shape === "cross" ? { fill: "none" } : {}) });
}

/** A meter: bar up to the limit, line at the peak, triangle at the planned value. */
function drawMeter(svg, meter) {
  svg.replaceChildren();
  svg.setAttribute("viewBox", "0 0 100 13");
  svg.setAttribute("preserveAspectRatio", "none");
  add(svg, "rect", { class: "groove", x: 0, y: 1, width: 100, height: 9, "vector-effect": "non-scaling-stroke" });
  if (meter.share !== null) add(svg, "rect", { class: "bar", x: 0, y: 1, width: 100 * meter.share, height: 9 });
  if (meter.peak !== null) {
    const x = 100 * meter.peak;
    add(svg, "line", { class: "peak", x1: x, x2: x, y1: 0, y2: 11, "vector-effect": "non-scaling-stroke" });
  }
  if (meter.planned !== null) {
    const x = 100 * meter.planned;
    add(svg, "path", { class: "planned", d: `M${x} 6 L${x - 1.6} 13 L${x + 1.6} 13 Z` });
  }
}

const RAYS = [[-1, 0.15], [-0.7, 0.7], [0.7, 0.7], [1, 0.15]];

/** The specimen to scale. */
function drawPicture(holder, picture) {
  const { svg, width, height } = canvas(holder);
  if (picture === null) return;
  const [left, right, top] = picture.box;
  const scale = Math.min((height - 26) / top, width / (1.15 * (right - left)));
  const across = (x) => width / 2 + scale * (x - (left + right) / 2), up = (y) => height - 12 - scale * y;
  for (const [role, ...flat] of picture.shapes) {
    const points = [];
    for (let k = 0; k < flat.length; k += 2) points.push([across(flat[k]), up(flat[k + 1])]);
    const [x, y] = points[0];
    if (role === "contact") add(svg, "path", { class: role, d: `M${x} ${y} l-6 10 h12 Z` });
    else if (role === "impact") {
      for (const [dx, dy] of RAYS) {
        add(svg, "path", { class: role, d: `M${x + 10 * dx} ${y - 10 * dy} L${x + 22 * dx} ${y - 22 * dy}` });
      }
    } else {
      const closed = role === "block" || role === "unknown";
      const text = points.map((point) => point.map((value) => value.toFixed(1)).join(",")).join(" ");
      add(svg, closed ? "polygon" : "polyline", { class: role, points: text });
    }
  }
}

/** Stacked traces over a common time axis that ends at the newest sample. */
function drawTraces(holder, found) {
  const { svg, width, height } = canvas(holder);
  const row = height / found.traces.length, across = (s) => (1 + s / found.window) * width;
  const x = found.seconds.flatMap((s) => [s, s]);
  found.traces.forEach(([name, reach, y], k) => {
    const middle = (k + 0.5) * row + 7, half = Math.max(0.5 * row - 9, 4);
    add(svg, "line", { class: "grid", x1: 0, x2: width, y1: middle, y2: middle });
    const up = (value) => middle - (half * value) / found.full;
    add(svg, "path", { class: `curve weak c${k % 5}`, d: path(x, y, across, up) });
    add(svg, "text", { x: 2, y: k * row + 12 }, name);
    add(svg, "text", { x: width - 2, y: k * row + 12, "text-anchor": "end" }, reach);
  });
}

/** About `count` round values between two values; on a logarithmic axis with a ratio above 5, 1, 2 and 5 times powers of ten. */
function ticks(low, high, log, count) {
  const found = [];
  if (log && high / low > 5) {
    for (let decade = Math.floor(Math.log10(low)); decade <= Math.log10(high); decade++) {
      for (const digit of [1, 2, 5]) found.push(digit * 10 ** decade);
    }
  } else {
    const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find((digit) => digit * power >= rough);
    for (let k = Math.ceil(low / step); k * step <= high * (1 + 1e-9); k++) found.push(k * step);
  }
  return found.filter((value) => value >= low && value <= high);
}

/** The figure of the protocol: predicted gains with measured points, or the last fit. */
function drawFigure(holder, legend, figure, points) {
  const { svg, width, height } = canvas(holder);
  legend.replaceChildren();
  if (figure === null) return;
  const fit = figure.kind === "fit", log = figure.kind === "spectrum";
  const marks = fit ? [] : points.marks, now = fit ? null : points.running;
  const xs = figure.curves.flatMap((curve) => curve.points[0]).concat(marks.map((mark) => mark[0]), now ? [now[0]] : []);
  const ys = figure.curves.flatMap((curve) => curve.points[1])
    .concat(marks.flatMap((mark) => (mark[1] === null ? [] : [mark[1]])), now ? [now[1]] : []);
  const known = (values) => values.filter((value) => value !== null && (!log || value > 0));
  if (!known(xs).length || !known(ys).length) return;
  const least = (values) => values.reduce((a, b) => Math.min(a, b)), most = (values) => values.reduce((a, b) => Math.max(a, b));
  let [x0, x1, y0, y1] = [least(known(xs)), most(known(xs)), least(known(ys)), most(known(ys))];
  if (x0 === x1) [x0, x1] = [x0 - 1, x1 + 1];
  [x0, x1] = [x0 - 0.04 * (x1 - x0), x1 + 0.04 * (x1 - x0)];
  if (log) [y0, y1] = [y0 / 1.15, y1 * 1.15];
  else [y0, y1] = [y0 - 0.06 * (y1 - y0 || 1), y1 + 0.06 * (y1 - y0 || 1)];
  const box = { left: 56, right: width - 10, top: 8, bottom: height - 38 };
  const across = (x) => box.left + ((x - x0) / (x1 - x0)) * (box.right - box.left);
  const share = log ? (y) => Math.log(Math.max(y, 1e-9) / y0) / Math.log(y1 / y0) : (y) => (y - y0) / (y1 - y0);
  const up = (y) => Math.min(Math.max(box.bottom - share(y) * (box.bottom - box.top), box.top), box.bottom);
  const short = (value) => String(Number(value.toPrecision(4)));
  for (const x of ticks(x0, x1, false, 6)) {
    add(svg, "line", { class: "grid", x1: across(x), x2: across(x), y1: box.top, y2: box.bottom });
    add(svg, "text", { x: across(x), y: box.bottom + 15, "text-anchor": "middle" }, short(x));
  }
  for (const y of ticks(y0, y1, log, 5)) {
    add(svg, "line", { class: "grid", x1: box.left, x2: box.right, y1: up(y), y2: up(y) });
    add(svg, "text", { x: box.left - 5, y: up(y) + 4, "text-anchor": "end" }, short(y));
  }
  add(svg, "text", { x: (box.left + box.right) / 2, y: height - 6, "text-anchor": "middle" }, figure.x);
  const middle = (box.top + box.bottom) / 2;
  add(svg, "text", { x: 13, y: middle, "text-anchor": "middle", transform: `rotate(-90 13 ${middle})` }, figure.y);
  figure.curves.forEach((curve, k) => {
    const group = fit ? k : curve.group, colour = `c${fit ? k % 5 : 1 + (group % 4)}`;
    const style = `curve ${colour} d${fit ? Number(curve.fitted) : group % 4}${curve.weak ? " weak" : ""}`;
    if (curve.band) {
      for (const part of parts(curve.points[0], ...curve.band)) {
        const upper = path(part[0], part[2], across, up), lower = path([...part[0]].reverse(), [...part[1]].reverse(), across, up);
        add(svg, "path", { class: `band ${colour}`, d: `${upper}${lower.replace("M", "L")}Z` });
      }
    }
    add(svg, "path", { class: style, d: path(...curve.points, across, up) });
    const entry = add(legend, "li", {}, null, "http://www.w3.org/1999/xhtml");
    add(add(entry, "svg", { viewBox: "0 0 26 8" }), "path", { class: style, d: "M0 4 H26" });
    entry.append(curve.name);
  });
  for (const [x, gain, spread, group, varies] of marks) {
    const place = figure.groups.indexOf(group), colour = `c${1 + ((place < 0 ? 0 : place) % 4)}`;
    if (gain === null) {
      add(svg, "path", { class: "fell", d: `M${across(x) - 6} ${box.top} l12 12 m0 -12 l-12 12` });
      continue;
    }
    add(svg, "line", { class: "spread", x1: across(x), x2: across(x), y1: up(gain - spread), y2: up(gain + spread) });
    add(svg, "circle", { class: varies ? `hollow ${colour}` : colour, cx: across(x), cy: up(gain), r: 5.5 });
  }
  if (now) add(svg, "circle", { class: "now", cx: across(now[0]), cy: up(now[1]), r: 9 });
}

/** The parts of parallel arrays in which no value is absent. */
function parts(...arrays) {
  const found = [];
  let current = null;
  arrays[0].forEach((_, k) => {
    if (arrays.some((values) => values[k] === null)) { current = null; return; }
    if (current === null) found.push((current = arrays.map(() => [])));
    arrays.forEach((values, n) => current[n].push(values[k]));
  });
  return found;
}
