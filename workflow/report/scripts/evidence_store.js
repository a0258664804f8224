// What the page draws of each recording: it stands inside the page, or in files beside it that are read when they are needed.

const EvidenceStore = ((Elements) => {
  "use strict";

  const { readData } = Elements;
  // A reader goes on to a neighbour, or comes back.
  const KEPT_FILES = 8;
  const received = new Map();

  /** Take the texts of a file beside the page: every such file calls this, and nothing else. */
  function receive(file, texts) {
    received.set(file, texts);
    if (received.size > KEPT_FILES) received.delete(received.keys().next().value);
  }

  /** Read a file beside the page: from disk a page may do so as a script alone. Gives null where it is not there. */
  function readFile(folder, file) {
    return new Promise((resolve) => {
      const script = document.createElement("script");
      const end = () => {
        script.remove();
        resolve(received.get(file) ?? null);
      };
      script.addEventListener("load", end);
      script.addEventListener("error", end);
      script.src = `${folder}/${file}.js`;
      document.head.append(script);
    });
  }

  /** Turn a text of such a file back into what it holds. */
  async function inflate(text) {
    const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
    const inflated = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(inflated).json();
  }

  /** Say in words why nothing can be drawn. */
  function missingWords(folder) {
    return (
      `The signals of the recordings are not in this page but beside it, in the folder ${folder}, which is not there or belongs ` +
      "to another report. Keep the folder and the page together, as they were made. All else on this page is complete."
    );
  }

  const TOO_OLD = "This browser is too old to unpack the signals that stand beside this page. All else on this page is complete.";

  /** Give access to the files beside the page; the recordings stand in them in their order. */
  function besideThePage({ folder, files, each }, names) {
    const places = new Map(names.map((name, place) => [name, place]));
    const read = async (name) => {
      const place = places.get(name);
      const file = files[Math.floor(place / each)];
      const texts = received.get(file) ?? (await readFile(folder, file));
      return inflate(texts[place % each]);
    };
    return {
      has: (name) => places.has(name),
      read: (name, onRead, onMissing) => {
        const why = typeof DecompressionStream === "function" ? missingWords(folder) : TOO_OLD;
        read(name).catch(() => null).then((evidence) => (evidence ? onRead(evidence) : onMissing(why)));
      },
    };
  }

  /** Give access to what stands inside the page; it is there at once. */
  function insideThePage() {
    const nodes = [...document.querySelectorAll("script[data-evidence]")];
    const carried = new Map(nodes.map((node) => [node.dataset.evidence, node]));
    return { has: (name) => carried.has(name), read: (name, onRead) => onRead(readData(carried.get(name))) };
  }

  /** Give `has`, which tells whether a recording can be drawn, and `read`, which calls back with what is drawn of it. */
  function setUp(data) {
    return data.beside ? besideThePage(data.beside, Object.keys(data.checksums)) : insideThePage();
  }

  return { receive, setUp };
})(Elements);
