// The observables: their series as lines against time, and their numbers so far.
const INK = ["#0072B2", "#D55E00", "#009E73"]; // of one number, or of x, y, z
const MOST = 4000; // points of a series that are kept: every other one goes when there are more
let series = new Map(); // name -> { times, values, canvas, last, unit }
let found = new Map(); // name -> the element of its number
let stale = false;

const several = (value) => (Array.isArray(value) ? value : [value]);
const brief = (x) => (x !== 0 && Math.abs(x) < 1e-3 ? x.toExponential(2) : String(Number(x.toPrecision(3))));
const shown = (value) => several(value).map((x) => (x === null ? "none yet" : Number(x.toPrecision(4)))).join(", ");

function newSeries(units) {
  series = new Map();
  found = new Map();
  part("numbers").replaceChildren();
  for (const [name, unit] of Object.entries(units)) {
    const card = made("div", { className: "number" }), canvas = made("canvas"), last = made("span");
    card.append(made("b", { textContent: name }), " ", last, canvas);
    part("numbers").append(card);
    series.set(name, { times: [], values: [], canvas, last, unit: unit === "1" ? "" : ` ${unit}` });
  }
}

function addRow(row) {
  for (const [name, value] of Object.entries(row.values)) {
    const one = series.get(name);
    if (!one) continue;
    one.times.push(row.time);
    one.values.push(several(value));
    if (one.times.length > MOST) for (const key of ["times", "values"]) one[key] = one[key].filter((_, k) => k % 2 === 0);
    one.last.textContent = shown(value) + one.unit;
  }
  stale = true;
}

function showNumbers(numbers) {
  for (const { name, value, unit, note } of numbers) {
    if (!found.has(name)) {
      const card = made("div", { className: "number" });
      part("numbers").prepend(card);
      found.set(name, card);
    }
    found.get(name).replaceChildren(made("b", { textContent: `${name} = ${shown(value)} ${unit}` }), made("i", { textContent: note }));
  }
}

function drawSeries() {
  if (!stale) return;
  stale = false;
  for (const { times, values, canvas } of series.values()) {
    const ratio = window.devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight, pen = canvas.getContext("2d");
    [canvas.width, canvas.height] = [wide * ratio, high * ratio];
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    const all = values.flat().filter((x) => x !== null), low = Math.min(...all), most = Math.max(...all);
    if (times.length < 2 || !all.length) continue;
    const span = most > low ? most - low : 1, x = (t) => 2 + ((wide - 60) * (t - times[0])) / (times.at(-1) - times[0]);
    const y = (v) => high - 3 - ((high - 6) * (v - low)) / span;
    values[0].forEach((_, k) => {
      pen.strokeStyle = INK[k];
      pen.lineWidth = 1.3;
      pen.beginPath();
      values.forEach((v, i) => { if (v[k] !== null) pen.lineTo(x(times[i]), y(v[k])); });
      pen.stroke();
    });
    pen.fillStyle = "#666";
    pen.font = "10px system-ui, sans-serif";
    pen.fillText(brief(most), wide - 55, 10);
    pen.fillText(brief(low), wide - 55, high - 3);
  }
}
