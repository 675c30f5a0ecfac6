"use strict";
// The button copies the lines. A page from a file may not write to the clipboard in every browser,
// so the lines are selected as well.
(() => {
  const button = document.getElementById("copy");
  const lines = document.getElementById("lines");
  if (!button) return;
  const say = text => {
    button.textContent = text;
    setTimeout(() => { button.textContent = "Copy"; }, 2000);
  };
  button.addEventListener("click", () => {
    const range = document.createRange();
    range.selectNodeContents(lines);
    const selection = getSelection();
    selection.removeAllRanges();
    selection.addRange(range);
    if (document.execCommand("copy")) {
      say("Copied");
    } else {
      navigator.clipboard?.writeText(lines.textContent)
        .then(() => say("Copied"), () => say("Selected: copy it"));
    }
  });
})();
