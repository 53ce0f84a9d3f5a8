// A recorded run: its times, its flow. draw.js draws.
const run = JSON.parse(document.getElementById("data").textContent);
const places = new Uint16Array(bytes(run.positions).buffer); // [output][node][xyz], shares of the reach
const linked = new Uint16Array(bytes(run.linked).buffer); // [output][element][end][xyz]
const radius = new Float32Array(bytes(run.radius).buffer); // [node]
const nodes = radius.length, outputs = run.times.length;
const colours = run.quantities.map((q) => (q.values === null ? null : bytes(q.values))); // [output][node]
state.output = outputs - 1;
const sheets = run.flow === null ? null : { speed: bytes(run.flow.speed), arrows: new Int8Array(bytes(run.flow.arrows).buffer) };

const place = (packed, at) => [0, 1, 2].map((i) => run.low[i] + (run.span[i] * packed[at + i]) / 65535);
const position = (node) => place(places, 3 * (state.output * nodes + node));
const strokeEnd = (stroke, end) => place(linked, 6 * (state.output * run.links + stroke) + 3 * end);
const share = (node) => colours[state.quantity][state.output * nodes + node];

const ready = () => true;

function backdrop() { if (sheets && part("flow").checked) flow(); }

function drawn() {
  part("time").textContent = run.timewords.replace("#", Number(run.times[state.output].toPrecision(4)));
  part("slider").value = state.output;
  canvas.dataset.output = state.output;
}

function flow() { // a recorded field in a plane: grey by its speed, arrows by its direction
  const [n, m] = run.flow.shape, time = run.times[state.output];
  let number = 0;
  while (number + 1 < run.flow.times.length && run.flow.times[number + 1] <= time * (1 + 1e-9)) number++;
  const picture = document.createElement("canvas");
  [picture.width, picture.height] = [n, m];
  const paint = picture.getContext("2d"), image = paint.createImageData(n, m);
  for (let k = 0; k < n * m; k++) {
    const grey = 255 - 0.75 * sheets.speed[number * n * m + k];
    image.data.set([grey, grey, grey, 255], 4 * k);
  }
  paint.putImageData(image, 0, 0);
  const start = project(run.flow.origin), a = project(along(run.flow.origin, 1, run.flow.first)), b = project(along(run.flow.origin, 1, run.flow.second));
  pen.save();
  pen.transform((a[0] - start[0]) / n, (a[1] - start[1]) / n, (b[0] - start[0]) / m, (b[1] - start[1]) / m, start[0], start[1]);
  pen.drawImage(picture, 0, 0);
  pen.restore();
  pen.strokeStyle = pen.fillStyle = "#555";
  pen.lineWidth = 1;
  const step = Math.max(1, Math.round(Math.max(n, m) / 24));
  for (let j = step >> 1; j < m; j += step) for (let i = step >> 1; i < n; i += step) {
    const k = 2 * (number * n * m + j * n + i), u = sheets.arrows[k] / 127, v = sheets.arrows[k + 1] / 127;
    const at = (s) => project(along(along(run.flow.origin, (i + 0.5 + s * u * step) / n, run.flow.first), (j + 0.5 + s * v * step) / m, run.flow.second));
    const tail = at(-0.35), head = at(0.35), size = Math.hypot(head[0] - tail[0], head[1] - tail[1]);
    if (size < 2) continue;
    const [x, y] = [(head[0] - tail[0]) / size, (head[1] - tail[1]) / size];
    pen.beginPath();
    pen.moveTo(tail[0], tail[1]);
    pen.lineTo(head[0], head[1]);
    pen.stroke();
    pen.beginPath();
    pen.moveTo(head[0], head[1]);
    pen.lineTo(head[0] - 4 * x + 2 * y, head[1] - 4 * y - 2 * x);
    pen.lineTo(head[0] - 4 * x - 2 * y, head[1] - 4 * y + 2 * x);
    pen.fill();
  }
}

let playing = null;
function play() {
  if (playing !== null) { clearInterval(playing); playing = null; part("play").textContent = "Play"; return; }
  part("play").textContent = "Stop";
  playing = setInterval(() => { state.output = (state.output + 1) % outputs; draw(); }, Math.max(20, Math.min(200, 6000 / outputs)));
}

document.addEventListener("keydown", (e) => {
  const step = { ArrowRight: 1, ArrowLeft: -1 }[e.key];
  if (e.target.id === "slider" || e.target.tagName === "SELECT") return;
  if (step) { state.output = Math.max(0, Math.min(outputs - 1, state.output + step)); draw(); }
  if (e.key === " " && e.target.tagName !== "BUTTON") { e.preventDefault(); play(); }
});
part("slider").addEventListener("input", (e) => { state.output = Number(e.target.value); draw(); });
part("play").addEventListener("click", play);
part("quantity").addEventListener("change", (e) => { state.quantity = Number(e.target.value); chosen(); });
for (const id of ["flow", "box"]) part(id).addEventListener("change", draw);

// --- all words of the run are set as text, never as markup ---
part("title").textContent = run.title;
part("case").textContent = run.casetext;
part("slider").max = outputs - 1;
part("flowtool").hidden = sheets === null;
part("boxtool").hidden = run.box === null;
part("linewords").textContent = run.linewords;
if (sheets) part("flowwords").textContent = run.flow.words;
run.quantities.forEach((q, k) => {
  const one = document.createElement("option");
  one.value = k;
  one.textContent = q.words;
  part("quantity").append(one);
});
look(run.towards, run.up);
chosen();
