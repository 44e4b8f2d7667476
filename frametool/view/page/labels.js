// Place names next to frames, without overlaps: the chosen ones first, then moving ones, then the nearest.

const MOST_NAMES = 160, MOST_FAILED = 60, MANY = 3000, CELL = 64, LINE = 16;
const DISTANCES = [9, 20, 34, 52, 74];  // pixels from a frame to its name
const SIDES = [[1, -0.6], [1, 0.6], [-1, -0.6], [-1, 0.6], [0, -1.3], [0, 1.3], [1, 0], [-1, 0]];
const labels = {placed: [], outside: [], hidden: 0};

// Rectangles in a grid of cells: only near ones are compared.
class Rectangles {
  constructor() {
    this.cells = new Map();
  }

  // Return the numbers of the cells that a rectangle touches.
  near([left, top, right, bottom]) {
    const found = [];
    for (let x = Math.floor(left / CELL); x <= Math.floor(right / CELL); x++) {
      for (let y = Math.floor(top / CELL); y <= Math.floor(bottom / CELL); y++) found.push(4096 * x + y);
    }
    return found;
  }

  add(box) {
    for (const cell of this.near(box)) {
      if (!this.cells.has(cell)) this.cells.set(cell, []);
      this.cells.get(cell).push(box);
    }
  }

  meets([left, top, right, bottom]) {
    for (const cell of this.near([left, top, right, bottom])) {
      for (const o of this.cells.get(cell) || []) {
        if (left < o[2] && right > o[0] && top < o[3] && bottom > o[1]) return true;
      }
    }
    return false;
  }
}

function weight(frame) {
  if (frame === state.hover) return 4;
  if (frame === state.source) return 3;
  if (frame === state.target) return 2.5;
  return state.found && state.found.has(frame) ? 2 : TRACKS.has(frame) ? 1 : 0;
}

// Group frames on one point; they share one label.
function groups_of(frames) {
  const spots = new Map();
  for (const frame of frames) {
    if (Number.isNaN(x_of(frame))) continue;
    const spot = `${Math.round(x_of(frame) / 3)},${Math.round(y_of(frame) / 3)}`;
    if (!spots.has(spot)) spots.set(spot, []);
    spots.get(spot).push(frame);
  }
  const groups = [...spots.values()].map((group) => group.sort((a, b) => weight(b) - weight(a)));
  return groups.sort(([a], [b]) => weight(b) - weight(a) || AT[3 * b + 2] - AT[3 * a + 2]);
}

function words_of(group) {
  const [first, second] = group.map((frame) => NAMES[frame]), cut = (name) => (name.length > 60 ? `${name.slice(0, 59)}…` : name);
  if (group.length === 2 && first.length + second.length < 34) return `${first} · ${second}`;
  return cut(first) + (group.length > 1 ? ` +${group.length - 1}` : "");
}

function draw_names(inside) {
  const many = inside.length > MANY, taken = new Rectangles();
  const few_found = state.found && state.found.size < MANY;
  const wanted_name = (frame) => (state.names && !many) || weight(frame) > 2 || (few_found && state.found.has(frame));
  const groups = groups_of(inside.filter(wanted_name));
  if (!many) for (const frame of inside) taken.add([x_of(frame) - 3, y_of(frame) - 3, x_of(frame) + 3, y_of(frame) + 3]);
  taken.add([0, height - 92, 96, height]);
  labels.outside.forEach((box) => taken.add(box));
  labels.placed = [];
  let left_out = many ? inside.length : 0, failed = 0;
  pen.font = NORMAL;
  for (const group of groups) {
    const full = (labels.placed.length >= MOST_NAMES || failed > MOST_FAILED) && weight(group[0]) <= 2;
    const spot = full ? null : free_spot(group, taken, groups.length < MOST_NAMES);
    if (spot) place_name(group, spot, taken);
    else {
      failed++;
      left_out += group.length;
    }
  }
  labels.hidden = state.names ? left_out : 0;
}

// Find a spot for a name: clear of other names, and optionally of its own axes.
function free_spot(group, taken, avoid_axes) {
  const words = words_of(group), wide = pen.measureText(words).width, x = x_of(group[0]), y = y_of(group[0]);
  let second = null;
  for (const away of DISTANCES) {
    for (const [dx, dy] of SIDES) {
      const left = x + dx * away - (dx < 0 ? wide : dx === 0 ? wide / 2 : 0), middle = y + dy * away;
      const box = [left - 2, middle - LINE / 2, left + wide + 2, middle + LINE / 2];
      if (box[0] <= 0 || box[2] >= width || box[1] <= 0 || box[3] >= height || taken.meets(box)) continue;
      const spot = {words, away, left, middle, box};
      if (!avoid_axes || !group.some((frame) => crosses_axes(frame, box))) return spot;
      second = second || spot;
      if (away >= 40) return second;
    }
  }
  return second;
}

function crosses_axes(frame, box) {
  const metres = axis_metres();
  return [0, 1, 2].some((axis) => [0.35, 0.7, 1, 1.5].some((part) => {
    const [x, y] = project(on_axis(frame, axis, part * metres));
    return x > box[0] && x < box[2] && y > box[1] && y < box[3];
  }));
}

function place_name(group, {words, away, left, middle, box}, taken) {
  const [frame] = group;
  if (away > 20) {
    pen.beginPath();
    const end = [Math.min(Math.max(x_of(frame), box[0] + 2), box[2] - 2), middle > y_of(frame) ? box[1] : box[3]];
    segment([x_of(frame), y_of(frame)], end);
    stroke(tint.soft, 0.8, 0.6);
  }
  pen.font = NORMAL;
  pen.textAlign = "left";
  pen.textBaseline = "middle";
  pen.lineJoin = "round";
  pen.lineWidth = 3.5;
  pen.strokeStyle = tint.paper;
  pen.strokeText(words, left, middle);
  write(words, left, middle, {font: NORMAL, align: "left", colour: tint_of(frame, tint.ink)});
  taken.add(box);
  labels.placed.push({box, group, words});
}

// Point to the few frames outside of the picture, at its edge, with their distance.
function draw_outside(frames) {
  labels.outside = [];
  const out = frames.filter((frame) => !Number.isNaN(x_of(frame)) && !is_inside(frame, 0));
  if (out.length > 12) return;
  for (const frame of out) {
    const dx = x_of(frame) - width / 2, dy = y_of(frame) - height / 2, turn = Math.atan2(dy, dx);
    const part = Math.min((width / 2 - 16) / Math.abs(dx || 1e-9), (height / 2 - 46) / Math.abs(dy || 1e-9));
    const x = width / 2 + dx * part, right = x > width / 2, away = distance(origin(frame), cam.at);
    const words = `${NAMES[frame].slice(0, 60)} ${away >= 10 ? away.toFixed(0) : away.toPrecision(2)} m`;
    pen.font = SMALL;
    const wide = pen.measureText(words).width + 20;
    const box_at = (y) => [right ? x - wide : x - 8, y - 8, right ? x + 8 : x + wide, y + 8];
    let y = height / 2 + dy * part;
    const meets = (o) => box_at(y)[0] < o[2] && box_at(y)[2] > o[0] && Math.abs(y - (o[1] + o[3]) / 2) < LINE;
    while (labels.outside.some(meets)) y += y > height / 2 ? -LINE : LINE;
    labels.outside.push(box_at(y));
    pen.beginPath();
    for (const [size, angle] of [[7, 0], [5, 2.5], [5, -2.5]]) {
      pen.lineTo(x + size * Math.cos(turn + angle), y + size * Math.sin(turn + angle));
    }
    pen.fillStyle = tint_of(frame, tint.soft);
    pen.fill();
    write(words, x + (right ? -11 : 11), y, {align: right ? "right" : "left", colour: tint_of(frame, tint.soft)});
  }
}
