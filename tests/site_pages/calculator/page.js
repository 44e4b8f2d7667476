// The calculator: a line, the files for it, and the answers; Python runs in the worker.
const MOST_IN_LINK = 20_000; // bytes of files; longer links are cut by what sends them
const MOST_ANSWERS = 30;
const $ = (id) => document.getElementById(id);
const about = JSON.parse($("about").textContent);
const [line, results, said, files, history] = [$("line"), $("results"), $("said"), new Map(), []];
let [worker, pending, next, before, running, shown, leaving] = [null, new Map(), 0, 0, null, 0, false];

function make(tag, props = {}, ...inner) {
  const made = Object.assign(document.createElement(tag), props);
  made.append(...inner);
  return made;
}

// ---- the worker

function start() {
  // a worker of a blob keeps the page's policy: no request leaves for elsewhere
  const script = `import ${JSON.stringify(new URL("worker.js", location.href).href)}`;
  worker = new Worker(URL.createObjectURL(new Blob([script], { type: "text/javascript" })), { type: "module" });
  document.body.dataset.state = "loading";
  worker.onmessage = ({ data }) => {
    if (data.done !== undefined) progress(data.done);
    else if (data.ready) ready(data);
    else if (data.failed) failed(data);
    else pending.get(data.id)?.(data);
  };
  worker.onerror = () => failed({ failed: "its files could not be loaded" });
}

function progress(done) {
  const share = Math.min(1, done / about.bytes);
  $("bar").value = share;
  say(share < 1 ? `Python is loading: ${(done / 1e6).toFixed(1)} of ${(about.bytes / 1e6).toFixed(1)} MB` : "Python is starting");
}

function ready(times) {
  Object.assign(document.body.dataset, { state: "ready", pyodide: times.pyodide, own: times.own });
  say("Ready. Nothing that you type or drop here leaves this page.");
}

function failed({ id, failed }) {
  if (pending.has(id)) return pending.get(id)({ result: { out: "", err: failed, status: 1, files: {}, needs: "" } });
  document.body.dataset.state = "failed";
  say(`Python could not be started (${failed}). The answers below are those of an installed frametool.`);
}

function say(text) {
  if (said.textContent !== text) said.textContent = text;
}

function ask(call, ...args) {
  const id = ++next;
  worker.postMessage({ id, call, args });
  return new Promise((resolve) => pending.set(id, resolve)).finally(() => pending.delete(id));
}

// ---- a line is run

const columns = () => Math.max(40, Math.min(120, Math.floor((results.clientWidth - 34) / $("ruler").getBoundingClientRect().width * 10)));

async function run(text) {
  text = text.trim().replace(/^frametool\s+/, "");
  if (!text || running) return;
  if (history.at(-1) !== text) history.push(text);
  before = history.length;
  running = text;
  const late = setTimeout(() => { $("stop").hidden = false; }, 1000);
  document.body.dataset.running = "yes";
  const { result, took } = await ask("answer", text, Object.fromEntries(files), columns());
  clearTimeout(late);
  running = null;
  $("stop").hidden = true;
  delete document.body.dataset.running;
  if (!result) return;
  show(text, result, took);
  if (/^view\s/.test(text) && !result.status && !/\s(-o|-f|--output|--format)\b/.test(text)) drawn(text);
}

async function drawn(text) { // what the terminal shows of frames, as a page that turns
  const { result } = await ask("answer", `${text} -o view.html`, Object.fromEntries(files), columns());
  if (result?.files["view.html"]) framed(result.files["view.html"], text);
}

function stop() {
  worker.terminate();
  const waiting = [...pending.values()];
  show(running, { out: "", err: "stopped\n", status: 130, files: {}, needs: "" });
  start();
  waiting.forEach((each) => each({}));
}

function show(text, { out, err, status, files: written, needs }, took = 0) {
  const shownOut = readable(out);
  const card = make("article", { className: "answer" });
  const copy = make("button", { textContent: "Copy", onclick: () => copied(copy, plain(shownOut ?? err)) });
  const link = make("button", { textContent: "Link", title: "copies a link that opens this line, its files and its answer", onclick: () => linked(link, text) });
  card.append(make("header", {}, make("code", { textContent: `frametool ${text}` }), copy, link));
  if (shownOut) card.append(make("pre", { className: "out", tabIndex: 0 }, colored(shownOut)));
  if (shownOut === null) written = { ...written, output: out };
  if (needs) card.append(installation(needs));
  else if (err) card.append(make("pre", { className: status ? "err" : "note" }, colored(err)));
  if (!shownOut && !err && !Object.keys(written).length) card.append(make("p", { textContent: "(no output)" }));
  for (const [name, content] of Object.entries(written)) card.append(download(name, content));
  card.append(make("footer", { textContent: status ? `exit code ${status}` : took ? `${took.toFixed(0)} ms` : "" }));
  Object.assign(card.dataset, { status, took });
  results.prepend(card);
  card.id = `answer-${++shown}`;
  [...results.children].slice(MOST_ANSWERS).forEach((each) => each.remove());
  const page = Object.entries(written).find(([name]) => name.endsWith(".html"));
  if (page) framed(page[1], page[0]);
}

function installation(needs) {
  const what = needs === "numpy" ? "numpy, which a browser page cannot load" : `the package ${needs}`;
  return make("p", { className: "needs" }, `This command needs ${what}. Installed, it runs: `, make("code", { textContent: about.install }));
}

function readable(bytes) {
  if (typeof bytes === "string") return bytes;
  try {
    return new TextDecoder("utf-8", { fatal: true }).decode(bytes);
  } catch {
    return null; // it is a file
  }
}

function download(name, content) {
  const address = URL.createObjectURL(new Blob([content]));
  const made = make("p", { className: "file" }, make("a", { href: address, download: name, textContent: `Download ${name}` }));
  made.append(` ${(content.length / 1000).toFixed(1)} kB`);
  if (/\.(svg|png)$/.test(name)) {
    const type = name.endsWith("svg") ? "image/svg+xml" : "image/png";
    made.append(make("img", { src: URL.createObjectURL(new Blob([content], { type })), alt: `the picture ${name}` }));
  }
  return made;
}

function framed(content, name) {
  const frame = make("iframe", { sandbox: "allow-scripts", src: "frame.html", title: `${name}, drawn` });
  const hand = ({ source, data }) => {
    if (source !== frame.contentWindow || data !== "frame") return;
    frame.contentWindow.postMessage(new TextDecoder().decode(content), "*");
    removeEventListener("message", hand);
  };
  addEventListener("message", hand);
  const close = make("button", { textContent: "Close", onclick: () => $("beside").replaceChildren() });
  $("beside").replaceChildren(make("header", {}, make("code", { textContent: name }), close), frame);
}

// ---- what a terminal would colour

const plain = (text) => text.replace(/\x1b\[[0-9;]*m/g, "");

function colored(text) {
  const made = document.createDocumentFragment();
  let classes = new Set();
  for (const piece of text.split(/(\x1b\[[0-9;]*m)/)) {
    const code = /^\x1b\[([0-9;]*)m$/.exec(piece);
    if (code) classes = styled(classes, code[1].split(";").map(Number));
    else if (piece) made.append(classes.size ? make("span", { className: [...classes].join(" ") }, piece) : piece);
  }
  return made;
}

function styled(before, codes) {
  let found = new Set(before);
  const color = (name) => { found = new Set([...found].filter((each) => !/^c\d/.test(each))); if (name !== null) found.add(`c${name}`); };
  for (let i = 0; i < codes.length; i++) {
    const code = codes[i];
    if (code === 0) found = new Set();
    else if (code >= 1 && code <= 4) found.add(["bold", "dim", "italic", "underline"][code - 1]);
    else if (code === 22) ["bold", "dim"].forEach((each) => found.delete(each));
    else if (code === 39) color(null);
    else if ((code >= 30 && code <= 37) || (code >= 90 && code <= 97)) color(code % 10 + (code >= 90 ? 8 : 0));
    else if (code === 38) { color(codes[i + 1] === 5 && codes[i + 2] < 16 ? codes[i + 2] : null); i += codes[i + 1] === 5 ? 2 : 4; }
  }
  return found;
}

// ---- copies and links

async function copied(button, text) {
  const words = button.textContent;
  try {
    await navigator.clipboard.writeText(text);
    button.textContent = "Copied";
  } catch {
    button.textContent = "Not allowed here";
  }
  setTimeout(() => { button.textContent = words; }, 1500);
}

const base64 = (bytes) => btoa(Array.from(bytes, (each) => String.fromCharCode(each)).join(""));
const unbase64 = (text) => Uint8Array.from(atob(text), (each) => each.charCodeAt(0));

function linked(button, text) {
  const size = [...files.values()].reduce((sum, each) => sum + each.length, 0);
  if (size > MOST_IN_LINK) return say(`The files are ${(size / 1000).toFixed(0)} kB; a link holds ${MOST_IN_LINK / 1000} kB. Remove some.`);
  const state = new URLSearchParams([["l", text], ...[...files].map(([name, bytes]) => ["f", `${name}:${base64(bytes)}`])]);
  window.history.replaceState(null, "", `#${state}`);
  return copied(button, location.href);
}

function opened() {
  const state = new URLSearchParams(location.hash.slice(1));
  if (!state.has("l")) return;
  files.clear();
  for (const each of state.getAll("f")) {
    const [, name, content] = /^(.*):([\w+/=]*)$/.exec(each) ?? [];
    if (name) files.set(name, unbase64(content));
  }
  listed();
  line.value = state.get("l").replace(/^frametool\s+/, "");
  run(line.value);
}

// ---- files of one's own

async function taken(list) {
  for (const each of list) files.set(each.name, new Uint8Array(await each.arrayBuffer()));
  listed();
  if (list.length) say(`${[...list].map((each) => each.name).join(", ")}: name it in a line, as in tree ${list[0].name}`);
}

function listed() {
  $("files").replaceChildren(...[...files].map(([name, bytes]) => {
    const gone = make("button", { textContent: "×", title: `remove ${name}`, ariaLabel: `remove ${name}`, onclick: () => { files.delete(name); listed(); } });
    return make("li", {}, make("code", { textContent: name }), ` ${(bytes.length / 1000).toFixed(1)} kB `, gone);
  }));
}

// ---- keys

async function complete() {
  const begun = line.value.slice(0, line.selectionStart);
  const { result } = await ask("complete", begun.replace(/^frametool\s+/, ""), Object.fromEntries(files));
  const word = /\S*$/.exec(begun)[0];
  const words = result.map(([each]) => each);
  const common = words.reduce((a, b) => { while (!b.startsWith(a)) a = a.slice(0, -1); return a; }, words[0] ?? "");
  if (common.length >= word.length && words.length) {
    const end = words.length === 1 && !common.endsWith("=") && !common.endsWith("/") ? " " : "";
    line.setRangeText(common + end, line.selectionStart - word.length, line.selectionStart, "end");
  }
  const offered = words.length > 1 ? result : [];
  $("offers").replaceChildren(...offered.slice(0, 40).map(([each, meaning]) => make("li", {}, make("code", { textContent: each }), ` ${meaning ?? ""}`)));
  if (!words.length) say("Nothing completes this.");
}

function recalled(step) {
  before = Math.max(0, Math.min(history.length, before + step));
  line.value = history[before] ?? "";
  line.setSelectionRange(line.value.length, line.value.length);
}

line.addEventListener("keydown", (event) => {
  const act = { ArrowUp: () => recalled(-1), ArrowDown: () => recalled(1) }[event.key];
  const completes = line.value.trim() && document.body.dataset.state === "ready" && !running && !leaving;
  leaving = event.key === "Escape"; // a Tab behind it goes on to the next button
  if (event.key === "Tab" && !event.shiftKey && completes) {
    event.preventDefault();
    complete();
  } else if (act) {
    event.preventDefault();
    act();
  } else if (event.key === "Escape") $("offers").replaceChildren();
});
$("ask").addEventListener("submit", (event) => {
  event.preventDefault();
  $("offers").replaceChildren();
  run(line.value);
});
$("stop").addEventListener("click", stop);
$("choose").addEventListener("change", ({ target }) => taken(target.files));
for (const kind of ["dragover", "drop"]) {
  document.addEventListener(kind, (event) => {
    event.preventDefault();
    document.body.classList.toggle("dropping", kind === "dragover");
    if (kind === "drop") taken(event.dataTransfer.files);
  });
}
document.addEventListener("dragleave", () => document.body.classList.remove("dropping"));
for (const chip of document.querySelectorAll("[data-line]")) {
  chip.addEventListener("click", () => {
    line.value = chip.dataset.line;
    for (const [name, text] of Object.entries(JSON.parse(chip.dataset.files))) files.set(name, new TextEncoder().encode(text));
    listed();
    if (document.body.dataset.state === "ready") run(line.value);
    else $(chip.dataset.answer).scrollIntoView({ behavior: "smooth" });
    line.focus();
  });
}
addEventListener("hashchange", opened);
window.frametool = { ask }; // for the console of a browser

if (typeof WebAssembly === "undefined") {
  failed({ failed: "this browser has no WebAssembly" });
} else {
  start();
  opened();
}
