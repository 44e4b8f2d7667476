// Read the data of the page: a head, and doubles and 64-bit stamps, compressed if many.

const head = JSON.parse(document.getElementById("head-data").textContent);
const blob = await unpack(JSON.parse(document.getElementById("blob").textContent), head.packed);

async function unpack(text, packed) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  if (!packed) return bytes.buffer;
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();
}
const extras = {begin: [], shell: [], fragment: [], under: [], points: []};
