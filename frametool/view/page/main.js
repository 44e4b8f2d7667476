// Fill the page, and draw the first picture.

const theme = wanted.get("theme");
const is_dark = theme ? theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
document.documentElement.classList.toggle("dark", is_dark);
take_colours();
add_buttons();
listen();
for (const begin of extras.begin) begin();

const roots = ALL.filter((frame) => first_parent(frame) < 0).length;
const boxes = head.meshes ? ` · meshes drawn as boxes: ${head.meshes}` : "";
const moving = TRACKS.size ? `, ${TRACKS.size} moving` : "", several = roots > 1 ? `, ${roots} roots` : "";
$("head").textContent = head.title;
$("foot").textContent = `${COUNT} frames${moving}${several}${boxes} · ${head.made}`;
if (COUNT <= 2000) $("names").append(...NAMES.map((value) => make("option", {value})));
$("bar").hidden = !TRACKS.size;
$("source").value = NAMES[state.source];
$("target").value = NAMES[state.target];
press($("path"), state.path_only);
if (TRACKS.size) set_time(state.t);
else update();
trace();
show_list();
if (head.show.view) [cam.azimuth, cam.elevation] = head.show.view;
fit(!state.path_only);
new ResizeObserver(redraw).observe(canvas);
draw();

// for tests
window.frameview = {
  state, cam, draw, labels, notations, stamp,
  lookup: (target, source, t = state.t) => lookup(INDEX.get(target), INDEX.get(source), BigInt(t)),
  at: (name) => [x_of(INDEX.get(name)), y_of(INDEX.get(name))],
};
document.documentElement.dataset.ready = "1";
