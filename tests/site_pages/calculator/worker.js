// Python in a worker: the page stays alive while a command runs, and can end it.
import { loadPyodide } from "./pyodide/pyodide.mjs";

const fetched = self.fetch;
let [done, python] = [0, null];

self.fetch = async (...request) => {  // the same, but the page is told of each piece that came
  const response = await fetched(...request);
  const counted = new TransformStream({
    transform(piece, out) {
      done += piece.byteLength;
      self.postMessage({ done });
      out.enqueue(piece);
    },
  });
  return new Response(response.body.pipeThrough(counted), { status: response.status, headers: response.headers });
};

async function begin() {
  const bundle = self.fetch(new URL("python.zip", import.meta.url)).then((each) => each.arrayBuffer());
  python = await loadPyodide();
  const loaded = performance.now();
  python.unpackArchive(await bundle, "zip", { extractDir: "/lib/python3.14/site-packages" });
  const code = await (await fetched(new URL("answer.py", import.meta.url))).text();
  python.runPython(code);
  self.postMessage({ ready: true, own: performance.now() - loaded, pyodide: loaded });
}

const ready = begin().catch((error) => self.postMessage({ failed: String(error) }));

self.onmessage = async ({ data: { id, call, args } }) => {
  await ready;
  const begun = performance.now();
  try {
    const found = python.globals.get(call)(...args.map((each) => python.toPy(each)));
    const result = found.toJs({ dict_converter: Object.fromEntries, create_pyproxies: false });
    found.destroy();
    self.postMessage({ id, result, took: performance.now() - begun });
  } catch (error) { // a fault of frametool itself
    self.postMessage({ id, failed: String(error) });
  }
};
