// The choices of the page.  They begin with the command's options, which the page's fragment overrides, so that a
// view can be linked: #target=map&source=tool&t=1.5&fixed=odom&theme=dark

const wanted = new URLSearchParams(location.hash.slice(1));
const {depth: DEPTH, root: ROOT} = levels();

// Return the root with the most descendants.
function biggest_root() {
  const count = new Map();
  for (const root of ROOT) count.set(root, (count.get(root) || 0) + 1);
  return [...count].reduce((most, each) => (each[1] > most[1] ? each : most))[0];
}

// Return the deepest frame below a root.
function deepest(root) {
  return ALL.reduce((found, frame) => (ROOT[frame] === root && DEPTH[frame] > DEPTH[found] ? frame : found), root);
}

const chosen = head.show.only ? new Set(head.show.only) : null;
const named = (key) => INDEX.get(wanted.get(key) ?? head.show[key] ?? undefined);
const HOME = named("fixed") ?? biggest_root();
const state = {
  fixed: HOME, target: named("target") ?? HOME, source: named("source") ?? deepest(HOME), hover: -1,
  t: 0n, playing: false, exact: false, found: null, only_found: false, path_only: Boolean(head.show.path),
  hidden: new Set(chosen ? ALL.filter((frame) => !chosen.has(NAMES[frame])) : []),
  names: true, axes: true, links: true, grid: true, trails: true, perspective: false, size: 1,
};

// Begin at a time at which all edges have data, if there is one.
const common = [...TRACKS.values()].reduce((latest, {stamps: [t]}) => (t > latest ? t : latest), FIRST);
state.t = within(parse_stamp(wanted.get("t") ?? head.show.t ?? "") ?? common);

// The pose of every frame in `fixed` at state.t: origin, then the axes x, y, z.
const WORLD = new Float64Array(12 * COUNT), SEEN = new Uint8Array(COUNT), UP = new Int32Array(COUNT);
let link_length = 0.5;  // the median distance from a frame to its parent

function place_frames() {
  const poses = new Array(COUNT), base = new Int32Array(COUNT).fill(-1);
  for (const frame of ordered(state.t)) {
    const step = edge(frame, state.t);
    UP[frame] = step ? step.parent : -1;
    if (step && base[step.parent] >= 0) {
      base[frame] = base[step.parent];
      poses[frame] = compose(poses[step.parent], step.pose);
    } else if (!step && !TRACKS.has(frame)) {
      base[frame] = frame;
      poses[frame] = IDENTITY;
    }
  }
  const home = base[state.fixed], back = inverse(poses[state.fixed] || IDENTITY);
  for (let frame = 0; frame < COUNT; frame++) {
    SEEN[frame] = base[frame] >= 0 && base[frame] === home ? 1 : 0;
    if (!SEEN[frame]) continue;
    const pose = compose(back, poses[frame]), [a, b, c] = to_matrix(rotation(pose));
    WORLD.set([pose[0], pose[1], pose[2], a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2]], 12 * frame);
  }
  link_length = usual_link();
}

function usual_link() {
  const lengths = [];
  for (let frame = 0; frame < COUNT; frame++) {
    if (!SEEN[frame] || UP[frame] < 0) continue;
    const size = distance(origin(frame), origin(UP[frame]));
    if (size > 1e-9) lengths.push(size);
  }
  lengths.sort((a, b) => a - b);
  return lengths.length ? lengths[lengths.length >> 1] : 0.5;
}

const origin = (frame) => WORLD.subarray(12 * frame, 12 * frame + 3);
const distance = (a, b) => length(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

// Return the point of an axis of a frame at a distance in metres.
function on_axis(frame, axis, metres) {
  const at = 12 * frame, along_axis = at + 3 + 3 * axis;
  return [0, 1, 2].map((k) => WORLD[at + k] + metres * WORLD[along_axis + k]);
}

// ---- another tree laid over this one: poses of the frames of the same names, in the first `fixed`
const OTHER = new Map(Object.entries(head.overlay ? head.overlay.poses : {}).map(([key, pose]) => [Number(key), pose]));

function other_pose(frame) {
  const back = OTHER.get(state.fixed), pose = OTHER.get(frame);
  return back && pose ? compose(inverse(back), pose) : null;
}

// Return a text with the distance of a frame from itself in the other tree; "" if it is not in both.
function difference(frame) {
  const here = lookup(state.fixed, frame, state.t).pose, there = other_pose(frame);
  if (!here || !there) return "";
  const turned = compose_rotations(rotation(inverse(here)), rotation(there));
  const degrees = to_axis_angle(unit(turned)).angle * RADIAN;
  return `${in_words(distance(here, there))} ${+degrees.toPrecision(3)}°`;
}

// List the frames that are drawn.
function shown() {
  const path = state.path_only ? new Set(answer.path) : null;
  return ALL.filter((frame) => SEEN[frame] && !state.hidden.has(frame)
    && (!path || path.has(frame)) && (!state.only_found || !state.found || state.found.has(frame)));
}

// ---- trails: the paths of moving frames in `fixed`, violet to green; null at gaps
const MOST_TRAIL = 4000, PARTS = 8;
let trails = [];

function trace() {
  const frames = new Set(TRACKS.size ? [...TRACKS.keys(), state.source] : []);
  trails = [...frames].map((frame) => ({frame, points: trail(frame)})).filter((each) => each.points.length);
}

// Collect the moving frames on any path from a frame to its root.
function movers_above(frame, into) {
  for (let each = frame; each >= 0;) {
    const track = TRACKS.get(each);
    if (track) {
      if (into.has(each)) return into;
      into.add(each);
      if (varies(track)) for (const parent of new Set(track.parents)) movers_above(parent, into);
    }
    each = track && varies(track) ? -1 : first_parent(each);
  }
  return into;
}

function trail(frame) {
  const movers = movers_above(state.fixed, movers_above(frame, new Set()));
  const stamps = stamps_of([...movers].map((mover) => TRACKS.get(mover))), every = Math.max(1, Math.ceil(stamps.length / MOST_TRAIL));
  const parts = stamps.length > 500 ? 1 : PARTS, points = [];
  let before = "";
  const visit = (t) => {
    const {pose, path} = lookup(state.fixed, frame, t), way = path.join();
    if (way !== before && points.length) points.push(null);
    points.push(pose ? position(pose) : null);
    before = way;
  };
  for (let at = 0; at < stamps.length; at += every) {
    visit(stamps[at]);
    for (let part = 1; part < parts && at + 1 < stamps.length; part++) {
      visit(stamps[at] + (stamps[at + 1] - stamps[at]) * BigInt(part) / BigInt(parts));
    }
  }
  const start = points.find((point) => point);
  return start && points.some((point) => point && distance(point, start) > 1e-9) ? points : [];
}
