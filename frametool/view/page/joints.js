// Joints with a slider each, as frametool.formats.robot has them: a frame stands in its parent at origin * motion, and a
// joint that follows another one has multiplier * its value + offset.

const JOINTS = head.joints;
const TURNING = new Set(["revolute", "continuous"]);
const JOINT_AT = new Map(JOINTS.map((joint, at) => [joint.name, at]));
const values = JOINTS.map((joint) => joint.value);

function motion({kind, axis: [x, y, z]}, value) {
  if (!TURNING.has(kind)) return [x * value, y * value, z * value, 0, 0, 0, 1];
  const [sine, cosine] = half_sincos(value - 2 * Math.PI * Math.round(value / (2 * Math.PI)));
  return [0, 0, 0, x * sine, y * sine, z * sine, cosine];
}

// Put a joint, and those that follow it, at a value.
function set_joint(at, value) {
  const joint = JOINTS[at];
  values[at] = value;
  POSE.set(compose(joint.origin, motion(joint, value)), 7 * joint.frame);
  show_joint(at);
  for (const [each, {mimic}] of JOINTS.entries()) {
    if (mimic && mimic[0] === at) set_joint(each, mimic[1] * value + mimic[2]);
  }
}

function show_joint(at) {
  const {kind, slider, told} = JOINTS[at], value = values[at];
  slider.value = String(value);
  told.textContent = TURNING.has(kind) ? `${(value * RADIAN).toFixed(1)}°` : `${(value * 1000).toFixed(1)} mm`;
}

extras.begin.push(() => {
  $("joints").hidden = false;
  for (const [at, joint] of JOINTS.entries()) {
    const reach = TURNING.has(joint.kind) ? Math.PI : 1;
    const range = {min: joint.lower ?? -reach, max: joint.upper ?? reach, step: "any", disabled: Boolean(joint.mimic)};
    joint.slider = make("input", {type: "range", ariaLabel: joint.name, ...range});
    joint.told = make("output", {});
    joint.slider.oninput = () => {
      set_joint(at, Number(joint.slider.value));
      update();
    };
    joint.slider.onchange = remember;
    const label = make("label", {});
    label.append(make("span", {textContent: joint.name}), joint.slider, joint.told);
    $("joints").append(label);
    show_joint(at);
  }
  for (const each of (wanted.get("joints") || "").split(",").filter(Boolean)) {
    const cut = each.lastIndexOf("="), at = JOINT_AT.get(each.slice(0, cut)), value = Number(each.slice(cut + 1));
    if (at !== undefined && Number.isFinite(value)) set_joint(at, value);
  }
});

// The address keeps the joints that were moved, the command those that are not at 0.
const told = (differs) => JOINTS.map((joint, at) => [joint, values[at]])
  .filter(([joint, value]) => !joint.mimic && differs(joint, value)).map(([joint, value]) => `${joint.name}=${value}`);
extras.fragment.push((fragment) => {
  const moved = told((joint, value) => value !== joint.value);
  if (moved.length) fragment.set("joints", moved.join(","));
});
extras.shell.push(() => told((_, value) => value !== 0).map((each) => ` -j ${quoted(each)}`).join(""));
window.joints = {values, set: (name, value) => set_joint(JOINT_AT.get(name), value)};  // for tests
