// A case that is played: the line to `ibfil live`, its pictures, and the hands. draw.js draws.
let run = null, radius = new Float32Array(0);
let now = null; // the present: time, steps, places, ends of strokes, values of each quantity
let running = true, waiting = false, ended = "";
const drawnAt = []; // seconds and times of the last pictures
const line = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/line${location.search}`);
line.binaryType = "arraybuffer";
const send = (order) => { if (line.readyState === WebSocket.OPEN) line.send(JSON.stringify(order)); };

const position = (node) => [now.places[3 * node], now.places[3 * node + 1], now.places[3 * node + 2]];
const strokeEnd = (stroke, end) => [0, 1, 2].map((i) => now.ends[6 * stroke + 3 * end + i]);
function share(node) {
  const [low, high] = run.quantities[state.quantity].ends || [0, 0], value = now.values[state.quantity][node];
  const at = high > low ? (value - low) / (high - low) : 0.5;
  return Math.round(255 * Math.min(1, Math.max(0, Number.isFinite(at) ? at : 0)));
}
function backdrop() {}
const ready = () => now !== null;
function drawn() {
  part("time").textContent = run.timewords.replace("#", `${Number(now.time.toPrecision(4))} of ${Number(run.end.toPrecision(4))}`);
  canvas.dataset.time = now.time;
  canvas.dataset.pictures = Number(canvas.dataset.pictures || 0) + 1;
}

// --- pictures ---
function picture(buffer) {
  const numbers = new Float32Array(buffer, 16), head = new DataView(buffer), nodes = radius.length, ends = 6 * run.links;
  const own = run.quantities.map((q) => q.values !== null);
  if (numbers.length !== 3 * nodes + ends + nodes * own.filter(Boolean).length) { send({ drawn: true }); return; }
  let at = 3 * nodes + ends;
  const values = own.map((there) => (there ? numbers.subarray(at, (at += nodes)) : null));
  now = { time: head.getFloat64(0, true), steps: head.getFloat64(8, true), places: numbers.subarray(0, 3 * nodes), ends: numbers.subarray(3 * nodes, 3 * nodes + ends), values };
  values.forEach((each, k) => { if (each) widen(run.quantities[k], each); });
  inSight();
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    drawSeries();
    if (now !== null) { // else a new scene has begun since, of which no picture has come
      chosen();
      drawnAt.push([performance.now() / 1000, now.time]);
      rates();
    }
    send({ drawn: true }); // in any case: the next picture waits for it
  });
}

function widen(quantity, values) { // its ends: the lowest and the highest of this scene so far
  let [low, high] = quantity.ends || [Infinity, -Infinity];
  for (const v of values) if (Number.isFinite(v)) { low = Math.min(low, v); high = Math.max(high, v); }
  if (low > high) return; // none is finite
  if (quantity.signed) { high = Math.max(Math.abs(low), Math.abs(high)); low = -high; }
  quantity.ends = [low, high];
  [quantity.low, quantity.high] = quantity.ends.map((x) => Number(x.toPrecision(3)));
}

function inSight() { // the rods are followed where that is wanted, and where they have left the picture
  let low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let k = 0; k < radius.length; k++) position(k).forEach((x, i) => { low[i] = Math.min(low[i], x); high[i] = Math.max(high[i], x); });
  const middle = low.map((x, i) => (x + high[i]) / 2), far = (centre) => Math.hypot(...low.map((x, i) => Math.max(Math.abs(x - centre[i]), Math.abs(high[i] - centre[i]))));
  if (![...middle].every(Number.isFinite)) return;
  if (part("follow").checked || far(run.centre) > 1.08 * run.reach) run.centre = middle;
  run.reach = Math.max(run.reach, far(run.centre) / 1.08);
}

function rates() {
  while (drawnAt.length > 2 && drawnAt.at(-1)[0] - drawnAt[0][0] > 2) drawnAt.shift();
  const spent = drawnAt.at(-1)[0] - drawnAt[0][0];
  if (drawnAt.length < 3 || !spent) return;
  const pictures = (drawnAt.length - 1) / spent, speed = (drawnAt.at(-1)[1] - drawnAt[0][1]) / spent;
  canvas.dataset.rate = pictures.toFixed(1);
  const words = run.timewords.replace("time #", `${Number(speed.toPrecision(3))}`);
  part("rates").textContent = `${pictures.toFixed(0)} pictures a second, ${words} of the run a second, ${now.steps} steps`;
}

// --- what is told: all words are set as text, never as markup ---
function scene(told) {
  const first = run === null, before = run;
  run = { ...told, reach: 1.2 * told.reach }; // room to swim in
  radius = new Float32Array(bytes(run.radius).buffer);
  drawnAt.length = 0;
  now = null;
  part("title").textContent = run.title;
  part("method").textContent = run.method;
  part("case").textContent = run.casetext;
  part("groups").textContent = Object.entries(run.groups).map(([name, value]) => `${name} = ${value}`).join("\n");
  part("boxtool").hidden = run.box === null;
  part("linewords").textContent = run.linewords;
  part("warnings").replaceChildren();
  run.warnings.forEach(warn);
  showFaults([]);
  status((ended = ""));
  showControls(run.controls);
  newSeries(run.series);
  const words = run.quantities.map((q) => q.words);
  if (first || before.quantities.map((q) => q.words).join() !== words.join()) {
    part("quantity").replaceChildren(...words.map((word, value) => made("option", { value, textContent: word })));
    state.quantity = 0;
  }
  if (first) look(run.towards, run.up);
  else if (run.reach < 2 * before.reach && before.reach < 2 * run.reach) run.reach = before.reach; // the eye stays
}

function warn(words) { part("warnings").append(made("li", { textContent: words })); }
function status(words) { part("status").textContent = words; canvas.dataset.status = words; }

function hear(told) {
  if (told.scene) scene(told.scene);
  if (told.row) addRow(told.row);
  if (told.numbers) { showNumbers(told.numbers); requestAnimationFrame(drawSeries); }
  if (told.warning) warn(told.warning);
  if (told.building) status("building ...");
  if (told.faults) { status(ended); showFaults([...told.faults, "the run goes on as it was"]); }
  if ("running" in told) moves(told.running);
  if (told.ended) {
    const [word, ...lines] = told.ended.split("\n");
    status((ended = lines.length ? word : told.ended));
    if (lines.length) part("fault").textContent = lines.join("\n");
  }
}

line.addEventListener("message", (e) => { if (typeof e.data === "string") hear(JSON.parse(e.data)); else if (run) picture(e.data); });
line.addEventListener("close", () => { status("ibfil live has ended, or its address is another now"); });

// --- hands ---
function moves(wanted) { // said at once, so that a second click is the other way
  running = wanted;
  part("play").textContent = running ? "Pause" : "Run";
}
function play() { moves(!running); send({ run: running }); }
part("play").addEventListener("click", play);
part("again").addEventListener("click", () => { moves(true); send({ again: true, run: true }); });
part("original").addEventListener("click", () => send({ original: true }));
part("other").addEventListener("submit", (e) => { e.preventDefault(); send({ key: part("key").value }); });
part("quantity").addEventListener("change", (e) => { state.quantity = Number(e.target.value); chosen(); });
for (const id of ["follow", "box"]) part(id).addEventListener("change", () => { if (now) { inSight(); draw(); } });
part("pace").addEventListener("change", (e) => send({ pace: Number(e.target.value) }));
part("download").addEventListener("click", () => {
  const link = made("a", { href: URL.createObjectURL(new Blob([run.casetext], { type: "application/toml" })), download: "played.toml" });
  link.click();
  URL.revokeObjectURL(link.href);
});
document.addEventListener("keydown", (e) => {
  if (e.key === " " && !["BUTTON", "INPUT", "SELECT", "SUMMARY"].includes(e.target.tagName)) { e.preventDefault(); play(); }
});
const pace = JSON.parse(part("data").textContent).pace;
for (const each of [2, 5, 10, pace, 50, 100, 0]) part("pace").append(made("option", { value: each, textContent: each || "all it can", selected: each === pace }));
