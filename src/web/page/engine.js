// unflex in WebAssembly: it lies packed in the page and is unpacked when it is first needed.
'use strict';

const byId = (id) => document.getElementById(id);

// The bytes that stand in an element, each four of them as five letters (make_page.sh).
function bytesIn(id) {
  const letters = '0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;,=>?@^_`{|}~';
  const values = new Uint8Array(128);
  [...letters].forEach((letter, value) => { values[letter.charCodeAt(0)] = value; });
  const [length, text] = byId(id).textContent.trim().split(' ');
  const bytes = new DataView(new ArrayBuffer((text.length / 5) * 4));
  for (let i = 0; i < text.length; i += 5) {
    let number = 0;
    for (let k = 0; k < 5; ++k) number = number * 85 + values[text.charCodeAt(i + k)];
    bytes.setUint32((i / 5) * 4, number);
  }
  return new Uint8Array(bytes.buffer, 0, Number(length));
}

// What lies packed in an element of the page.
async function unpacked(id) {
  const packed = bytesIn(id);
  const { instance } = await WebAssembly.instantiate(bytesIn('unpack'));
  const { memory, room_for: roomFor, unpack } = instance.exports;
  const length = Number(new DataView(packed.buffer, packed.byteOffset).getBigUint64(5, true));
  const from = roomFor(packed.length);
  const to = roomFor(length);
  new Uint8Array(memory.buffer, from, packed.length).set(packed);
  if (unpack(from, packed.length, to, length) !== 1) throw new Error('The page is damaged.');
  return new Uint8Array(memory.buffer, to, length);
}

let compiled;
function program() {
  compiled ??= unpacked('program').then((bytes) => WebAssembly.compile(bytes));
  return compiled;
}

let workerAddress;

// Runs a command. files: what it can read, by name; wanted: names of what it makes. Resolves to
// {code, told, said, files}; stop() of what is returned ends it, and then it resolves to {stopped}.
function run(args, { files = {}, wanted = [], onProgress = () => {} } = {}) {
  workerAddress ??= URL.createObjectURL(new Blob([byId('worker').textContent], { type: 'text/javascript' }));
  const stopped = { stopped: true, code: -1, told: '', said: [], files: {} };
  let isStopped = false;
  let stop = () => { isStopped = true; };
  const result = program().then((module) => new Promise((resolve) => {
    if (isStopped) {
      resolve(stopped);
      return;
    }
    const worker = new Worker(workerAddress);
    const end = (outcome) => {
      worker.terminate();
      resolve(outcome);
    };
    stop = () => end(stopped);
    worker.onerror = (event) => end({ code: -1, told: '', said: [event.message || 'The worker failed.'], files: {} });
    worker.onmessage = ({ data }) => {
      if ('stage' in data) onProgress(data);
      else if (data.fault) end({ code: -1, told: '', said: [data.fault], files: {} });
      else end(data);
    };
    worker.postMessage({ module, args, files, wanted });
  })).catch((error) => ({ code: -1, told: '', said: [`This browser cannot run unflex: ${error.message}`], files: {} }));
  result.stop = () => stop();
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
  byId('page-body').replaceChildren(element('pre', { class: 'long' }, new TextDecoder().decode(await unpacked('copyright'))));
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
