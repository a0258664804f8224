// Read the data of each recording's drawings, from inside the page or from files beside it.

const EvidenceStore = ((Elements) => {
  "use strict";

  const { readData } = Elements;
  // Keep several files, because a reader often goes to a neighbour, or back.
  const KEPT_FILES = 8;
  const received = new Map();

  /** Store the texts of a file beside the page, two for each recording. Each such file only calls this function. */
  function receive(file, texts) {
    received.set(file, texts);
    if (received.size > KEPT_FILES) received.delete(received.keys().next().value);
  }

  /** Read a file beside the page as a script, because a page on disk can read files in no other way. Resolve to null if it is missing. */
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

  /** Return the content of a text from such a file. */
  async function inflate(text) {
    const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
    const inflated = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(inflated).json();
  }

  /** Return a message for missing files. */
  function missingWords(folder) {
    return (
      `The signals of the recordings are in the folder ${folder} beside this page, but this folder is missing or belongs ` +
      "to another report. Keep the folder and the page together, as they were made. All else on this page is complete."
    );
  }

  const TOO_OLD = "This browser is too old to unpack the signals beside this page; use a newer one. All else on this page is complete.";

  /** Return the access to the files beside the page. They hold the recordings in the page's order. */
  function besideThePage({ folder, files, each }, names) {
    const places = new Map(names.map((name, place) => [name, place]));
    const read = async (name) => {
      const place = places.get(name);
      const file = files[Math.floor(place / each)];
      const texts = received.get(file) ?? (await readFile(folder, file));
      const [alone, amongOthers] = await Promise.all(texts[place % each].map(inflate));
      return { ...alone, ...amongOthers };
    };
    return {
      has: (name) => places.has(name),
      read: (name, onRead, onMissing) => {
        const why = typeof DecompressionStream === "function" ? missingWords(folder) : TOO_OLD;
        read(name).catch(() => null).then((evidence) => (evidence ? onRead(evidence) : onMissing(why)));
      },
    };
  }

  /** Return the access to the data inside the page, which is available at once. */
  function insideThePage() {
    const nodes = [...document.querySelectorAll("script[data-evidence]")];
    const carried = new Map(nodes.map((node) => [node.dataset.evidence, node]));
    return { has: (name) => carried.has(name), read: (name, onRead) => onRead(readData(carried.get(name))) };
  }

  /** Return `has`, which returns whether a recording can be drawn, and `read`, which calls back with its data. */
  function setUp(data) {
    return data.beside ? besideThePage(data.beside, Object.keys(data.checksums)) : insideThePage();
  }

  return { receive, setUp };
})(Elements);
