// The tree of frames over time, as frametool.frames has it.  Times are BigInts of nanoseconds: doubles hold 104 days.
// Frames are numbers: indices of head.names; -1 is no frame.

const NAMES = head.names, COUNT = NAMES.length;
const PARENT = Int32Array.from(head.parents);  // of static frames
const POSE = new Float64Array(blob, 0, 7 * COUNT);
const TRACKS = new Map(head.tracks.map((track) => [track.frame, {  // of moving frames
  parents: track.parents, last: track.count - 1,
  stamps: new BigInt64Array(blob, track.at, track.count),
  samples: new Float64Array(blob, track.at + 8 * track.count, 7 * track.count),
}]));
const INDEX = new Map(NAMES.map((name, frame) => [name, frame]));
const FIRST = BigInt(head.first), LAST = BigInt(head.last);

const part_of = (array, width, at) => Array.from(array.subarray(width * at, width * at + width));
const varies = (track) => Array.isArray(track.parents);
const first_parent = (frame) => {
  const track = TRACKS.get(frame);
  return track ? (varies(track) ? track.parents[0] : track.parents) : PARENT[frame];
};

// Return the number of stamps up to a time.
function count_until(stamps, t) {
  let low = 0, high = stamps.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (stamps[middle] <= t) low = middle + 1; else high = middle;
  }
  return low;
}

// Return {parent, pose, moves} of a frame at a time; null for a root and without data.
function edge(frame, t) {
  const track = TRACKS.get(frame);
  if (!track) return PARENT[frame] < 0 ? null : {parent: PARENT[frame], pose: part_of(POSE, 7, frame), moves: false};
  const {stamps, samples, parents, last} = track, at = count_until(stamps, t) - 1;
  if (at < 0 || (at === last && stamps[at] !== t)) return null;
  const parent = varies(track) ? parents[at] : parents, here = part_of(samples, 7, at);
  if (stamps[at] === t) return {parent, pose: here, moves: true};
  const next = varies(track) && parents[at + 1] !== parent ? here : part_of(samples, 7, at + 1);
  return {parent, pose: along(here, next, Number(t - stamps[at]) / Number(stamps[at + 1] - stamps[at])), moves: true};
}

// List a frame and its ancestors with the edges between; `gap`: the moving frame without data at its end, or -1.
function to_root(frame, t) {
  const line = [frame], edges = [];
  for (let step = edge(frame, t); step && line.length <= COUNT; step = edge(step.parent, t)) {
    line.push(step.parent);
    edges.push(step);
  }
  const top = line[line.length - 1];
  return {line, edges, gap: TRACKS.has(top) ? top : -1};
}

// Compose the edges of one branch, topmost first: adjacent static ones before the others.
function product(edges) {
  const folded = [];
  for (const {pose, moves} of edges) {
    const before = folded[folded.length - 1];
    if (before && !moves && !before.moves) before.pose = compose(before.pose, pose);
    else folded.push({pose, moves});
  }
  return folded.map((each) => each.pose).reduce((whole, pose) => compose(whole, pose));
}

// Return {pose, path} of source seen from target, or {why, path: []}.
function lookup(target, source, t) {
  const down = to_root(target, t), up = to_root(source, t), place = new Map(up.line.map((frame, at) => [frame, at]));
  const meet = down.line.findIndex((frame) => place.has(frame));
  if (meet < 0) {
    const gap = up.gap >= 0 ? up.gap : down.gap;
    return {why: gap < 0 ? "not connected" : no_data(gap, t), path: []};
  }
  const below = place.get(down.line[meet]);
  const path = [...down.line.slice(0, meet + 1), ...up.line.slice(0, below).reverse()];
  const to_target = down.edges.slice(0, meet).reverse(), to_source = up.edges.slice(0, below).reverse();
  let pose = IDENTITY;
  if (to_target.length) pose = inverse(product(to_target));
  if (to_source.length) pose = to_target.length ? compose(pose, product(to_source)) : product(to_source);
  const moves = [...to_target, ...to_source].some((each) => each.moves);
  return {pose: moves ? [...position(pose), ...unit(rotation(pose))] : pose, path};
}

function no_data(frame, t) {
  const {stamps, last} = TRACKS.get(frame), late = t > stamps[last];
  const gap = Number(late ? t - stamps[last] : stamps[0] - t) / 1e9, end = late ? "late" : "early";
  const covered = `samples cover ${stamp(stamps[0])} .. ${stamp(stamps[last])}`;
  const between = `${NAMES[first_parent(frame)]} → ${NAMES[frame]}`;
  return `no data for ${between} at ${stamp(t)}; ${covered} (${+gap.toPrecision(6)} s too ${end})`;
}

// Write a time as seconds with nine decimals.
function stamp(t) {
  const size = t < 0n ? -t : t;
  return `${t < 0n ? "-" : ""}${size / 1000000000n}.${String(size % 1000000000n).padStart(9, "0")}`;
}

// Read seconds as nanoseconds by decimal arithmetic; null for anything else.
function parse_stamp(text) {
  const found = /^(-?)(\d+)(?:\.(\d{1,9}))?$/.exec(text);
  if (!found) return null;
  const size = BigInt(found[2] + (found[3] || "").padEnd(9, "0"));
  return found[1] ? -size : size;
}

const within = (t) => (t < FIRST ? FIRST : t > LAST ? LAST : t);

// Return the different stamps of some tracks, in order.
function stamps_of(tracks) {
  if (tracks.length === 1) return tracks[0].stamps;
  const all = BigInt64Array.from(tracks.flatMap(({stamps}) => [...stamps])).sort();
  return all.filter((t, at) => !at || t !== all[at - 1]);
}

// Return every frame at a time, parents before children; only changing parents affect their order.
const ALL = Array.from({length: COUNT}, (_, frame) => frame);
const REPARENTED = head.tracks.some((track) => Array.isArray(track.parents));
function ordered(t) {
  if (!REPARENTED) return ALL;
  const done = new Uint8Array(COUNT), order = [];
  for (const frame of ALL) {
    const line = [];
    for (let each = frame; each >= 0 && !done[each]; each = (edge(each, t) || {parent: -1}).parent) {
      done[each] = 1;
      line.push(each);
    }
    order.push(...line.reverse());
  }
  return order;
}

// Return the depth of every frame, and the number of its root, by the first parents.
function levels() {
  const depth = new Int32Array(COUNT), root = new Int32Array(COUNT);
  for (const frame of ALL) {
    const parent = first_parent(frame);
    root[frame] = parent < 0 ? frame : root[parent];
    depth[frame] = parent < 0 ? 0 : depth[parent] + 1;
  }
  return {depth, root};
}
