// The page: its tabs, and the commands that do the same elsewhere.
'use strict';

const tabs = [...document.querySelectorAll('[role="tab"]')];

function showTab(name) {
  for (const tab of tabs) {
    const isShown = tab.id === `tab-${name}`;
    tab.setAttribute('aria-selected', String(isShown));
    tab.tabIndex = isShown ? 0 : -1;
    if (isShown) tab.scrollIntoView({ block: 'nearest', inline: 'nearest' });
    byId(tab.getAttribute('aria-controls')).hidden = !isShown;
  }
  if (name === 'corner' && !byId('corner-picture').firstChild) computeCorner();
}

function startTabs() {
  const nameOf = (tab) => tab.id.replace('tab-', '');
  tabs.forEach((tab, i) => {
    tab.addEventListener('click', () => showTab(nameOf(tab)));
    tab.addEventListener('keydown', (event) => {
      const steps = { ArrowRight: 1, ArrowLeft: -1 };
      const next = event.key === 'Home' ? 0 : event.key === 'End' ? tabs.length - 1
        : event.key in steps ? (i + steps[event.key] + tabs.length) % tabs.length : undefined;
      if (next === undefined) return;
      event.preventDefault();
      showTab(nameOf(tabs[next]));
      tabs[next].focus();
    });
  });
}

function drawCommands() {
  const commands = [
    ['One print', 'unflex compensate part.gcode -o part.unflex.gcode --printer printer.toml --report .html'],
    ['A folder, again and again: only what changed is done', 'unflex batch prints -o compensated --printer printer.toml --report reports --summary summary.json'],
    ['As fast as keeps the nozzle within 20 µm', 'unflex compensate part.gcode -o part.unflex.gcode --printer printer.toml --faster=20'],
    ['In a slicer, as post-processing script', '/path/to/unflex compensate --in-place --printer /path/to/printer.toml --report .html'],
    ['With node, without installing anything', 'npx unflex compensate part.gcode -o part.unflex.gcode --printer printer.toml'],
    ['As a test of prints: fails above 50 µm', 'unflex batch prints -o out --printer printer.toml --max-deviation 0.05 --summary junit.xml'],
  ];
  byId('commands-list').replaceChildren(...commands.map(([title, command]) => {
    const copy = element('button', { type: 'button', onclick: async () => {
      try {
        await navigator.clipboard.writeText(command);
        copy.textContent = 'Copied';
      } catch {
        getSelection().selectAllChildren(shown);
        copy.textContent = 'Press Ctrl-C';
      }
    } }, 'Copy');
    const shown = element('pre', {}, command);
    return element('div', {}, element('h3', {}, title), shown, copy);
  }));
  const save = byId('commands-save');
  save.hidden = !printers.chosen;
  if (printers.chosen) save.href = URL.createObjectURL(new Blob([printers.all[printers.chosen]]));
}

startTabs();
startPrinters();
startPrints();
startMeasure();
startCorner();
byId('terms').addEventListener('click', showTerms);
printers.listeners.push(drawCommands);
drawCommands();
// What is dropped beside the places for it must not take the page's place.
for (const kind of ['dragover', 'drop']) addEventListener(kind, (event) => event.preventDefault());
