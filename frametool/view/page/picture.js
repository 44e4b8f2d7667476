// Draw the picture: ground, links, trails, the path, axes, frames outside, a scale.

const MOST_ROUND = 600, MOST_LINES = 5000;  // largest number of frames drawn one by one, and with lines
const AXIS_LENGTHS = [14, 46];  // pixels, minimum and maximum
const EDGE = 60;  // pixels beyond the picture within which frames are drawn
const SMALL = "11px system-ui, sans-serif", NORMAL = "12px system-ui, 'DejaVu Sans', sans-serif";
const tint = {};
let drawing = false;  // the next picture is scheduled

function take_colours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["paper", "ink", "soft", "faint", "hot", "way", "sel", "x", "y", "z"]) {
    tint[name] = style.getPropertyValue(`--${name}`).trim();
  }
  tint.axes = [tint.x, tint.y, tint.z];
}

function redraw() {
  if (drawing) return;
  drawing = true;
  requestAnimationFrame(draw);
}

function draw() {
  drawing = false;
  begin_picture();
  pen.fillStyle = tint.paper;
  pen.fillRect(0, 0, width, height);
  if (state.grid) draw_ground();
  for (const each of extras.under) each();
  const frames = shown();
  for (const frame of frames) AT.set(project(origin(frame)), 3 * frame);
  const inside = frames.filter((frame) => is_inside(frame, EDGE));
  if (state.links) draw_links(frames);
  if (state.trails) draw_trails();
  draw_plumb_lines();
  draw_way();
  if (inside.length > MOST_LINES) draw_dust(inside);
  else draw_axes(inside);
  draw_others(inside);
  draw_outside(frames);
  draw_names(inside);
  draw_corner();
}

const x_of = (frame) => AT[3 * frame], y_of = (frame) => AT[3 * frame + 1];
const is_inside = (frame, edge) =>
  x_of(frame) > -edge && x_of(frame) < width + edge && y_of(frame) > -edge && y_of(frame) < height + edge;
const is_strong = (frame) => frame === state.source || frame === state.target || frame === state.hover;
const tint_of = (frame, other) => (frame === state.source ? tint.way : frame === state.target ? tint.sel : other);

function stroke(colour, wide, alpha = 1, dash = []) {
  pen.strokeStyle = colour;
  pen.lineWidth = wide;
  pen.globalAlpha = alpha;
  pen.setLineDash(dash);
  pen.stroke();
  pen.setLineDash([]);
  pen.globalAlpha = 1;
}

function segment(a, b) {
  if (Number.isNaN(a[0]) || Number.isNaN(b[0])) return;
  pen.moveTo(a[0], a[1]);
  pen.lineTo(b[0], b[1]);
}

function write(text, x, y, {font = SMALL, align = "center", base = "middle", colour = tint.soft} = {}) {
  pen.font = font;
  pen.textAlign = align;
  pen.textBaseline = base;
  pen.fillStyle = colour;
  pen.fillText(text, x, y);
}

function draw_ground() {
  const step = nice(70 / cam.scale), half = Math.max(cam.radius, width / cam.scale / 2.6);
  const reach = Math.min(60, Math.ceil(1.15 * half / step));
  const [mid_x, mid_y] = [Math.round(cam.at[0] / step), Math.round(cam.at[1] / step)];
  for (const bold of [false, true]) {
    pen.beginPath();
    for (let k = -reach; k <= reach; k++) {
      const x = (mid_x + k) * step, y = (mid_y + k) * step;
      const ends_x = [(mid_x - reach) * step, (mid_x + reach) * step];
      const ends_y = [(mid_y - reach) * step, (mid_y + reach) * step];
      if ((x === 0) === bold) segment(project([x, ends_y[0], 0]), project([x, ends_y[1], 0]));
      if ((y === 0) === bold) segment(project([ends_x[0], y, 0]), project([ends_x[1], y, 0]));
    }
    stroke(tint.faint, bold ? 2 : 1);
  }
}

function draw_links(frames) {
  pen.beginPath();
  for (const frame of frames) {
    const up = UP[frame];
    if (up >= 0 && SEEN[up] && !state.hidden.has(up)) segment([x_of(frame), y_of(frame)], project(origin(up)));
  }
  stroke(tint.soft, 1, 0.55, [4, 3]);
}

function draw_trails() {
  for (const {frame, points} of trails) {
    if (state.hidden.has(frame)) continue;
    const count = points.length, size = Math.ceil(count / 24);
    for (let at = 0; at < count; at += size) {
      pen.beginPath();
      let on = false;
      for (const point of points.slice(at, at + size + 1)) {
        if (point) pen[on ? "lineTo" : "moveTo"](...project(point));
        on = Boolean(point);
      }
      stroke(`hsl(${280 - 170 * at / count} 55% 48%)`, 1.5, 0.8);
    }
  }
}

// Draw the height of the chosen frames above the ground.
function draw_plumb_lines() {
  for (const frame of state.grid ? new Set([state.source, state.target, state.hover]) : []) {
    if (frame < 0 || !SEEN[frame]) continue;
    const [x, y] = origin(frame), top = project(origin(frame)), foot = project([x, y, 0]);
    if (!(Math.hypot(top[0] - foot[0], top[1] - foot[1]) > 6)) continue;
    pen.beginPath();
    segment(top, foot);
    stroke(tint.ink, 1, 1, [1, 3]);
    pen.beginPath();
    pen.ellipse(foot[0], foot[1], 4, 4 * Math.abs(Math.sin(cam.elevation)), 0, 0, 7);
    stroke(tint.ink, 1);
  }
}

// Draw the path from target to source, and the transform as an arrow.
function draw_way() {
  const {path, pose} = answer;
  if (!pose || !SEEN[state.target] || path.length < 2) return;
  const points = path.map((frame) => project(origin(frame)));
  pen.lineJoin = pen.lineCap = "round";
  pen.beginPath();
  points.slice(1).forEach((point, at) => segment(points[at], point));
  stroke(tint.way, 5, 0.35);
  pen.lineCap = "butt";
  const begin = points[0], end = points[points.length - 1];
  const dx = end[0] - begin[0], dy = end[1] - begin[1], size = Math.hypot(dx, dy);
  if (!(size > 24)) return;
  const [ux, uy] = [dx / size, dy / size], tip = [end[0] - 7 * ux, end[1] - 7 * uy];
  pen.beginPath();
  segment([begin[0] + 7 * ux, begin[1] + 7 * uy], tip);
  stroke(tint.way, 1.5);
  pen.beginPath();
  pen.moveTo(tip[0], tip[1]);
  pen.lineTo(tip[0] - 10 * ux + 4 * uy, tip[1] - 10 * uy - 4 * ux);
  pen.lineTo(tip[0] - 10 * ux - 4 * uy, tip[1] - 10 * uy + 4 * ux);
  pen.fillStyle = tint.way;
  pen.fill();
}

function axis_metres() {
  const [least, most] = AXIS_LENGTHS.map((pixels) => pixels / cam.scale);
  return Math.min(Math.max(0.55 * link_length, least), most) * state.size;
}

function draw_axes(inside) {
  const metres = axis_metres(), one_by_one = inside.length <= MOST_ROUND;
  for (let axis = 0; state.axes && !one_by_one && axis < 3; axis++) {
    pen.beginPath();
    for (const frame of inside) segment([x_of(frame), y_of(frame)], project(on_axis(frame, axis, metres)));
    stroke(tint.axes[axis], 1.4);
  }
  const frames = one_by_one ? inside : inside.filter(is_strong);
  for (const frame of frames.slice().sort((a, b) => AT[3 * a + 2] - AT[3 * b + 2])) draw_frame(frame, metres);
}

function draw_frame(frame, metres) {
  const x = x_of(frame), y = y_of(frame), strong = is_strong(frame);
  const toward = [0, 1, 2].sort((a, b) => depth_of_axis(frame, a) - depth_of_axis(frame, b));
  for (const axis of state.axes ? toward : []) {
    const tip = project(on_axis(frame, axis, strong ? 1.5 * metres : metres));
    pen.beginPath();
    segment([x, y], tip);
    stroke(tint.axes[axis], strong ? 3 : 2);
    const size = Math.hypot(tip[0] - x, tip[1] - y);
    if (strong && size > 16) {
      const [ux, uy] = [(tip[0] - x) / size, (tip[1] - y) / size];
      write("xyz"[axis], tip[0] + 8 * ux, tip[1] + 8 * uy, {font: `bold ${SMALL}`, colour: tint.axes[axis]});
    }
  }
  pen.beginPath();
  pen.arc(x, y, strong ? 4 : 2.4, 0, 7);
  pen.fillStyle = tint_of(frame, tint.ink);
  pen.fill();
  if (!strong) return;
  pen.beginPath();
  pen.arc(x, y, 8, 0, 7);
  stroke(tint_of(frame, tint.ink), 1.5);
}

// Draw the frames of the other tree, with lines to where they are in this one.
function draw_others(inside) {
  const metres = axis_metres();
  for (const frame of OTHER.size ? inside : []) {
    const pose = other_pose(frame);
    if (!pose) continue;
    const place = project(pose);
    const rows = to_matrix(rotation(pose));
    for (const axis of [0, 1, 2]) {
      pen.beginPath();
      segment(place, project(rows.map((row, k) => pose[k] + metres * row[axis])));
      stroke(tint.axes[axis], 2, 0.4);
    }
    pen.beginPath();
    segment([x_of(frame), y_of(frame)], place);
    stroke(tint.hot, 1.5);
  }
}

function depth_of_axis(frame, axis) {
  const at = 12 * frame + 3 + 3 * axis;
  return view[2][0] * WORLD[at] + view[2][1] * WORLD[at + 1] + view[2][2] * WORLD[at + 2];
}

// Draw very many frames as dots, directly into the picture's memory.
function draw_dust(inside) {
  const ratio = window.devicePixelRatio || 1, picture = pen.getImageData(0, 0, canvas.width, canvas.height);
  const dots = new Uint32Array(picture.data.buffer), size = ratio >= 2 ? 3 : 2;
  const colour = document.documentElement.classList.contains("dark") ? 0xffe8c4a7 : 0xffa03a5c;
  for (const frame of inside) {
    const left = Math.floor(x_of(frame) * ratio), top = Math.floor(y_of(frame) * ratio);
    for (let y = Math.max(top, 0); y < Math.min(top + size, canvas.height); y++) {
      for (let x = Math.max(left, 0); x < Math.min(left + size, canvas.width); x++) dots[y * canvas.width + x] = colour;
    }
  }
  pen.putImageData(picture, 0, 0);
  draw_axes(inside.filter(is_strong));
}

// Draw the directions of the axes of `fixed`, and the scale.
function draw_corner() {
  const [x, y] = [44, height - 44];
  for (const axis of [0, 1, 2].sort((a, b) => view[2][a] - view[2][b])) {
    const [dx, dy] = [view[0][axis], -view[1][axis]];
    pen.beginPath();
    segment([x, y], [x + 28 * dx, y + 28 * dy]);
    stroke(tint.axes[axis], 2);
    write("xyz"[axis], x + 37 * dx, y + 37 * dy, {font: `bold ${SMALL}`, colour: tint.axes[axis]});
  }
  const metres = nice(90 / cam.scale), long = metres * cam.scale, right = width - 20;
  pen.beginPath();
  segment([right - long, height - 20], [right, height - 20]);
  segment([right - long, height - 26], [right - long, height - 20]);
  segment([right, height - 26], [right, height - 20]);
  stroke(tint.ink, 1.2);
  write(in_words(metres), right - long / 2, height - 24, {font: NORMAL, base: "bottom", colour: tint.ink});
  const hidden = labels.hidden ? ` · ${labels.hidden} names hidden` : "";
  write(`seen in ${NAMES[state.fixed]}${hidden}`, right, height - 42, {align: "right", base: "bottom"});
}

function in_words(metres) {
  if (metres >= 1 || metres === 0) return `${+metres.toPrecision(3)} m`;
  return metres >= 0.01 ? `${+(metres * 100).toPrecision(3)} cm` : `${+(metres * 1000).toPrecision(3)} mm`;
}
