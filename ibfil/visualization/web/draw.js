"use strict";
// Rods that turn: tubes as shaded strips in the order of their depth, on a plain canvas, so that no graphics card is needed.
// The script after this one has `run` and `radius`, the constants of the scene, and says what is shown now: position(node),
// strokeEnd(stroke, end), share(node) of the colours, 0 to 255; what stands behind, backdrop(); the end of a picture, drawn(); whether there is anything yet, ready().
const part = (id) => document.getElementById(id);
const canvas = part("canvas"), pen = canvas.getContext("2d");
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
const state = { quantity: 0, zoom: 1, shift: [0, 0], towards: null, up: null, right: null };
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((x) => x / Math.hypot(...a));
const along = (a, s, b) => a.map((x, i) => x + s * b[i]);

function look(towards, up) {
  state.towards = unit(towards);
  let right = cross(up, state.towards);
  if (Math.hypot(...right) < 1e-6) right = cross([state.towards[1], state.towards[2], state.towards[0]], state.towards);
  state.right = unit(right);
  state.up = cross(state.towards, state.right);
}

function turn(across, upwards) { // radians
  let t = along(state.towards.map((x) => x * Math.cos(across)), -Math.sin(across), state.right);
  t = along(t.map((x) => x * Math.cos(upwards)), Math.sin(upwards), state.up);
  look(t, along(state.up, -Math.sin(upwards), state.towards));
}

const VIEWS = { x: [1, 0, 0], y: [0, -1, 0], z: [0, 0, 1], corner: [0.6, -1, 0.7] };
function view(name) { look(VIEWS[name], name === "z" ? [0, 1, 0] : [0, 0, 1]); draw(); }

let middle, scale; // of the picture, pixels; pixels a length
function project(p) {
  const d = [p[0] - run.centre[0], p[1] - run.centre[1], p[2] - run.centre[2]];
  return [middle[0] + scale * dot(d, state.right) + state.shift[0], middle[1] - scale * dot(d, state.up) + state.shift[1], dot(d, state.towards)];
}

function draw() {
  if (!ready()) return;
  const ratio = window.devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight;
  if (canvas.width !== Math.round(wide * ratio) || canvas.height !== Math.round(high * ratio)) {
    canvas.width = Math.round(wide * ratio);
    canvas.height = Math.round(high * ratio);
  }
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, wide, high);
  middle = [wide / 2, high / 2];
  scale = (0.46 * Math.min(wide, high * 1.6) * state.zoom) / run.reach;
  backdrop();
  if (run.wall !== null) wall();
  if (run.box !== null && part("box").checked) box();
  tubes();
  axes(high);
  ruler(wide, high);
  canvas.dataset.towards = state.towards.map((x) => x.toFixed(3)).join(",");
  canvas.dataset.zoom = state.zoom.toFixed(3);
  drawn();
}

function tubes() { // each segment as strips across it, light from the upper left, the farthest first
  const shown = [], { map, values } = run.quantities[state.quantity];
  for (let f = 0, first = 0; f < run.counts.length; first += run.counts[f], f++) {
    const last = first + run.counts[f] - 1, line = [];
    for (let k = first; k <= last; k++) line.push(project(position(k)));
    const across = line.map((_, k) => {
      const a = line[Math.max(0, k - 1)], b = line[Math.min(line.length - 1, k + 1)], size = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
      return [-(b[1] - a[1]) / size, (b[0] - a[0]) / size];
    });
    for (let k = 0; k < line.length - 1; k++) {
      const value = values === null ? f % map.length : (share(first + k) + share(first + k + 1)) >> 1;
      const colour = map[value], depth = (line[k][2] + line[k + 1][2]) / 2;
      shown.push([depth, () => strips(line[k], line[k + 1], across[k], across[k + 1], radius[first + k], radius[first + k + 1], colour)]);
      if (k === 0) shown.push([line[0][2], () => cap(line[0], line[1], radius[first], colour)]);
      if (k === line.length - 2) shown.push([line[k + 1][2], () => cap(line[k + 1], line[k], radius[last], colour)]);
    }
  }
  for (let k = 0; k < run.links; k++) {
    const [a, b] = [0, 1].map((end) => project(strokeEnd(k, end)));
    shown.push([(a[2] + b[2]) / 2, () => link(a, b)]);
  }
  many = shown.length > 5000;
  shown.sort((a, b) => a[0] - b[0]);
  for (const [, paint] of shown) paint();
}

function link(a, b) {
  pen.strokeStyle = "#444";
  pen.lineWidth = 1.5;
  pen.beginPath();
  pen.moveTo(a[0], a[1]);
  pen.lineTo(b[0], b[1]);
  pen.stroke();
}

function cap(end, inner, r, colour) { // the flat end of a tube, where it faces the eye
  const across = Math.hypot(end[0] - inner[0], end[1] - inner[1]), deep = scale * (end[2] - inner[2]), thick = r * scale;
  if (deep <= 0 || thick < 3) return;
  pen.fillStyle = shade(colour, 0, 0);
  pen.beginPath();
  pen.ellipse(end[0], end[1], (thick * deep) / Math.hypot(across, deep), thick, Math.atan2(end[1] - inner[1], end[0] - inner[0]), 0, 2 * Math.PI);
  pen.fill();
}

let many = false;
function strips(a, b, m, n, r, q, colour) {
  const thick = Math.max(1.25, r * scale), wide = Math.max(1.25, q * scale), count = thick < 3 ? 1 : many ? 3 : 7;
  if (m[0] * n[0] + m[1] * n[1] < 0.3) { // it turns about the line of sight
    pen.fillStyle = shade(colour, 0, 0);
    pen.beginPath();
    pen.arc((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, thick, 0, 2 * Math.PI);
    pen.fill();
  }
  for (let k = 0; k < count; k++) {
    const low = (2 * k) / count - 1, high = (2 * (k + 1)) / count - 1, at = (low + high) / 2;
    pen.fillStyle = pen.strokeStyle = count === 1 ? shade(colour, 0, 0) : shade(colour, at * m[0], at * m[1]);
    pen.lineWidth = 0.6;
    pen.beginPath();
    pen.moveTo(a[0] + low * thick * m[0], a[1] + low * thick * m[1]);
    pen.lineTo(b[0] + low * wide * n[0], b[1] + low * wide * n[1]);
    pen.lineTo(b[0] + high * wide * n[0], b[1] + high * wide * n[1]);
    pen.lineTo(a[0] + high * thick * m[0], a[1] + high * thick * m[1]);
    pen.closePath();
    pen.fill();
    pen.stroke(); // no seams
  }
}

function shade(colour, x, y) { // of a surface whose normal has these parts across and down the picture
  const bright = -0.35 * x - 0.5 * y + 0.79 * Math.sqrt(Math.max(0, 1 - x * x - y * y));
  const light = 0.45 + 0.62 * Math.max(0, bright), gloss = 70 * Math.max(0, bright) ** 24;
  return "rgb(" + colour.map((c) => Math.min(255, Math.round(c * light + gloss))).join(",") + ")";
}

function wall() {
  const [x, y] = run.centre, h = run.reach, corners = [[-h, -h], [h, -h], [h, h], [-h, h]];
  outline(corners.map(([a, b]) => [x + a, y + b, run.wall]), "rgba(176,168,152,0.35)", "#807868");
}

function outline(corners, fill, line) {
  pen.beginPath();
  corners.map(project).forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.closePath();
  if (fill) { pen.fillStyle = fill; pen.fill(); }
  pen.strokeStyle = line;
  pen.lineWidth = 1.2;
  pen.stroke();
}

function box() {
  const [a, b, c] = run.box.map((x) => x / 2);
  for (const z of [-c, c]) outline([[-a, -b, z], [a, -b, z], [a, b, z], [-a, b, z]], null, "#888");
  for (const x of [-a, a]) outline([[x, -b, -c], [x, b, -c], [x, b, c], [x, -b, c]], null, "#888");
}

function axes(high) {
  const at = [46, high - 46];
  pen.font = "12px system-ui, sans-serif";
  ["x", "y", "z"].forEach((name, i) => {
    const way = [state.right[i], -state.up[i]];
    pen.strokeStyle = pen.fillStyle = ["#D55E00", "#009E73", "#0072B2"][i];
    pen.lineWidth = 2;
    pen.beginPath();
    pen.moveTo(...at);
    pen.lineTo(at[0] + 28 * way[0], at[1] + 28 * way[1]);
    pen.stroke();
    if (Math.hypot(...way) > 0.15) pen.fillText(name, at[0] + 36 * way[0] - 3, at[1] + 36 * way[1] + 4);
  });
}

function ruler(wide, high) {
  const most = (0.2 * wide) / scale, power = 10 ** Math.floor(Math.log10(most));
  const length = Math.max(...[1, 2, 5].map((k) => k * power).filter((l) => l <= most));
  const [x, y] = [wide - 24 - length * scale, high - 20];
  pen.strokeStyle = pen.fillStyle = "#1a1a1a";
  pen.lineWidth = 2;
  pen.beginPath();
  pen.moveTo(x, y);
  pen.lineTo(x + length * scale, y);
  pen.stroke();
  pen.font = "13px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.fillText(Number(length.toPrecision(3)) + run.lengthunit, x + (length * scale) / 2, y - 6);
  pen.textAlign = "start";
}

function chosen() { // the quantity: its bar
  const q = run.quantities[state.quantity], last = q.map.length - 1;
  part("bar").style.background = "linear-gradient(to right," + q.map.map((c, k) => "rgb(" + c + ") " + (100 * k) / Math.max(last, 1) + "%").join(",") + ")";
  part("low").textContent = q.low;
  part("high").textContent = q.high;
  draw();
}

// --- hands ---
let held = null;
canvas.addEventListener("pointerdown", (e) => { held = [e.clientX, e.clientY]; try { canvas.setPointerCapture(e.pointerId); } catch { /* none to capture */ } });
canvas.addEventListener("pointerup", () => { held = null; });
canvas.addEventListener("pointermove", (e) => {
  if (held === null) return;
  const [dx, dy] = [e.clientX - held[0], e.clientY - held[1]];
  held = [e.clientX, e.clientY];
  if (e.shiftKey) state.shift = [state.shift[0] + dx, state.shift[1] + dy];
  else turn(0.008 * dx, 0.008 * dy);
  draw();
});
canvas.addEventListener("wheel", (e) => { e.preventDefault(); state.zoom *= Math.exp(-0.0015 * e.deltaY); draw(); }, { passive: false });
for (const button of document.getElementsByClassName("view")) button.addEventListener("click", () => view(button.textContent));
window.addEventListener("resize", draw);
