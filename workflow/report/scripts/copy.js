// Make buttons copy a text of the page. If the browser forbids copying, select the text.

(() => {
  "use strict";

  for (const button of document.querySelectorAll("button[data-copies]")) {
    button.hidden = false;
    button.addEventListener("click", () => {
      const range = document.createRange();
      range.selectNodeContents(document.getElementById(button.dataset.copies));
      const selection = getSelection();
      selection.removeAllRanges();
      selection.addRange(range);
      // This way of copying needs no permission, also on a page that was opened from disk.
      const copied = document.execCommand("copy");
      button.nextElementSibling.textContent = copied ? "Copied." : "Selected: press Ctrl+C.";
    });
  }
})();
