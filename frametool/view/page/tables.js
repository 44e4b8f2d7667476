// Show the numbers of a report, those of `compare -f json`, as tiles and tables.

const numbers = JSON.parse(document.getElementById("numbers").textContent);
const {unit, curves} = JSON.parse(document.getElementById("samples").textContent);
const STATISTICS = ["rmse", "mean", "median", "p95", "max"];
const KITTI = "Mean error of stretches of path, as the KITTI benchmark has it";
// name, unit, key, meaning
const ABSOLUTE = [
  ["ate", "m", "m", "Absolute error: the distance between each pose of the estimate, as aligned, and its reference"],
  ["ate", "deg", "deg", "Absolute error in rotation: the angle between the two orientations of a pair"],
  ["ate", "rot", "rot", "Norm of the difference between the two rotation matrices of a pair, as evo has it"],
  ["ate", "full", "full", "Norm of the difference between the two 4 x 4 matrices of a pair, as evo has it"],
  ["along", "m", "along_m", "The part of the absolute error along the path, positive ahead"],
  ["across", "m", "across_m", "The part of the absolute error across the path, positive to the left"],
  ["up", "m", "up_m", "The part of the absolute error at right angles to the path, positive up"],
];
// name, unit, meaning, value; the ones that have a best value come first
const COLUMNS = [
  ["ate", "m", "rmse of the error in position", ({ate}) => ate.m.rmse],
  ["max", "m", "greatest error in position", ({ate}) => ate.m.max],
  ["deg", "deg", "rmse of the error in rotation", ({ate}) => ate.deg?.rmse],
  ["along", "m", "rmse along the path", ({ate}) => ate.along_m.rmse],
  ["across", "m", "rmse across the path", ({ate}) => ate.across_m.rmse],
  ["up", "m", "rmse at right angles to the path, up", ({ate}) => ate.up_m.rmse],
  ["rpe", "%", "relative error over the longest distance", ({rpe}) => rpe.at(-1)?.percent],
  ["kitti", "%", KITTI, ({kitti}) => kitti?.percent],
  ["scale", "", "of the alignment", ({transform}) => transform.scale],
  ["paired", "", "poses of the estimate with a partner in the reference", ({poses}) => poses.paired],
];
const RANKED = 8;

function make(tag, properties = {}, ...children) {
  const {data, ...others} = properties, element = Object.assign(document.createElement(tag), others);
  Object.assign(element.dataset, data);
  element.append(...children);
  return element;
}

const digits = (value, count) => (value ? `${Number(value.toPrecision(count))}` : "0");

// Return a number as the terminal shows it: with an exponent if too small or too large for its decimals.
function fixed(value, decimals) {
  if (value == null) return "-";
  const size = Math.abs(value), is_plain = size < 1e-9 || (size >= 0.5 * 10 ** -decimals && size < 1e6);
  return is_plain ? (Math.round(value * 10 ** decimals) / 10 ** decimals + 0).toFixed(decimals) : value.toExponential(1);
}

function tiles({ate, rpe, poses, settings: {align}}) {
  const aligned = align === "none" ? "not aligned" : `aligned by ${align}`, steps = rpe.filter(({percent}) => percent !== null);
  const over = ({percent, delta}) => `${digits(percent, 3)} % over ${delta}`, last = steps.pop();
  const why = rpe.length ? "needs rotations" : "no motion over the distances asked for";
  const found = [
    ["ATE", digits(ate.m.rmse, 4), "m", `rmse; at most ${digits(ate.m.max, 4)} m, ${aligned}`],
    last ? ["RPE", digits(last.percent, 3), "%", [`over ${last.delta}`, ...steps.map(over)].join("; ")] : ["RPE", "-", "", why],
    ["Poses paired", poses.paired, "", `of ${poses.possible}, ${digits(100 * poses.paired / Math.max(poses.possible, 1), 3)} %`],
  ];
  return make("div", {id: "tiles"}, ...found.map(([name, value, of, said]) => make("div", {},
    make("h2", {}, name), make("p", {}, make("strong", {}, value), ` ${of}`), make("p", {}, said))));
}

function measures({ate, rpe, kitti, path_m: {ref}, settings, ate_by_alignment}) {
  const rows = ABSOLUTE.filter(([, , key]) => key in ate).map(([name, of, key, meaning]) => [name, of, meaning, ate[key]]);
  for (const {delta, pairs, m, deg, percent, distance_m} of rpe) {
    const way = `the motion over ${delta}: estimate against reference, ${pairs} pairs of poses`;
    rows.push([`rpe ${delta}`, "m", `Relative error of ${way}; % of ${delta}`, m, percent]);
    if (deg) rows.push([`rpe ${delta}`, "deg", `Relative error in rotation of ${way}`, deg]);
    else rows.push(["distance", "m", `Difference of the distance covered by ${way}`, distance_m]);
  }
  const none = `- (${ref.toFixed(1)} m of path, ${Math.min(...settings.segments_m)} m asked)`;
  const stretches = kitti ? `${kitti.percent.toFixed(4)} %  ${kitti.deg_per_m.toFixed(6)} deg/m  (${kitti.segments} segments)` : none;
  const fits = Object.entries(ate_by_alignment).map(([kind, value]) => `${kind} ${fixed(value, 3)}`).join(", ");
  return [...rows, ["kitti", "", KITTI, stretches], ["ate by fit", "m", "The absolute error under each alignment", fits]];
}

function table_of(found) {
  const head = ["", "", ...STATISTICS, "%"].map((title) => make("th", {}, title));
  const rows = measures(found).map(([name, of, meaning, value, percent]) => {
    const cells = typeof value === "string" ? [make("td", {colSpan: 6}, value)]
      : [...STATISTICS.map((key) => make("td", {}, fixed(value?.[key], 6))), make("td", {}, percent == null ? "" : percent.toFixed(2))];
    return make("tr", {}, make("th", {tabIndex: 0, data: {tip: meaning}}, name), make("td", {}, of), ...cells);
  });
  return make("table", {className: "measures"}, make("tr", {}, ...head), ...rows);
}

function settings_of({settings, offset_s, transform, duration_s, path_m}) {
  const entries = Object.entries({...settings, offset_s, transform, duration_s, path_m}).filter(([, value]) => value !== null);
  const said = (value) => (typeof value === "string" ? value : JSON.stringify(value));
  const list = entries.flatMap(([key, value]) => [make("dt", {}, key), make("dd", {}, said(value))]);
  return make("details", {}, make("summary", {}, "Settings"), make("dl", {}, ...list));
}

// Return a row for each estimate, the best of each column marked; a click on a title sorts.
function estimates() {
  const columns = COLUMNS.map(([name, of, meaning, value]) => ({name, of, meaning, values: numbers.map(value)}))
    .filter(({values}) => values.some((value) => value != null));
  const is_ranked = (name) => COLUMNS.findIndex(([each]) => each === name) < RANKED;
  const best = ({name, values}) => (is_ranked(name) ? Math.min(...values.filter((value) => value != null)) : NaN);
  const head = [["est", "", ""], ...columns.map(({name, of, meaning}) => [name, of, meaning])].map(([name, of, title]) =>
    make("th", {onclick: sort}, make("button", {title}, `${name} `, make("small", {}, of))));
  const rows = curves.map(({name, colour}, at) => make("tr", {},
    make("th", {}, make("i", {className: `swatch ${colour}-swatch`}), name),
    ...columns.map((column) => {
      const value = column.values[at];
      return make("td", {className: value === best(column) ? "best" : "", data: {value: value ?? ""}}, column.name === "paired" ? value : fixed(value, 3));
    })));
  return make("table", {id: "estimates"}, make("thead", {}, make("tr", {}, ...head)), make("tbody", {}, ...rows));
}

function sort({currentTarget: title}) {
  const up = title.getAttribute("aria-sort") !== "ascending", at = title.cellIndex, body = title.closest("table").tBodies[0];
  for (const each of title.parentElement.cells) each.removeAttribute("aria-sort");
  title.setAttribute("aria-sort", up ? "ascending" : "descending");
  const key = (row) => row.cells[at].dataset.value ?? row.cells[at].textContent;
  const order = (a, b) => (key(a) === "") - (key(b) === "") || (at ? key(a) - key(b) : key(a).localeCompare(key(b))) * (up ? 1 : -1);
  body.append(...[...body.rows].sort(order));
}

const is_one = numbers.length === 1;
document.querySelector("header").after(is_one ? tiles(numbers[0]) : estimates());
for (const [at, found] of numbers.entries()) {
  const parts = [table_of(found), settings_of(found)];
  document.querySelector("main").append(...is_one ? parts : [make("details", {}, make("summary", {}, curves[at].name), ...parts)]);
}
