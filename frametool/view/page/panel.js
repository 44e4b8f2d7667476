// The panel: the numbers of a transform, the list of frames, and text to copy.

const MOST_LISTED = 300;
const $ = (id) => document.getElementById(id);
const make = (tag, properties) => Object.assign(document.createElement(tag), properties);
const bold = (text) => make("b", {textContent: text});
let answer = {path: []};  // the result of `lookup` for target and source

// Return a number rounded for reading, or with all digits as the command writes it.
function digits(value) {
  if (state.exact) return all_digits(value);
  return value.toFixed(6).replace(/^-(0\.0+)$/, "$1");
}

function all_digits(value) {
  const size = Math.abs(value);
  if (value === 0) return "0.0";
  if (size >= 1e16 || size < 1e-4) {  // Python's repr has at least two digits of exponent
    return value.toExponential().replace(/e([+-])(\d)$/, "e$10$2");
  }
  return Number.isInteger(value) ? value.toFixed(1) : String(value);
}

const lettered = (letters, values) => values.map((value, at) => [letters[at], value]);

function show_answer() {
  answer = lookup(state.target, state.source, state.t);
  const say = $("say"), body = $("pose").tBodies[0];
  say.textContent = body.textContent = $("way").textContent = "";
  say.className = answer.why ? "bad" : "";
  if (answer.why) {
    say.textContent = `${NAMES[state.source]} seen from ${NAMES[state.target]}: ${answer.why}`;
    return;
  }
  say.append(bold(NAMES[state.source]), " seen from ", bold(NAMES[state.target]), at_time());
  $("way").textContent = answer.path.map((frame) => NAMES[frame]).join(" ← ");
  body.dataset.pose = JSON.stringify(answer.pose);
  const pose = notations(answer.pose), [x, y, z, w] = pose.q;
  const rad = pose.locked ? "rad ⚠" : "rad";
  add_row(body, "position", lettered("xyz", position(answer.pose)), "m");
  add_row(body, "quaternion", lettered("xyz", [x, y, z]));
  add_row(body, "", [["w", w]]);
  add_row(body, "roll pitch yaw", lettered("rpy", pose.rpy), rad);
  add_row(body, "", lettered("rpy", pose.rpy_deg), "deg");
  add_row(body, "axis", lettered("xyz", pose.axis));
  add_row(body, "angle", [["", pose.angle]], "rad");
  add_row(body, "", [["", pose.angle * RADIAN]], "deg");
  add_row(body, "rotvec", lettered("xyz", pose.rotvec), "rad");
  pose.matrix.forEach((row, at) => add_row(body, at ? "" : "matrix", row.map((value) => ["", value])));
  add_row(body, "distance", [["", length(...position(answer.pose))]], "m");
  if (pose.locked) {
    const textContent = "⚠ gimbal lock: roll and yaw turn about one axis; yaw is set to 0";
    Object.assign(body.insertRow().insertCell(), {colSpan: 5, className: "bad note", textContent});
  }
}

const at_time = () => (TRACKS.size ? ` at ${stamp(state.t)}` : "");

function add_row(body, label, cells, unit = "") {
  const row = body.insertRow();
  row.append(make("th", {textContent: label}));
  for (let at = cells.length; at < 3; at++) row.insertCell();
  for (const [letter, value] of cells) {
    row.insertCell().append(...letter ? [make("small", {textContent: letter})] : [], digits(value));
  }
  Object.assign(row.insertCell(), {className: "unit", textContent: unit});
}

// Return the result as an entry of a tree.
function yaml() {
  const [x, y, z] = position(answer.pose).map(all_digits), q = notations(answer.pose).q.map(all_digits);
  const rotation_text = `{x: ${q[0]}, y: ${q[1]}, z: ${q[2]}, w: ${q[3]}}`;
  const names = `name: ${JSON.stringify(NAMES[state.source])}, parent: ${JSON.stringify(NAMES[state.target])}`;
  return `{${names}, xyz: [${x}, ${y}, ${z}], quaternion: ${rotation_text}}`;
}

const quoted = (text) => (/^[\w./=-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);

// Return the command with the same result.
function command() {
  const at = TRACKS.size ? ` --at ${stamp(state.t)}` : "";
  const names = [head.file, NAMES[state.target], NAMES[state.source]], more = extras.shell.map((part) => part());
  return `frametool lookup ${names.map(quoted).join(" ")}${at}${more.join("")}`;
}

// ---- the list of frames, as a tree
function matcher(text) {
  const low = text.toLowerCase(), plain = (name) => name.toLowerCase().includes(low);
  if (!(text.length > 2 && text.startsWith("/") && text.endsWith("/"))) return plain;
  try {
    const pattern = new RegExp(text.slice(1, -1), "i");
    return (name) => pattern.test(name);
  } catch {
    return plain;  // not complete yet
  }
}

function show_list() {
  const box = $("list"), text = $("find").value.trim(), fits = matcher(text);
  const found = text ? ALL.filter((frame) => fits(NAMES[frame])) : ALL;
  state.found = text ? new Set(found) : null;
  box.textContent = "";
  for (const frame of found.slice(0, MOST_LISTED)) box.append(list_row(frame, text));
  const more = found.length - MOST_LISTED, said = more > 0 ? `… and ${more} more: search` : "no frame of this name";
  if (more > 0 || !found.length) box.append(make("p", {textContent: said}));
  redraw();
}

function list_row(frame, searching) {
  const note = !SEEN[frame] ? "elsewhere" : difference(frame) || (TRACKS.has(frame) ? "moves" : "");
  const tick = make("input", {
    type: "checkbox", checked: !state.hidden.has(frame), tabIndex: -1, title: "Draw it (Alt: with all below it)"});
  tick.onclick = (event) => {
    event.stopPropagation();
    for (const each of event.altKey ? below(frame) : [frame]) {
      if (tick.checked) state.hidden.delete(each);
      else state.hidden.add(each);
    }
    if (event.altKey) show_list();
    redraw();
  };
  const name = make("span", {textContent: NAMES[frame], title: NAMES[frame]});
  name.style.paddingLeft = searching ? 0 : `${Math.min(DEPTH[frame], 12) * 10}px`;
  const row = make("div", {
    role: "option",
    onclick: (event) => choose(frame, event.shiftKey ? "target" : "source"),
    ondblclick: () => focus_on(frame),
  });
  row.dataset.frame = frame;
  mark_row(row);
  row.append(tick, name, make("em", {textContent: note}));
  return row;
}

function mark_row(row) {
  const on = Number(row.dataset.frame) === state.source;
  row.className = on ? "on" : "";
  row.setAttribute("aria-selected", on);
  return on;
}

function below(frame) {
  const found = new Set([frame]);
  for (const each of ordered(state.t)) if (found.has(UP[each])) found.add(each);
  return found;
}

// ---- changes
function choose(frame, role) {
  state[role] = frame;
  $(role).value = NAMES[frame];
  if (role === "source" && TRACKS.size) trace();
  for (const row of $("list").querySelectorAll("div")) if (mark_row(row)) row.scrollIntoView({block: "nearest"});
  show_answer();
  remember();
  redraw();
}

function swap() {
  const {source, target} = state;
  choose(target, "source");
  choose(source, "target");
}

// Put a frame in the middle; one of another tree becomes the fixed frame.
function focus_on(frame) {
  if (SEEN[frame]) {
    cam.at = Array.from(origin(frame));
    cam.scale = Math.max(cam.scale, 60 / Math.max(link_length, 1e-9));
    redraw();
  } else see_in(frame);
}

function see_in(frame) {
  state.fixed = frame;
  update();
  trace();
  fit();
  show_list();
  remember();
}

function update() {
  place_frames();
  show_answer();
  redraw();
}

function set_time(t) {
  state.t = within(t);
  $("slide").value = String(Number(state.t - FIRST) / (Number(LAST - FIRST) || 1));
  $("clock").textContent = `${stamp(state.t)} s`;
  update();
}

// Store the choices in the address, so that it links to this view.
function remember() {
  const fragment = new URLSearchParams({target: NAMES[state.target], source: NAMES[state.source]});
  if (state.fixed !== HOME) fragment.set("fixed", NAMES[state.fixed]);
  if (TRACKS.size) fragment.set("t", stamp(state.t));
  for (const add of extras.fragment) add(fragment);
  try {
    history.replaceState(null, "", `#${fragment}`);
  } catch { /* some viewers forbid it */ }
}
