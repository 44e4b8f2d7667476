// Map metres in `fixed` to pixels: an orthographic or perspective view that orbits a point.

const SLANTED = [-0.9, 0.5];  // azimuth and elevation of the eye, radians
const cam = {azimuth: SLANTED[0], elevation: SLANTED[1], scale: 60, at: [0, 0, 0], radius: 1};
const canvas = document.getElementById("view"), pen = canvas.getContext("2d", {alpha: false});
let view = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];  // rows: right, up, toward the eye
let width = 1, height = 1, far = 1;  // pixels, pixels, metres from the eye
const AT = new Float32Array(3 * COUNT);  // for every drawn frame: pixels x, y, depth in metres

function view_axes() {
  const ca = Math.cos(cam.azimuth), sa = Math.sin(cam.azimuth);
  const ce = Math.cos(cam.elevation), se = Math.sin(cam.elevation);
  return [[-sa, ca, 0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]];
}

// Return pixels x, y and the depth toward the eye; NaN behind a perspective eye.
function project([px, py, pz]) {
  const x = px - cam.at[0], y = py - cam.at[1], z = pz - cam.at[2], [right, up, toward] = view;
  const depth = toward[0] * x + toward[1] * y + toward[2] * z;
  let scale = cam.scale;
  if (state.perspective) scale = far - depth > far * 0.02 ? scale * far / (far - depth) : NaN;
  return [
    width / 2 + (right[0] * x + right[1] * y + right[2] * z) * scale,
    height / 2 - (up[0] * x + up[1] * y + up[2] * z) * scale, depth];
}

function begin_picture() {
  const ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
  width = box.width;
  height = box.height;
  const pixels = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== pixels[0] || canvas.height !== pixels[1]) [canvas.width, canvas.height] = pixels;
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  view = view_axes();
  far = 3.2 * Math.max(cam.radius, height / cam.scale / 2);
}

// Leave out a few frames that are far from the others: a robot in a large map would be a spot.
function cluster(frames) {
  if (frames.length < 4) return frames;
  const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];
  const middle = [0, 1, 2].map((k) => median(frames.map((frame) => WORLD[12 * frame + k])));
  const away = frames.map((frame) => distance(origin(frame), middle)), sorted = away.slice().sort((a, b) => a - b);
  const reach = 2.5 * sorted[Math.floor(0.7 * (frames.length - 1))];
  const some_far = reach > 0 && sorted[sorted.length - 1] > 4 * reach;
  return some_far ? frames.filter((_, at) => away[at] <= reach) : frames;
}

// Fit all drawn frames into the picture, or the cluster in which most are.
function fit(most = false) {
  const all = shown(), frames = most ? cluster(all) : all, low = [Infinity, Infinity, Infinity], high = low.map((v) => -v);
  const take = (point) => point.forEach((value, k) => {
    low[k] = Math.min(low[k], value);
    high[k] = Math.max(high[k], value);
  });
  for (const frame of frames) take(origin(frame));
  for (const points of extras.points) points().forEach(take);
  if (frames.length === all.length) for (const {points} of trails) for (const point of points) if (point) take(point);
  if (low[0] > high[0]) {
    low.fill(-1);
    high.fill(1);
  }
  cam.at = low.map((value, k) => (value + high[k]) / 2);
  cam.radius = Math.max(distance(low, high) / 2, 1e-6);
  const box = canvas.getBoundingClientRect(), [right, up] = view_axes();
  const reach = (axis) => Math.max(1e-9, axis.reduce((sum, part, k) => sum + Math.abs(part) * (high[k] - low[k]) / 2, 0));
  const room = (pixels) => Math.max(pixels - 150, 60);
  const usual = Math.min(box.width, box.height) * 0.4 / (0.55 * link_length);
  cam.scale = Math.min(room(box.width) / reach(right) / 2, room(box.height) / reach(up) / 2, usual);
}

function orbit(a, b) {
  cam.azimuth += a;
  cam.elevation = Math.min(Math.max(cam.elevation + b, -Math.PI / 2), Math.PI / 2);
  redraw();
}

function pan(dx, dy) {
  const [right, up] = view_axes();
  cam.at = cam.at.map((value, k) => value + (dy * up[k] - dx * right[k]) / cam.scale);
  redraw();
}

function zoom(factor, x = width / 2, y = height / 2) {
  pan(width / 2 - x, height / 2 - y);
  cam.scale *= factor;
  pan(x - width / 2, y - height / 2);
}

function look_from(azimuth, elevation) {
  [cam.azimuth, cam.elevation] = [azimuth, elevation];
  fit();
  redraw();
}

// Return a length rounded to 1, 2 or 5 times a power of ten.
function nice(metres) {
  const power = 10 ** Math.floor(Math.log10(metres)), factor = metres / power;
  return (factor < 1.5 ? 1 : factor < 3.5 ? 2 : factor < 7.5 ? 5 : 10) * power;
}
