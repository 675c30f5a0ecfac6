// Records of an accelerometer, and towers.
'use strict';

let lastRecords = [];

async function measure(files) {
  lastRecords = files;
  const status = byId('measure-status');
  status.replaceChildren(element('p', { class: 'quiet', role: 'status' }, `Reading ${files.length === 1 ? files[0].name : `${files.length} records`} …`));
  byId('measure-page').replaceChildren();
  const axis = byId('measure-axis').value;
  const records = Object.fromEntries(files.map((file) => [`/records/${file.name}`, file]));
  const done = await run(['identify', ...Object.keys(records), ...(axis ? ['--axis', axis] : []), '--report', '/made/identify.html'],
    { files: { '/made/.keep': '', ...records }, wanted: ['/made/identify.html'] });
  const page = done.files['/made/identify.html'];
  status.replaceChildren();
  if (done.said.length) status.append(messages(done.said));
  if (done.told.trim()) status.append(element('pre', {}, done.told.replaceAll('/records/', '')));
  if (page) {
    const frame = element('iframe', { sandbox: 'allow-scripts', title: 'What the records tell' });
    frame.srcdoc = await page.text();
    byId('measure-page').replaceChildren(frame);
  }
  if (done.code === 0 && printers.chosen) {
    status.append(element('button', { type: 'button', class: 'primary', onclick: adoptRecords }, `Put this into ${printers.chosen}`));
  } else if (done.code === 0) {
    status.append(element('p', { class: 'quiet' }, 'Add a printer to put this into its file.'));
  }
}

async function adoptRecords() {
  const records = Object.fromEntries(lastRecords.map((file) => [`/records/${file.name}`, file]));
  const done = await run(['printer', 'init', '--from', '/printer/printer.toml', ...Object.keys(records).flatMap((name) => ['--record', name]), '-o', '/made/printer.toml', '-q'],
    { files: { '/made/.keep': '', ...records, ...printers.files }, wanted: ['/made/printer.toml'] });
  const made = done.files['/made/printer.toml'];
  if (made) {
    printers.put(printers.chosen, await made.text());
    byId('measure-status').append(element('p', { class: 'good', role: 'status' }, `${printers.chosen} has these resonances now.`));
  }
  if (done.said.length) byId('measure-status').append(messages(done.said));
}

// --- towers

const tower = { name: '', blob: undefined, axes: [], read: {} };

// What a tower's first lines say: {axis, parameter, bands} for each.
async function axesOf(blob) {
  const head = await blob.slice(0, 20000).text();
  return [...head.matchAll(/^; unflex tune: axis=(\w+) parameter=(\w+) bands=(\d+)/gm)]
    .map(([, axis, parameter, bands]) => ({ axis, parameter, bands: Number(bands) }));
}

async function makeTower() {
  const like = byId('tower-like').files[0];
  const bed = Number(byId('tower-bed').value) > 0 ? ['--bed-temp', byId('tower-bed').value] : [];
  const start = like ? ['--like', `/print/${like.name}`] : ['--nozzle-temp', byId('tower-nozzle').value, ...bed];
  const args = [...(byId('tower-pressure').checked ? ['--pressure'] : []), ...start];
  await tune(args, like ? { [`/print/${like.name}`]: like } : {});
}

async function tune(args, files) {
  const status = byId('tower-status');
  if (!printers.chosen) {
    status.replaceChildren(element('p', { class: 'bad' }, 'First add a printer.'));
    return;
  }
  const name = `tower-${Date.now().toString(36)}.gcode`;
  const accel = byId('tower-accel').value;
  status.replaceChildren(element('p', { class: 'quiet', role: 'status' }, 'Computing the tower …'));
  const setBusy = (isBusy) => ['tower-make', 'tower-read'].forEach((id) => { byId(id).disabled = isBusy; });
  setBusy(true);
  const done = await run(['tune', ...args, ...(accel ? ['--accel', accel] : []), ...printers.args, '-o', `/made/${name}`, '--report', '/made/tower.html'],
    { files: { '/made/.keep': '', ...files, ...printers.files }, wanted: [`/made/${name}`, '/made/tower.html', '/printer/printer.toml'],
      onProgress: ({ stage, share }) => { status.firstChild.textContent = `${stage} ${(100 * share).toFixed(0)} %`; } });
  setBusy(false);
  status.replaceChildren();
  if (done.told.trim()) status.append(element('pre', {}, done.told.replaceAll('/made/', '').replaceAll('/printer/', '')));
  if (done.said.length) status.append(messages(done.said));
  const text = await done.files['/printer/printer.toml']?.text();
  if (done.code === 0 && text && text !== printers.all[printers.chosen]) printers.put(printers.chosen, text);
  const made = done.files[`/made/${name}`];
  const page = done.files['/made/tower.html'];
  if (!made) return;
  status.append(element('div', { class: 'row' }, saveLink(made, name, 'Save the tower'),
    page && element('button', { type: 'button', onclick: () => showPage(page, 'What to look for') }, 'What to look for')),
  element('p', { class: 'quiet' }, 'Print it, then mark below in which bands the wall is even. Keep the file: it is needed to read it.'));
  await openTower(made, name);
}

async function openTower(blob, name) {
  tower.axes = await axesOf(blob);
  tower.blob = blob;
  tower.name = name;
  tower.read = {};
  if (!tower.axes.length) {
    byId('tower-bands').replaceChildren(element('p', { class: 'bad' }, `${name} is no tower of unflex.`));
    byId('tower-read').hidden = true;
    return;
  }
  byId('tower-bands').replaceChildren(...tower.axes.map(bandsOf));
  byId('tower-read').hidden = false;
}

// The bands of a wall from the bed upwards. The first click marks one, the next the other end.
function bandsOf({ axis, bands }) {
  const wall = axis === 'x' ? 'Right wall (X)' : axis === 'y' ? 'Front wall (Y)' : 'All walls (pressure)';
  const told = element('p', { class: 'quiet', 'aria-live': 'polite' }, 'none marked');
  const buttons = [];
  const mark = (band) => {
    const now = tower.read[axis];
    tower.read[axis] = !now || now[0] !== now[1] ? [band, band] : [Math.min(now[0], band), Math.max(now[1], band)];
    const [first, last] = tower.read[axis];
    buttons.forEach((button, i) => button.setAttribute('aria-pressed', String(i + 1 >= first && i + 1 <= last)));
    told.textContent = first === last ? `band ${first}` : `bands ${first} to ${last}`;
  };
  for (let band = 1; band <= bands; ++band) {
    buttons.push(element('button', { type: 'button', class: band % 5 === 1 ? 'band wide' : 'band', 'aria-pressed': 'false', 'aria-label': `Band ${band}`, onclick: () => mark(band) }, String(band)));
  }
  return element('div', { class: 'wall', role: 'group', 'aria-label': wall }, element('h3', {}, wall), told, element('div', { class: 'bands' }, ...[...buttons].reverse()));
}

async function readTower() {
  const read = Object.entries(tower.read).flatMap(([axis, [first, last]]) => ['--read', `${axis === 'x' || axis === 'y' ? axis : 'pressure'}=${first}..${last}`]);
  if (!read.length) {
    byId('tower-status').replaceChildren(element('p', { class: 'bad' }, 'Mark the even bands of at least one wall.'));
    return;
  }
  await tune([`/records/${tower.name}`, ...read], { [`/records/${tower.name}`]: tower.blob });
}

function startMeasure() {
  takesFiles(byId('measure-drop'), byId('measure-files'), measure);
  takesFiles(byId('tower-drop'), byId('tower-file'), ([file]) => openTower(file, file.name));
  byId('tower-make').addEventListener('click', makeTower);
  byId('tower-read').addEventListener('click', readTower);
}
