// Joints with a slider each, as in frametool.formats.robots.model: the pose of a frame in its parent is
// origin * motions * after, or its inverse; a joint that follows another one has multiplier * its value + offset.

const JOINTS = head.joints, LINKS = head.links;
const TURNING = new Set(["revolute", "continuous"]);
const JOINT_AT = new Map(JOINTS.map((joint, at) => [joint.name, at]));
const LINK_OF = new Map(LINKS.flatMap((link) => link.joints.map((at) => [at, link])));
const values = JOINTS.map((joint) => joint.value);

function motion({kind, axis: [x, y, z], anchor, rest}, value) {
  const moved = value - rest;
  if (!TURNING.has(kind)) return [x * moved, y * moved, z * moved, 0, 0, 0, 1];
  const [sine, cosine] = half_sincos(moved - 2 * Math.PI * Math.round(moved / (2 * Math.PI)));
  const turned = [0, 0, 0, x * sine, y * sine, z * sine, cosine], [ax, ay, az] = anchor;
  if (!ax && !ay && !az) return turned;
  return compose([ax, ay, az, 0, 0, 0, 1], compose(turned, [-ax, -ay, -az, 0, 0, 0, 1]));
}

// Set the value of a joint, and of those that follow it.
function set_joint(at, value) {
  values[at] = value;
  const {frame, joints, origin, after, inverted} = LINK_OF.get(at);
  const pose = [...joints.map((each) => motion(JOINTS[each], values[each])), after].reduce(compose, origin);
  POSE.set(inverted ? inverse(pose) : pose, 7 * frame);
  show_joint(at);
  for (const [each, {mimic}] of JOINTS.entries()) {
    if (mimic && mimic[0] === at) set_joint(each, mimic[1] * value + mimic[2]);
  }
}

const in_unit = (kind, value) => (TURNING.has(kind) ? `${(value * RADIAN).toFixed(1)}°` : `${(value * 1000).toFixed(1)} mm`);

function show_joint(at) {
  const {kind, slider, shown_value, lower, upper} = JOINTS[at], value = values[at];
  slider.value = String(value);
  shown_value.textContent = in_unit(kind, value);
  shown_value.className = value < (lower ?? value) || value > (upper ?? value) ? "bad" : "";
}

function add_slider(joint, at) {
  const {name, kind, lower, upper, mimic} = joint, reach = TURNING.has(kind) ? Math.PI : 1;
  const min = lower ?? -reach, max = upper ?? reach;
  joint.slider = make("input", {type: "range", ariaLabel: name, min, max, step: "any", disabled: Boolean(mimic)});
  joint.shown_value = make("output", {});
  joint.slider.oninput = () => {
    set_joint(at, Number(joint.slider.value));
    update();
  };
  joint.slider.onchange = remember;
  const label = make("label", {title: `${name}: ${kind}${mimic ? `, follows ${JOINTS[mimic[0]].name}` : ""}`});
  const limits = make("small", {});
  for (const limit of [lower, upper]) limits.append(make("i", {textContent: limit === null ? "no limit" : in_unit(kind, limit)}));
  label.append(make("span", {textContent: name}), joint.slider, joint.shown_value, limits);
  $("sliders").append(label);
  show_joint(at);
}

extras.begin.push(() => {
  $("joints").hidden = false;
  JOINTS.forEach(add_slider);
  for (const each of (wanted.get("joints") || "").split(",").filter(Boolean)) {
    const cut = each.lastIndexOf("="), at = JOINT_AT.get(each.slice(0, cut)), value = Number(each.slice(cut + 1));
    if (at !== undefined && Number.isFinite(value)) set_joint(at, value);
  }
  $("home").onclick = () => {
    JOINTS.forEach((joint, at) => set_joint(at, joint.value));
    update();
    remember();
  };
});

// The address has the joints that were moved, the command those that are not at rest.
const differing = (differs) => JOINTS.map((joint, at) => [joint, values[at]])
  .filter(([joint, value]) => !joint.mimic && differs(joint, value)).map(([joint, value]) => `${joint.name}=${value}`);
extras.fragment.push((fragment) => {
  const moved = differing((joint, value) => value !== joint.value);
  if (moved.length) fragment.set("joints", moved.join(","));
});
extras.shell.push(() => differing((joint, value) => value !== joint.rest).map((each) => ` -j ${quoted(each)}`).join(""));
window.joints = {values, set: (name, value) => set_joint(JOINT_AT.get(name), value)};  // for tests
