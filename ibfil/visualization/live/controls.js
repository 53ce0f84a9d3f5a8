// The controls of the case's keys. `send({set: {path: value}})` begins again with a value.
const CLOSED = /^(output|observe|stop)/; // groups that are opened when they are wanted
// Numbers of a formula, but for exponents and the 2 of 2 pi.
const LITERAL = /(?<![\w.]|\*\*\s*)(?!2\s*\*\s*pi)(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?(?![\w.])/gi;
const STEPS = 400; // of a slider
let built = ""; // the keys that have controls now
const fields = new Map(); // path -> { row, put }

const made = (tag, more = {}) => Object.assign(document.createElement(tag), more);
const rounded = (x) => Number(x.toPrecision(4));

function range(value) { // of a slider: decades about a number, or a share of its size
  if (value === 0) return { at: (v) => (v + 1) / 2, value: (a) => rounded(2 * a - 1) };
  const sign = Math.sign(value), size = Math.abs(value);
  return { at: (v) => (Math.log10((sign * v) / size) + 1) / 2, value: (a) => sign * rounded(size * 10 ** (2 * a - 1)) };
}

function whole(value) {
  const low = value < 8 ? 0 : Math.round(value / 4), high = value < 8 ? 16 : 4 * value;
  return { at: (v) => (v - low) / (high - low), value: (a) => Math.round(low + a * (high - low)) };
}

function literal(value) { // of a formula, where the sign stands before it
  const high = value === 0 ? 1 : 3 * value;
  return { at: (v) => v / high, value: (a) => rounded(a * high) };
}

function slider(scale, value, moved, name) {
  const one = made("input", { type: "range", min: 0, max: STEPS, step: 1, ariaLabel: name });
  const put = (v) => { const at = scale.at(v); one.value = Math.round(STEPS * (Number.isFinite(at) ? Math.min(1, Math.max(0, at)) : 0)); };
  one.addEventListener("input", () => moved(scale.value(one.value / STEPS)));
  put(value);
  return { one, put };
}

function numberField(control, row, change) {
  const box = made("input", { type: "text", inputMode: "decimal", ariaLabel: control.path, value: String(rounded(control.value)) });
  const { one, put } = slider((control.kind === "whole" ? whole : range)(control.value), control.value, (v) => { box.value = v; change(v); }, `${control.path}, slider`);
  box.addEventListener("change", () => { // a number, or a constant expression
    const number = Number(box.value);
    if (box.value.trim() && Number.isFinite(number)) put(number);
    change(box.value.trim() && Number.isFinite(number) ? number : box.value);
  });
  row.append(one, box);
  return (v) => { if (document.activeElement !== one) put(v); if (document.activeElement !== box) box.value = rounded(v); };
}

function formulaField(control, row, change) {
  const box = made("input", { type: "text", className: "wide", ariaLabel: control.path, value: control.value, spellcheck: false });
  let parts = [];
  const draw = () => {
    parts.forEach((part) => part.remove());
    const text = box.value, found = [...text.matchAll(LITERAL)];
    parts = found.map((match, k) => {
      const shown = made("span", { textContent: match[0] }), line = made("div", { className: "part" });
      const moved = (v) => {
        let count = -1;
        box.value = box.value.replace(LITERAL, (old) => (++count === k ? String(v) : old));
        shown.textContent = v;
        change(box.value);
      };
      line.append(slider(literal(Number(match[0])), Number(match[0]), moved, `${control.path}, number ${k + 1}`).one, shown);
      return line;
    });
    row.append(...parts);
  };
  box.addEventListener("change", () => { draw(); change(box.value); });
  row.append(box);
  draw();
  return (v) => { if (box.value !== v && !row.contains(document.activeElement)) { box.value = v; draw(); } };
}

function choiceField(control, row, change) {
  const box = made("select", { className: "wide", ariaLabel: control.path });
  box.append(...control.words.map((word) => made("option", { value: word, textContent: word })));
  box.value = control.value;
  box.addEventListener("change", () => change(box.value));
  row.append(box);
  return (v) => { box.value = v; };
}

function switchField(control, row, change) {
  const box = made("input", { type: "checkbox", checked: control.value, ariaLabel: control.path });
  box.addEventListener("change", () => change(box.checked));
  row.append(box);
  return (v) => { box.checked = v; };
}

const FIELDS = { number: numberField, whole: numberField, formula: formulaField, word: choiceField, switch: switchField };

function showControls(controls) {
  const keys = controls.map((c) => `${c.path} ${c.kind}`).join("\n");
  if (keys === built) {
    for (const c of controls) { fields.get(c.path).put(c.value); fields.get(c.path).row.classList.remove("bad"); }
    return;
  }
  built = keys;
  fields.clear();
  const groups = new Map();
  for (const c of controls) {
    if (!groups.has(c.group)) {
      const group = made("details", { open: !CLOSED.test(c.group) });
      group.append(made("summary", { textContent: c.group }));
      groups.set(c.group, group);
    }
    const row = made("div", { className: "control", title: `${c.path}: ${c.help.slice(0, 400)}` });
    row.append(made("span", { textContent: c.path.startsWith(`${c.group}.`) ? c.path.slice(c.group.length + 1) : c.path }));
    fields.set(c.path, { row, put: FIELDS[c.kind](c, row, (value) => send({ set: { [c.path]: value } })) });
    groups.get(c.group).append(row);
  }
  part("controls").replaceChildren(...groups.values());
}

function showFaults(lines) { // one a line, each with its key first
  part("fault").textContent = lines.join("\n");
  for (const [path, { row }] of fields) row.classList.toggle("bad", lines.some((line) => line.startsWith(`${path}:`)));
}
