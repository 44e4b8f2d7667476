// Mouse, touch, keys and buttons.

const TOUCH = 24, MOUSE = 13;  // pixels from a frame within which it is hit
const fingers = new Map();
let dragged = 0;  // pixels since the first finger came down

// ---- what is under the pointer
function frame_near(x, y, reach = MOUSE) {
  let nearest = -1, least = reach * reach;
  for (const frame of shown()) {
    const squared = (x_of(frame) - x) ** 2 + (y_of(frame) - y) ** 2;
    if (squared < least) [nearest, least] = [frame, squared];
  }
  if (nearest >= 0) return nearest;
  const under = labels.placed.find(({box}) => x > box[0] && x < box[2] && y > box[1] && y < box[3]);
  return under ? under.group[0] : -1;
}

function same_place(frame) {
  return shown().filter((each) => Math.hypot(x_of(each) - x_of(frame), y_of(each) - y_of(frame)) < 3);
}

function hover(x, y) {
  const frame = frame_near(x, y), tip = $("tip");
  if (frame !== state.hover) redraw();
  state.hover = frame;
  tip.hidden = frame < 0;
  if (frame < 0) return;
  tip.textContent = description(frame);
  tip.style.left = `${Math.max(4, Math.min(x + 16, width - tip.offsetWidth - 6))}px`;
  tip.style.top = `${Math.max(4, Math.min(y + 16, height - tip.offsetHeight - 6))}px`;
}

function description(frame) {
  const parent = UP[frame], lines = [NAMES[frame] + (parent < 0 ? "   (root)" : "")];
  const others = same_place(frame).filter((each) => each !== frame).map((each) => NAMES[each]);
  for (const seen_from of new Set(parent < 0 ? [state.fixed] : [parent, state.fixed])) {
    const {pose, why} = lookup(seen_from, frame, state.t), columns = (values) =>
      values.map((value) => value.toFixed(4).replace(/^-(0\.0+)$/, "$1").padStart(10)).join("");
    lines.push(`in ${NAMES[seen_from]}${why ? `: ${why}` : ""}`);
    if (!pose) continue;
    const {rpy_deg, q, axis, angle} = notations(pose);
    lines.push(`  xyz  ${columns(position(pose))}  m`, `  rpy  ${columns(rpy_deg)}  deg`, `  xyzw ${columns(q)}`);
    lines.push(`  axis ${columns(axis)}${columns([angle * RADIAN])} deg`);
  }
  if (difference(frame)) lines.push(`${difference(frame)} from ${head.overlay.title}`);
  if (others.length) lines.push(`same place: ${others.slice(0, 4).join(", ")}${others.length > 4 ? " …" : ""}`);
  return lines.join("\n");
}

// ---- pointer
canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
  dragged = 0;
  $("tip").hidden = true;
  canvas.focus({preventScroll: true});
});

canvas.addEventListener("pointermove", (event) => {
  const before = fingers.get(event.pointerId), now = [event.offsetX, event.offsetY];
  if (!before) {
    hover(...now);
    return;
  }
  const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
  dragged += Math.abs(dx) + Math.abs(dy);
  const apart = () => distance(...[...fingers.values()].map((place) => [...place, 0]));
  const wide = fingers.size === 2 ? apart() : 0;
  fingers.set(event.pointerId, now);
  if (fingers.size === 2) {
    const [a, b] = [...fingers.values()];
    zoom(apart() / (wide || 1), (a[0] + b[0]) / 2, (a[1] + b[1]) / 2);
    pan(dx / 2, dy / 2);
  } else if (dragged >= 4 && (event.buttons & 6 || event.shiftKey)) pan(dx, dy);
  else if (dragged >= 4) orbit(-dx * 0.008, dy * 0.008);
});

function lift(event) {
  if (!fingers.delete(event.pointerId) || dragged >= 4 || event.type !== "pointerup") return;
  const frame = frame_near(event.offsetX, event.offsetY, event.pointerType === "touch" ? TOUCH : MOUSE);
  if (frame < 0) return;
  const here = same_place(frame), role = event.shiftKey ? "target" : "source";
  choose(here[(here.indexOf(state[role]) + 1) % here.length] ?? frame, role);
  hover(event.offsetX, event.offsetY);
}

canvas.addEventListener("pointerup", lift);
canvas.addEventListener("pointercancel", lift);
canvas.addEventListener("pointerleave", () => {
  state.hover = -1;
  $("tip").hidden = true;
  redraw();
});
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), event.offsetX, event.offsetY);
}, {passive: false});
canvas.addEventListener("dblclick", (event) => {
  const frame = frame_near(event.offsetX, event.offsetY);
  if (frame >= 0) focus_on(frame);
  else show_all();
});
canvas.addEventListener("contextmenu", (event) => event.preventDefault());

function show_all() {
  fit();
  redraw();
}

// ---- buttons over the picture
const VIEWS = {front: [0, 0], side: [-Math.PI / 2, 0], top: [-Math.PI / 2, Math.PI / 2], "3-D": SLANTED};
const VIEW_KEYS = {front: "1", side: "3", top: "7", "3-D": "0"};
const SWITCHES = {names: "n", axes: "a", links: "l", grid: "g", trails: "t", perspective: "p"};
const switches = {};

function add_button(text, title, act) {
  const button = make("button", {textContent: text, title, ariaLabel: title, onclick: act});
  $("tools").append(button);
  return button;
}

function press(button, on) {
  button.setAttribute("aria-pressed", on);
}

function add_buttons() {
  for (const [name, key] of Object.entries(SWITCHES)) {
    if (name === "trails" && !TRACKS.size) continue;
    switches[key] = add_button(name, `${name} on or off (${key})`, () => {
      state[name] = !state[name];
      press(switches[key], state[name]);
      redraw();
    });
    press(switches[key], state[name]);
  }
  add_button("fit", "Show all (f)", show_all);
  for (const [name, angles] of Object.entries(VIEWS)) {
    add_button(name, `From the ${name} (${VIEW_KEYS[name]})`, () => look_from(...angles));
  }
  add_button("◐", "Dark or light (d)", toggle_dark);
  add_button("?", "Keys (?)", toggle_help);
}

function toggle_dark() {
  document.documentElement.classList.toggle("dark");
  take_colours();
  redraw();
}

function toggle_help() {
  $("help").hidden = !$("help").hidden;
}

function toggle_path() {
  state.path_only = !state.path_only;
  press($("path"), state.path_only);
  redraw();
}

// ---- keys
const KEYS = {
  ArrowLeft: () => orbit(0.1, 0),
  ArrowRight: () => orbit(-0.1, 0),
  ArrowUp: () => orbit(0, 0.1),
  ArrowDown: () => orbit(0, -0.1),
  "+": () => zoom(1.2),
  "=": () => zoom(1.2),
  "-": () => zoom(1 / 1.2),
  f: show_all,
  d: toggle_dark,
  x: swap,
  h: toggle_path,
  v: () => see_in(state.target),
  "/": () => $("find").focus(),
  "?": toggle_help,
  " ": () => $("play").click(),
  ",": () => hop(-1),
  ".": () => hop(1),
  "[": () => size_axes(1 / 1.25),
  "]": () => size_axes(1.25),
  Escape: () => {
    $("find").value = "";
    $("help").hidden = true;
    show_list();
  },
};
for (const [name, key] of Object.entries(VIEW_KEYS)) KEYS[key] = () => look_from(...VIEWS[name]);

function size_axes(factor) {
  state.size *= factor;
  redraw();
}

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.target.matches("input[type=text], input[type=search], select")) {
    if (event.key === "Escape") canvas.focus();
    return;
  }
  const act = switches[event.key] ? () => switches[event.key].click() : KEYS[event.key];
  const own = (event.key === " " && event.target.matches("button"))
    || (event.target.id === "slide" && event.key.startsWith("Arrow"));
  if (!act || own) return;
  event.preventDefault();
  act();
});

// ---- time
const STAMPS = stamps_of([...TRACKS.values()]);

function hop(way) {
  const next = STAMPS[way > 0 ? count_until(STAMPS, state.t) : count_until(STAMPS, state.t - 1n) - 1];
  if (next !== undefined) set_time(next);
}

let last_frame = 0;
function play(now) {
  if (!state.playing) return;
  set_time(state.t + BigInt(Math.round((now - last_frame) * 1e6 * Number($("speed").value))));
  last_frame = now;
  if (state.t >= LAST) toggle_play();
  else requestAnimationFrame(play);
}

function toggle_play() {
  state.playing = !state.playing;
  $("play").textContent = state.playing ? "❚❚" : "▶";
  if (!state.playing) {
    remember();
    return;
  }
  if (state.t >= LAST) set_time(FIRST);
  last_frame = performance.now();
  requestAnimationFrame(play);
}

// ---- the panel
async function copy(button, text) {
  const label = button.textContent;
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const area = make("textarea", {value: text});
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
  button.textContent = "copied";
  setTimeout(() => { button.textContent = label; }, 900);
}

function listen() {
  for (const role of ["source", "target"]) {
    $(role).addEventListener("change", () => {
      const frame = INDEX.get($(role).value);
      $(role).classList.toggle("bad", frame === undefined);
      if (frame !== undefined) choose(frame, role);
    });
  }
  $("swap").onclick = swap;
  $("path").onclick = toggle_path;
  $("find").oninput = show_list;
  $("only").onclick = () => {
    state.only_found = !state.only_found;
    press($("only"), state.only_found);
    show_all();
  };
  $("exact").onclick = () => {
    state.exact = !state.exact;
    press($("exact"), state.exact);
    show_answer();
  };
  $("copy").onclick = () => answer.pose && copy($("copy"), yaml());
  $("shell").onclick = () => copy($("shell"), command());
  $("slide").oninput = () => set_time(FIRST + BigInt(Math.round(Number($("slide").value) * Number(LAST - FIRST))));
  $("slide").onchange = remember;
  $("play").onclick = toggle_play;
}
