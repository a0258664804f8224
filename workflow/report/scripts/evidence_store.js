// Read the data of each recording's drawings.

const EvidenceStore = ((Elements) => {
  "use strict";

  const nodes = [...document.querySelectorAll("script[data-evidence]")];
  const carried = new Map(nodes.map((node) => [node.dataset.evidence, node]));

  /** Return the data of a recording; its signals are deflated in the page. */
  async function read(name) {
    const { drawn, ...others } = Elements.readData(carried.get(name));
    const bytes = Uint8Array.from(atob(drawn), (character) => character.charCodeAt(0));
    const inflated = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return { ...(await new Response(inflated).json()), ...others };
  }

  return { has: (name) => carried.has(name), read };
})(Elements);
