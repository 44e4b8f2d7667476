// Draw the solids of a robot in their frames: shaded faces below everything else, the farthest first.

const MOST_FACES = 2000, AROUND = 20, ARC = 5;  // faces drawn by default, at most; segments of a circle, of a quarter
const BOX = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];  // facing outwards

// Return a quarter circle about a centre as [radius, height], from its end on the axis to the other.
function quarter(radius, middle, way) {
  const points = [];
  for (let k = 0; k <= ARC; k++) {
    const angle = Math.PI / 2 * (1 - k / ARC);
    points.push([radius * Math.cos(angle), middle + way * radius * Math.sin(angle)]);
  }
  return points;
}

// Return the faces of a solid of revolution about z, from its outline, bottom to top.
function turned(outline) {
  const faces = [], at = ([radius, z], k) =>
    [radius * Math.cos(2 * Math.PI * k / AROUND), radius * Math.sin(2 * Math.PI * k / AROUND), z];
  for (let row = 1; row < outline.length; row++) {
    for (let k = 0; k < AROUND; k++) {
      faces.push([at(outline[row - 1], k), at(outline[row - 1], k + 1), at(outline[row], k + 1), at(outline[row], k)]);
    }
  }
  return faces;
}

function faces_of({kind, size: [a, b, c]}) {
  if (kind === "box") {
    const corner = (k) => [(k & 1 ? a : -a) / 2, (k & 2 ? b : -b) / 2, (k & 4 ? c : -c) / 2];
    return BOX.map((face) => face.map(corner));
  }
  const half = (b || 0) / 2;
  if (kind === "cylinder") return turned([[0, -half], [a, -half], [a, half], [0, half]]);
  return turned([...quarter(a, -half, -1), ...quarter(a, half, 1).reverse()]);
}

const placed = (pose, [x, y, z]) => position(compose(pose, [x, y, z, 0, 0, 0, 1]));
const FACES = head.solids.flatMap((solid) => faces_of(solid).map((face) =>
  ({frame: solid.frame, points: face.map((point) => placed(solid.pose, point))})));

// Return a point of a frame, expressed in `fixed`.
function in_fixed(frame, [x, y, z]) {
  const at = 12 * frame;
  return [0, 1, 2].map((k) => WORLD[at + k] + x * WORLD[at + 3 + k] + y * WORLD[at + 6 + k] + z * WORLD[at + 9 + k]);
}

const is_drawn = (frame) => state.solids && SEEN[frame] && !state.hidden.has(frame);

function draw_solids() {
  const faces = [], dark = document.documentElement.classList.contains("dark");
  for (const {frame, points} of FACES) {
    if (!is_drawn(frame)) continue;
    const ends = points.map((point) => in_fixed(frame, point)), flat = ends.map(project);
    const [a, b, c, d] = flat, area = (c[0] - a[0]) * (d[1] - b[1]) - (c[1] - a[1]) * (d[0] - b[0]);
    if (!(area < 0)) continue;  // seen from behind, or behind the eye
    const across = ends[2].map((value, k) => value - ends[0][k]), up = ends[3].map((value, k) => value - ends[1][k]);
    const normal = [0, 1, 2].map((k) => across[(k + 1) % 3] * up[(k + 2) % 3] - across[(k + 2) % 3] * up[(k + 1) % 3]);
    const light = [0, 1, 2].map((k) => 0.8 * view[2][k] + 0.5 * view[1][k] - 0.35 * view[0][k]);
    const bright = Math.max(normal.reduce((sum, value, k) => sum + value * light[k], 0), 0) / (length(...normal) || 1);
    faces.push({flat, bright, depth: (a[2] + b[2] + c[2] + d[2]) / 4});
  }
  faces.sort((one, other) => one.depth - other.depth);
  pen.lineJoin = "round";
  for (const {flat, bright} of faces) {
    pen.beginPath();
    for (const [x, y] of flat) pen.lineTo(x, y);
    pen.closePath();
    pen.fillStyle = pen.strokeStyle = `hsl(212 14% ${dark ? 20 + 26 * bright : 60 + 30 * bright}%)`;
    pen.lineWidth = 0.7;  // of the same colour, so that no gap shows between faces
    pen.fill();
    pen.stroke();
  }
}

state.solids = FACES.length <= MOST_FACES;
SWITCHES.solids = "s";
extras.under.push(draw_solids);
extras.points.push(() => FACES.filter(({frame}) => is_drawn(frame)).flatMap(({frame, points}) => points.map((point) => in_fixed(frame, point))));
window.solids = {FACES, draw: draw_solids};  // for tests
