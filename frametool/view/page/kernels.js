// Rigid-body arithmetic by the steps and names of frametool.geometry, only + - * / and roots: page and command
// print the same digits.  A pose is [tx, ty, tz, x, y, z, w], parent_from_child.

const EPS = 2 ** -52, UNIT = 4 * EPS, TINY = 1e-150, LOCK = EPS * EPS;
const RADIAN = 180 / Math.PI;
const IDENTITY = [0, 0, 0, 0, 0, 0, 1];

// ---- trig.py
const SINE = [
  -0.16666666666666666, 0.008333333333330948, -0.0001984126983675857,
  2.755731610255057e-06, -2.5051131844614108e-08, 1.5918129266803394e-10];
const ARC_ABOVE = [
  404.44958201411697, 905.3726290655958, 709.2810809323058, 230.9790943899718, 28.6344514670043, 0.9024525862982413];
const ARC_BELOW = [
  1213.3487460423516, 3444.127134821938, 3674.312918256491, 1825.9201295139483, 423.8789826719409, 39.96465648522898];
const LEVEL = 2 ** -27, RIGHT_ANGLE = 0.5 * Math.PI, RIGHT_ANGLE_REST = 6.123233995736766e-17;

function doubled_sincos(y) {
  const [s1, s2, s3, s4, s5, s6] = SINE, squared = y * y;
  const bend = (((((squared * s6 + s5) * squared + s4) * squared + s3) * squared + s2) * squared + s1) * squared * y;
  const sine = y + bend;
  const squared_sine = sine * sine + (y - sine + bend) * sine * 2;
  let cosine = squared_sine * -2 + 1;
  if (cosine < LEVEL) cosine = RIGHT_ANGLE - Math.abs(y + y) + RIGHT_ANGLE_REST;
  return [Math.sqrt(1 - squared_sine) * 2 * sine, cosine];
}

function half_sincos(angle) {  // |angle| <= pi here: full turns of a joint are removed
  return doubled_sincos(0.25 * angle);
}

function doubled_arctan(tangent) {
  const [a1, a2, a3, a4, a5, a6] = ARC_ABOVE, [b1, b2, b3, b4, b5, b6] = ARC_BELOW, squared = tangent * tangent;
  const above = ((((squared * a6 + a5) * squared + a4) * squared + a3) * squared + a2) * squared + a1;
  const below = (((((squared + b6) * squared + b5) * squared + b4) * squared + b3) * squared + b2) * squared + b1;
  return (tangent - above / below * squared * tangent) * 2;
}

function incline(rise, run) {
  if (rise === run) return 0.25 * Math.PI;
  const length = 0.5 + 0.5 * (rise * rise + run * run);
  return doubled_arctan(rise / (length + run));
}

const sign_of = (x) => (Object.is(x, -0) || x < 0 ? -1 : 1);

function bearing(y, x, radius) {
  const side = sign_of(x);
  return doubled_arctan(y / (radius + Math.abs(x))) * side + (0.5 - 0.5 * side) * sign_of(y) * Math.PI;
}

// ---- quaternion.py
const length = (x, y, z) => Math.sqrt(x * x + y * y + z * z);
const squared_norm = (x, y, z, w) => x * x + y * y + z * z + w * w;

function compose_rotations([ax, ay, az, aw], [bx, by, bz, bw]) {
  const x = aw * bx + ax * bw + ay * bz - az * by;
  const y = aw * by - ax * bz + ay * bw + az * bx;
  const z = aw * bz + ax * by - ay * bx + az * bw;
  const w = aw * bw - ax * bx - ay * by - az * bz;
  const norm = 0.5 + 0.5 * (x * x + y * y + z * z + w * w);
  return [x / norm, y / norm, z / norm, w / norm];
}

function unit([x, y, z, w]) {
  const squared = squared_norm(x, y, z, w);
  if (Math.abs(squared - 1) <= UNIT) return [x, y, z, w];
  const norm = Math.sqrt(squared);
  return [x / norm, y / norm, z / norm, w / norm];
}

function canonical(q) {
  const [x, y, z, w] = q;
  return (w || x || y || z) < 0 ? q.map((part) => 0 - part) : q;
}

function to_matrix([x, y, z, w]) {
  const scale = 2 / (x * x + y * y + z * z + w * w);
  const xs = x * scale, ys = y * scale, zs = z * scale;
  const wx = w * xs, wy = w * ys, wz = w * zs;
  const xx = x * xs, xy = x * ys, xz = x * zs;
  const yy = y * ys, yz = y * zs, zz = z * zs;
  return [
    [1 - (yy + zz), xy - wz, xz + wy],
    [xy + wz, 1 - (xx + zz), yz - wx],
    [xz - wy, yz + wx, 1 - (xx + yy)]];
}

function rotate(q, [px, py, pz]) {
  return to_matrix(q).map(([a, b, c]) => a * px + b * py + c * pz);
}

// ---- rigid.py and segment.py
const position = (pose) => pose.slice(0, 3), rotation = (pose) => pose.slice(3);

function compose(a, b) {
  const [x, y, z] = rotate(rotation(a), b);
  return [x + a[0], y + a[1], z + a[2], ...compose_rotations(rotation(a), rotation(b))];
}

function inverse(pose) {
  const q = [0 - pose[3], 0 - pose[4], 0 - pose[5], pose[6]], [x, y, z] = rotate(q, pose);
  return [0 - x, 0 - y, 0 - z, ...q];
}

function along(a, b, fraction) {  // from sample a to sample b: `toward`, then `along`
  const q = rotation(a), to = rotation(b), dot = q[0] * to[0] + q[1] * to[1] + q[2] * to[2] + q[3] * to[3];
  const lengths = [-1, 1].map((k) => Math.sqrt(squared_norm(...to.map((part, at) => part + k * q[at]))));
  const least = 0.5 * Math.min(...lengths), apart = Math.max(least, TINY), near = 0.5 * Math.max(...lengths);
  const sign = dot < 0 ? -1 : 1, ahead = 0.5 / (apart * near), beside = apart / near;
  const [sine, cosine] = doubled_sincos(fraction * incline(least, near));
  return [0, 1, 2].map((k) => a[k] + fraction * (b[k] - a[k]))
    .concat(q.map((part, at) => cosine * part + sine * (ahead * (sign * to[at] - part) + beside * part)));
}

// ---- euler.py (sxyz), axis_angle.py, rotvec.py
function to_rpy([x, y, z, w]) {
  // the axes of sxyz are z, y, x from outside to inside, of odd parity
  const signed = -y;
  let a = w + signed, b = z + x, c = w - signed, d = z - x;
  const sum = a * a + b * b, difference = c * c + d * d, limit = LOCK * (sum + difference);
  let radius = Math.sqrt(sum * difference);
  const middle = incline(2 * (w * y + z * x * -1), radius);
  const no_sum = sum <= limit, no_difference = difference <= limit;
  if (no_sum) [a, b, radius] = [c, 0 - d, difference];
  else if (no_difference) [c, d, radius] = [a, 0 - b, sum];
  const outer = bearing(b * c + a * d + 0, a * c - b * d, radius);
  const inner = bearing(b * c - a * d + 0, a * c + b * d, radius);
  return {angles: [inner, middle, outer], locked: no_sum || no_difference};
}

function to_axis_angle(q) {
  const [x, y, z, w] = canonical(q), largest = Math.max(Math.abs(x), Math.abs(y), Math.abs(z));
  if (largest === 0) return {axis: [1, 0, 0], angle: 0};
  const scale = largest < 1e-140 ? 2 ** 600 : 1;  // exact, and squares do not underflow
  const scaled = [x * scale, y * scale, z * scale], norm = length(...scaled);
  return {axis: scaled.map((part) => part / norm), angle: 2 * incline(norm / scale, Math.abs(w))};
}

function to_rotvec([x, y, z, w]) {
  const sine = Math.max(length(x, y, z), TINY), angle = 2 * incline(sine, Math.abs(w)) * sign_of(w);
  return [x, y, z].map((part) => part / sine * angle);
}

function notations(pose) {  // a pose in every representation
  const q = canonical(unit(rotation(pose))), {angles, locked} = to_rpy(q);
  return {
    q, locked, rpy: angles, rpy_deg: angles.map((angle) => angle * RADIAN),
    matrix: to_matrix(q), rotvec: to_rotvec(q), ...to_axis_angle(q),
  };
}
