// unflex in WebAssembly: it lies packed in the page and is unpacked when it is first needed.
'use strict';

const byId = (id) => document.getElementById(id);

// What lies packed in an element of the page.
function unpacked(id) {
  const packed = Uint8Array.from(atob(byId(id).textContent.trim()), (c) => c.charCodeAt(0));
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip')));
}

let compiled;
function program() {
  compiled ??= unpacked('program').arrayBuffer().then((bytes) => WebAssembly.compile(bytes));
  return compiled;
}

let workerAddress;

// Runs a command. files: what it can read, by name; wanted: names of what it makes. Resolves to
// {code, told, said, files}; stop() of what is returned ends it, and then it resolves to {stopped}.
function run(args, { files = {}, wanted = [], onProgress = () => {} } = {}) {
  workerAddress ??= URL.createObjectURL(new Blob([byId('worker').textContent], { type: 'text/javascript' }));
  let stop;
  const result = program().then((module) => new Promise((resolve) => {
    const worker = new Worker(workerAddress);
    const end = (outcome) => {
      worker.terminate();
      resolve(outcome);
    };
    stop = () => end({ stopped: true, code: -1, told: '', said: [], files: {} });
    worker.onerror = (event) => end({ code: -1, told: '', said: [event.message || 'The worker failed.'], files: {} });
    worker.onmessage = ({ data }) => {
      if ('stage' in data) onProgress(data);
      else if (data.fault) end({ code: -1, told: '', said: [data.fault], files: {} });
      else end(data);
    };
    worker.postMessage({ module, args, files, wanted });
  }));
  result.stop = () => stop?.();
  return result;
}

// --- elements

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on')) made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, '');
    else if (value !== false && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== undefined));
  return made;
}

function saveLink(blob, name, words = `Save ${name}`) {
  return element('a', { class: 'button primary', href: URL.createObjectURL(blob), download: name }, words);
}

// What a command said, as a list of its own. Paths of the page's memory are no use to anybody.
function messages(lines) {
  const shown = lines.map((line) => line.replace(/(^|[ '"])\/(?:printer|print|made|records)\//g, '$1'));
  return element('ul', { class: 'messages' }, ...shown.map((line) =>
    element('li', { class: line.includes('warning:') ? 'warning' : '' }, line.replace(/^unflex: /, ''))));
}

// A page of unflex' own, apart from this one.
function showPage(blob, title) {
  const dialog = byId('page-dialog');
  byId('page-title').textContent = title;
  const frame = element('iframe', { sandbox: 'allow-scripts', title });
  blob.text().then((text) => { frame.srcdoc = text; });
  byId('page-body').replaceChildren(frame);
  dialog.showModal();
}

async function showTerms() {
  byId('page-title').textContent = 'Terms';
  byId('page-body').replaceChildren(element('pre', { class: 'long' }, await unpacked('copyright').text()));
  byId('page-dialog').showModal();
}

// Makes a place take files, by dropping and by choosing.
function takesFiles(zone, input, use) {
  const mark = (event, isOver) => {
    event.preventDefault();
    zone.classList.toggle('over', isOver);
  };
  zone.addEventListener('dragover', (event) => mark(event, true));
  zone.addEventListener('dragleave', (event) => mark(event, false));
  zone.addEventListener('drop', (event) => {
    mark(event, false);
    event.stopPropagation();
    use([...event.dataTransfer.files]);
  });
  input.addEventListener('change', () => {
    if (input.files.length) use([...input.files]);
    input.value = '';
  });
}
