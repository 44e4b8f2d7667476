// Point at a path or a curve: both show the nearest pair, with its time and errors.

const SVG = "http://www.w3.org/2000/svg";
const pictures = {path: document.querySelector("#path svg"), errors: document.querySelector("#errors svg")};
const tip = document.getElementById("tip");

function add(svg, name, attributes) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries({visibility: "hidden", ...attributes})) element.setAttribute(key, value);
  svg.append(element);
  return element;
}

const cursor = add(pictures.errors, "path", {class: "cursor"});
const marks = {
  path: add(pictures.path, "circle", {class: "mark", r: 5}), errors: add(pictures.errors, "circle", {class: "mark", r: 4}),
};

// Return the sample nearest to a point: on a path by distance, on a curve by time, then by error.
function nearest(where, x, y) {
  let found = null, least = Infinity;
  for (const each of curves) {
    for (const [at, place] of each[where].entries()) {
      const far = Math.abs(place[0] - x), away = Math.abs(place[1] - y);
      const apart = where === "path" ? Math.hypot(far, away) : far + 1e-3 * away;
      if (apart < least) [found, least] = [{each, at}, apart];
    }
  }
  return found;
}

function show({each, at}, event) {
  for (const [name, mark] of Object.entries(marks)) {
    mark.setAttribute("cx", each[name][at][0]);
    mark.setAttribute("cy", each[name][at][1]);
    mark.setAttribute("visibility", "visible");
  }
  cursor.setAttribute("d", `M${each.errors[at][0]} 30V${pictures.errors.viewBox.baseVal.height - 42}`);
  cursor.setAttribute("visibility", "visible");
  const name = curves.length > 1 ? `${each.name}\n` : "", turned = each.deg ? `   ${each.deg[at]}°` : "";
  tip.textContent = `${name}${unit === "s" ? `${each.t[at]} s` : `pair ${each.t[at]}`}   ${each.m[at]} m${turned}`;
  tip.hidden = false;
  tip.style.left = `${Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 8)}px`;
  tip.style.top = `${Math.max(event.clientY - tip.offsetHeight - 12, 4)}px`;
}

function hide() {
  tip.hidden = true;
  for (const element of [cursor, ...Object.values(marks)]) element.setAttribute("visibility", "hidden");
}

for (const [name, svg] of Object.entries(pictures)) {
  const look = (event) => {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    show(nearest(name, point.x, point.y), event);
  };
  svg.addEventListener("pointermove", look);
  svg.addEventListener("pointerdown", look);
  svg.addEventListener("pointerleave", hide);
}
document.documentElement.dataset.ready = "1";
