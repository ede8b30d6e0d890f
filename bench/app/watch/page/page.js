// The page: receives the parts of the document that changed, and shows them. It sends nothing.
"use strict";

const PATIENCE = 4000; // ms without a message after which the page is not live
const found = {};
const part = (name) => document.getElementById(name);
let heard = performance.now(), first = true;

/** Shows a text, and hides an element without one. */
function banner(name, text) {
  const shown = part(name);
  if (shown.textContent !== text) shown.textContent = text;
  shown.hidden = !text;
}

function showHead(head) {
  part("word").textContent = head.word;
  part("word").className = head.level;
  part("reason").textContent = [head.reason, head.age].filter(Boolean).join(" · ");
  drawLamp(part("lamp"), head.shape, head.level);
  part("elapsed").textContent = head.elapsed || "–";
  part("remaining").textContent = head.remaining || "–";
  [part("inputs").textContent, part("inputs").className] = head.inputs;
  part("run").textContent = head.run.filter(Boolean).join(" · ") || "–";
  part("progress").firstElementChild.style.width = `${100 * head.fraction}%`;
  banner("question", head.question && `The run waits for the operator: ${head.question}`);
  banner("others", head.others ? `Further runs under way on this computer: ${head.others}. They are not shown here.` : "");
  document.body.classList.toggle("old", !head.live);
  document.title = `${head.word} · rocking-bench`;
  showAxis();
}

function showAxis() {
  const head = found.head;
  part("axis").textContent = !head || head.live ? "seconds before now: 10 to 0" : head.age && `the newest samples, ${head.age}`;
}

function showVerdict(verdict) {
  part("sentence").textContent = verdict.sentence;
  part("point").textContent = verdict.point;
  part("twin").textContent = verdict.twin && `live model: ${verdict.twin}`;
  banner("trouble", verdict.trouble.join("\n"));
}

function showMeters(meters) {
  const holder = part("meters");
  while (holder.childElementCount > meters.length) holder.lastElementChild.remove();
  meters.forEach((meter, k) => {
    const shown = holder.children[k] || holder.appendChild(newMeter());
    const [name, value] = shown.firstElementChild.children;
    name.textContent = meter.name;
    value.textContent = meter.text;
    value.className = meter.soon ? "alarm" : "";
    shown.title = meter.tip;
    shown.lastElementChild.setAttribute("class", meter.level);
    drawMeter(shown.lastElementChild, meter);
  });
}

function newMeter() {
  const shown = document.createElement("div"), line = document.createElement("div");
  shown.className = "meter";
  line.append(document.createElement("span"), document.createElement("span"));
  shown.append(line);
  add(shown, "svg");
  return shown;
}

function showMatrix(matrix) {
  part("campaign").hidden = matrix === null;
  if (matrix === null) return;
  const table = document.createDocumentFragment();
  const head = table.appendChild(document.createElement("tr"));
  head.append(document.createElement("td"), ...matrix.columns.map((text) => cell("th", text)));
  matrix.cells.forEach((row, k) => {
    const line = table.appendChild(document.createElement("tr"));
    line.append(cell("th", matrix.rows[k]));
    for (const [mark, level, text, status] of row) {
      const made = cell("td", text ? `${mark} ${text}` : mark);
      made.className = level;
      made.title = status;
      line.append(made);
    }
  });
  part("matrix").replaceChildren(table);
}

function cell(name, text) {
  const made = document.createElement(name);
  made.textContent = text;
  return made;
}

function showLog(log) {
  const list = part("log"), panel = part("journal");
  const atEnd = first || panel.scrollTop + panel.clientHeight > panel.scrollHeight - 30;
  list.replaceChildren(...log.map(([time, kind, text, grave]) => {
    const line = cell("li", `${time.padStart(8)}  ${grave ? "▲ " : ""}${kind}: ${text}`);
    if (grave) line.className = "alarm";
    return line;
  }));
  if (atEnd) panel.scrollTop = panel.scrollHeight;
}

function showFigure() {
  part("caption").textContent = found.figure ? found.figure.title : "";
  drawFigure(part("plot"), part("legend"), found.figure || null, found.points);
}

const SHOW = {
  head: showHead, verdict: showVerdict, meters: showMeters, matrix: showMatrix, log: showLog,
  figure: showFigure, points: showFigure,
  traces: (traces) => drawTraces(part("traces"), traces),
  picture: (picture) => {
    drawPicture(part("picture"), picture);
    part("source").textContent = picture === null ? "" : `${picture.source} · motion × ${picture.factor}`;
  },
};

/** Shows parts of the document; a hidden page keeps them until it is visible. */
function show(changed) {
  for (const name of Object.keys(changed)) if (name in SHOW) SHOW[name](found[name]);
  if (Object.keys(changed).length) first = false;
}

function receive(message) {
  heard = performance.now();
  const changed = JSON.parse(message.data), classes = document.body.classList, lost = classes.contains("lost");
  classes.remove("lost");
  Object.assign(found, changed);
  // after a loss of the link, an unchanged head must replace what check() has written
  if (!document.hidden) show(lost ? found : changed);
}

/** Marks the page as not live, with the duration of the silence, if no message arrives. */
function check() {
  const silence = performance.now() - heard;
  if (silence < PATIENCE) return;
  document.body.classList.add("lost");
  drawLamp(part("lamp"), "cross", "alarm");
  part("word").textContent = "NO LINK";
  part("word").className = "alarm";
  const last = found.head ? `; last known state: ${found.head.word}, ${found.head.reason}` : "";
  part("reason").textContent = `no message from the page's server for ${Math.round(silence / 1000)} s${last}`;
  document.title = "NO LINK · rocking-bench";
  if (source.readyState === EventSource.CLOSED) listen();
}

let source;
function listen() {
  source = new EventSource("events");
  source.onmessage = receive;
}

document.addEventListener("visibilitychange", () => { if (!document.hidden) show(found); });
addEventListener("resize", () => show(found));
setInterval(check, 1000);
listen();
