"use strict";
// All pages share this: the choice between light and dark.
const unflex = (() => {
  const root = document.documentElement;
  const button = document.getElementById("theme");
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const listeners = [];
  const choices = [["", "◐ auto", "automatic"], ["light", "☀ light", "light"], ["dark", "☾ dark", "dark"]];
  let choice = 0;

  const changed = () => listeners.forEach(listener => listener());
  const choose = next => {
    choice = next;
    const [theme, label, name] = choices[choice];
    if (theme) root.dataset.theme = theme; else delete root.dataset.theme;
    button.textContent = label;
    button.setAttribute("aria-label", "Colours: " + name);
    changed();
  };
  button.addEventListener("click", () => choose((choice + 1) % choices.length));
  dark.addEventListener("change", changed);

  return {
    // Calls back whenever the colours change.
    theme: listener => { listeners.push(listener); },
    isDark: () => root.dataset.theme ? root.dataset.theme === "dark" : dark.matches,
    colour: name => getComputedStyle(root).getPropertyValue(name).trim(),
  };
})();
