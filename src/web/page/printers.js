// Printers, kept in the browser as printer files (TOML).
'use strict';

const printers = {
  all: {},
  chosen: '',
  listeners: [],
  load() {
    try {
      this.all = JSON.parse(localStorage.getItem('unflex.printers') ?? '{}');
      this.chosen = localStorage.getItem('unflex.printer') ?? '';
    } catch {
      this.all = {};
    }
    if (!this.all[this.chosen]) this.chosen = Object.keys(this.all)[0] ?? '';
  },
  keep() {
    try {
      localStorage.setItem('unflex.printers', JSON.stringify(this.all));
      localStorage.setItem('unflex.printer', this.chosen);
      byId('printer-kept').hidden = true;
    } catch {
      byId('printer-kept').hidden = false;
    }
    for (const listener of this.listeners) listener();
  },
  put(name, text) {
    this.all[name] = text;
    this.chosen = name;
    this.keep();
  },
  remove(name) {
    delete this.all[name];
    if (this.chosen === name) this.chosen = Object.keys(this.all)[0] ?? '';
    this.keep();
  },
  // What a command needs to know the chosen printer.
  get args() {
    return this.chosen ? ['--printer', '/printer/printer.toml'] : [];
  },
  get files() {
    return this.chosen ? { '/printer/printer.toml': this.all[this.chosen] } : {};
  },
};

const nameOfPrinter = (file) => file.replace(/\.[^.]*$/, '') || file;

// The values that people know their printer by.
function factsOf(text) {
  const values = {};
  let section = '';
  for (const line of text.split('\n')) {
    const head = /^\[+([^\]]*)\]+/.exec(line);
    const pair = /^\s*([a-z_0-9.]+)\s*=\s*("[^"]*"|[^#]*)/.exec(line);
    if (head) section = head[1];
    else if (pair) values[`${section}.${pair[1]}`] = pair[2].trim().replace(/^"|"$/g, '');
  }
  const of = (axis) => values[`dynamics.${axis}.freq_hz`];
  const modes = /\[\[dynamics\.[xy]\.modes?\]\]/.test(text);
  return {
    firmware: values['printer.firmware'],
    accel: values['limits.max_accel_mm_s2'],
    resonance: of('x') && of('y') ? `X ${of('x')} Hz, Y ${of('y')} Hz` : modes ? 'several modes' : '',
  };
}

// Makes a printer of files that describe it. The first that is no part of another is its main file.
async function addPrinter(files) {
  const status = byId('printer-status');
  const mains = ['printer.cfg', 'config.g', 'printer.toml'];
  const main = files.find((file) => mains.includes(file.name.toLowerCase())) ?? files[0];
  status.replaceChildren(element('p', { class: 'quiet' }, `Reading ${main.name} …`));
  const inputs = Object.fromEntries(files.map((file) => [`/records/${file.webkitRelativePath || file.name}`, file]));
  const mainName = `/records/${main.webkitRelativePath || main.name}`;
  const made = await run(['printer', 'init', '--from', mainName, '-o', '/made/printer.toml', '-q'],
    { files: { '/made/.keep': '', ...inputs }, wanted: ['/made/printer.toml'] });
  const toml = made.files['/made/printer.toml'];
  if (made.code !== 0 || !toml) {
    status.replaceChildren(element('p', { class: 'bad' }, 'This printer could not be read.'), messages(made.said));
    return;
  }
  let name = nameOfPrinter(main.name);
  if (['printer', 'config'].includes(name.toLowerCase())) {
    name = `Printer ${Object.keys(printers.all).length + 1}`;
  }
  const text = await toml.text();
  printers.put(name, text);
  const next = factsOf(text).resonance ? ''
    : ' Its resonance is not known yet: give a record under Measure, or print a tower under Tune.';
  status.replaceChildren(element('p', { class: 'good' }, `${name} is added.${next}`), messages(made.said));
}

function drawPrinters() {
  const list = byId('printer-list');
  list.replaceChildren(...Object.entries(printers.all).map(([name, text]) => {
    const facts = factsOf(text);
    const editor = element('textarea', { rows: 14, spellcheck: 'false', 'aria-label': `Printer file of ${name}`, hidden: true }, '');
    editor.value = text;
    editor.addEventListener('change', () => printers.put(name, editor.value));
    const title = element('input', { class: 'name', value: name, 'aria-label': 'Name of the printer' });
    title.addEventListener('change', () => {
      const wanted = title.value.trim();
      if (!wanted || printers.all[wanted]) {
        title.value = name;
        return;
      }
      delete printers.all[name];
      printers.put(wanted, text);
    });
    return element('li', { class: name === printers.chosen ? 'card chosen' : 'card' },
      title,
      element('p', { class: 'quiet' }, [facts.firmware, facts.accel && `${facts.accel} mm/s²`, facts.resonance || 'resonance not known'].filter(Boolean).join(' · ')),
      element('div', { class: 'row' },
        element('button', { type: 'button', disabled: name === printers.chosen, onclick: () => { printers.chosen = name; printers.keep(); } }, name === printers.chosen ? 'In use' : 'Use'),
        element('a', { class: 'button', href: URL.createObjectURL(new Blob([text])), download: 'printer.toml' }, 'Save printer.toml'),
        element('button', { type: 'button', 'aria-expanded': 'false', onclick: (event) => {
          editor.hidden = !editor.hidden;
          event.target.setAttribute('aria-expanded', String(!editor.hidden));
        } }, 'Edit'),
        element('button', { type: 'button', onclick: () => printers.remove(name) }, 'Remove')),
      editor);
  }));
  byId('print-first').hidden = Object.keys(printers.all).length > 0;
  byId('printer-none').hidden = Object.keys(printers.all).length > 0;
  for (const select of document.querySelectorAll('select.printer')) {
    select.replaceChildren(...Object.keys(printers.all).map((name) => element('option', { value: name, selected: name === printers.chosen }, name)));
    select.disabled = select.options.length === 0;
    if (select.disabled) select.append(element('option', {}, 'no printer yet'));
  }
}

function startPrinters() {
  printers.load();
  printers.listeners.push(drawPrinters);
  for (const select of document.querySelectorAll('select.printer')) {
    select.addEventListener('change', () => {
      printers.chosen = select.value;
      printers.keep();
    });
  }
  takesFiles(byId('printer-drop'), byId('printer-files'), addPrinter);
  drawPrinters();
}
