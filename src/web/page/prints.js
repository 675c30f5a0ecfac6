// Prints: compensated one after another.
'use strict';

const isPrint = (name) => /\.(gcode|gco|g|bgcode|gcode\.gz)$/i.test(name);
const compensatedName = (name) => name.replace(/(\.(?:gcode|gco|g|bgcode)(?:\.gz)?)$/i, '.unflex$1');

// The options that the page's controls stand for.
function timingArgs() {
  const tolerance = byId('tolerance').value;
  return byId('faster').checked ? [`--faster=${tolerance}`] : [];
}

// The answers of the summary: lines that begin with a question or a word of their own.
function answersOf(told) {
  const answers = [];
  for (const line of told.split('\n').slice(1)) {
    const answer = /^(Better\?|Where worst\?|Safe\?|Made for)\s+(.*)/.exec(line);
    if (answer) answers.push([answer[1], [answer[2]]]);
    else if (/^ {14}\S/.test(line) && answers.length) answers.at(-1)[1].push(line.trim());
    else if (answers.length) break;
  }
  return answers;
}

const queue = { waiting: [], isWorking: false };

function addPrints(files) {
  const others = files.filter((file) => !isPrint(file.name));
  const prints = files.filter((file) => isPrint(file.name));
  if (others.length && !prints.length) {
    byId('print-status').replaceChildren(element('p', { class: 'quiet' },
      `${others.map((file) => file.name).join(', ')}: no print. A printer's configuration goes to Printer, a record to Measure.`));
    return;
  }
  byId('print-status').replaceChildren();
  if (!printers.chosen) {
    byId('print-status').append(element('p', { class: 'bad' }, 'First tell unflex which printer it is for.'));
    return;
  }
  for (const file of prints) queue.waiting.push(makeJob(file));
  workOn();
}

function makeJob(file) {
  const bar = element('progress', { max: 1, 'aria-label': `Progress of ${file.name}` });
  const stage = element('span', { class: 'quiet', 'aria-live': 'polite' }, 'waits');
  const stop = element('button', { type: 'button' }, 'Cancel');
  const body = element('div', {});
  const card = element('li', { class: 'card job' }, element('h3', {}, file.name), element('div', { class: 'row' }, bar, stop), stage, body);
  byId('jobs').prepend(card);
  const job = {
    file, bar, stage, body, stop, args: timingArgs(), printer: printers.all[printers.chosen],
    printerName: printers.chosen,
  };
  stop.addEventListener('click', () => {
    job.cancelled = true;
    job.running?.stop();
    queue.waiting = queue.waiting.filter((other) => other !== job);
    bar.remove();
    stop.remove();
    stage.textContent = 'cancelled';
  });
  return job;
}

async function workOn() {
  if (queue.isWorking) return;
  queue.isWorking = true;
  while (queue.waiting.length) await work(queue.waiting.shift());
  queue.isWorking = false;
}

async function work(job) {
  const { file } = job;
  const name = compensatedName(file.name);
  const begin = performance.now();
  let told = '';
  job.stage.textContent = 'begins';
  job.running = run(['compensate', `/print/${file.name}`, '-o', `/made/${name}`, '--printer', '/printer/printer.toml', '--report', '/made/report.html', ...job.args], {
    files: { '/made/.keep': '', [`/print/${file.name}`]: file, '/printer/printer.toml': job.printer },
    wanted: [`/made/${name}`, '/made/report.html'],
    onProgress({ stage, share, left }) {
      job.bar.value = share;
      // A screen reader is not told each percent.
      if (told !== stage || left) job.stage.textContent = `${stage}${left ? `, ${left}` : ''}`;
      told = stage;
    },
  });
  const done = await job.running;
  if (job.cancelled) return;
  job.bar.remove();
  job.stop.remove();
  const seconds = (performance.now() - begin) / 1000;
  const output = done.files[`/made/${name}`];
  const report = done.files['/made/report.html'];
  if (done.code !== 0 || !output) {
    job.stage.textContent = 'The print stays as it is.';
    job.body.append(messages(done.said));
    if (report) job.body.append(element('button', { type: 'button', onclick: () => showPage(report, file.name) }, 'Report'));
    return;
  }
  job.stage.textContent = `for ${job.printerName}, simulated; took ${seconds < 90 ? `${seconds.toFixed(0)} s` : `${(seconds / 60).toFixed(0)} min`}`;
  job.body.append(
    element('dl', { class: 'answers' }, ...answersOf(done.told).flatMap(([question, lines]) => [element('dt', {}, question), element('dd', {}, ...lines.flatMap((line, i) => (i ? [element('br'), line] : [line])))])),
    element('div', { class: 'row' }, saveLink(output, name),
      report && element('button', { type: 'button', onclick: () => showPage(report, file.name) }, 'Report'),
      report && element('a', { class: 'button', href: URL.createObjectURL(report), download: `${name}.html` }, 'Save report')),
    element('details', {}, element('summary', {}, 'All figures'), element('pre', {}, done.told.replaceAll('/made/', '').replaceAll('/print/', ''))));
  if (done.said.length) job.body.append(messages(done.said));
}

// --- how fast the print may go, tried on its first layers

const layerMark = /^;\s*(LAYER_CHANGE|LAYER:|CHANGE_LAYER|BEFORE_LAYER_CHANGE|AFTER_LAYER_CHANGE)/;

// The print up to the layer behind `layers`, in whole lines; nothing if it is too short.
async function firstLayers(file, layers) {
  const text = await file.slice(0, 8 << 20).text();
  const hasMarks = new RegExp(layerMark.source, 'm').test(text);
  let count = 0;
  let highest = 0;
  let mark = '';
  for (let at = 0; at < text.length;) {
    const end = text.indexOf('\n', at);
    if (end < 0) break;
    const line = text.slice(at, end);
    let begins = false;
    if (hasMarks) {
      const found = layerMark.exec(line);
      mark ||= found ? found[1] : '';
      begins = Boolean(found) && found[1] === mark;
    } else {
      const z = /^G[01] (?:[^;]* )?Z([\d.]+)/.exec(line);
      begins = Boolean(z) && Number(z[1]) > highest + 0.02 && !/E[\d.]/.test(line);
      if (begins) highest = Number(z[1]);
    }
    if (begins && ++count > layers) return text.slice(0, at);
    at = end + 1;
  }
  return text.length > 3e6 ? text.slice(0, text.lastIndexOf('\n', 3e6) + 1) : text;
}

const tolerances = [5, 10, 20, 40, 80];

async function tryFaster(files) {
  const file = files.find(({ name }) => isPrint(name));
  const status = byId('faster-status');
  if (!file || !printers.chosen) {
    status.replaceChildren(element('p', { class: 'bad' }, file ? 'First add a printer.' : 'Give a print.'));
    return;
  }
  byId('faster-curve').replaceChildren();
  const cut = /\.(gcode|gco|g)$/i.test(file.name) ? new Blob([await firstLayers(file, 4)]) : file;
  const found = [];
  for (const tolerance of tolerances) {
    status.replaceChildren(element('p', { class: 'quiet', role: 'status' }, `Trying ${tolerance} µm on the first layers of ${file.name} …`));
    const done = await run(['compensate', '/print/cut.gcode', '-o', '/made/out.gcode', ...printers.args, '--report', '/made/r.json', `--faster=${tolerance}`],
      { files: { '/made/.keep': '', '/print/cut.gcode': cut, ...printers.files }, wanted: ['/made/r.json'] });
    if (!done.files['/made/r.json']) {
      status.replaceChildren(element('p', { class: 'bad' }, 'This could not be tried.'), messages(done.said));
      return;
    }
    const report = JSON.parse(await done.files['/made/r.json'].text());
    found.push({ tolerance, saved: 1 - report.print_time_s.emitted / report.print_time_s.reference });
    drawFaster(found);
  }
  status.replaceChildren(element('p', { class: 'quiet', role: 'status' }, 'Tried on the first four layers; a whole print may save more or less.'));
}

function drawFaster(found) {
  const width = 420;
  const height = 150;
  const most = Math.max(0.05, ...found.map(({ saved }) => saved));
  const x = (tolerance) => 40 + (Math.log(tolerance / 5) / Math.log(16)) * (width - 70);
  const y = (saved) => height - 28 - (Math.max(0, saved) / most) * (height - 56);
  const points = found.map(({ tolerance, saved }) => `${x(tolerance)},${y(saved)}`).join(' ');
  const labels = found.map(({ tolerance, saved }) => `<circle cx="${x(tolerance)}" cy="${y(saved)}" r="4"/><text x="${x(tolerance)}" y="${y(saved) - 9}" text-anchor="middle">${(100 * saved).toFixed(0)} %</text><text class="quiet" x="${x(tolerance)}" y="${height - 8}" text-anchor="middle">${tolerance} µm</text>`).join('');
  byId('faster-curve').innerHTML = `<svg viewBox="0 0 ${width} ${height}" role="img" aria-label="Print time saved: ${found.map(({ tolerance, saved }) => `${(100 * saved).toFixed(0)} % within ${tolerance} µm`).join(', ')}"><polyline points="${points}"/>${labels}</svg>`;
}

function startPrints() {
  takesFiles(byId('print-drop'), byId('print-files'), addPrints);
  byId('print-add').addEventListener('click', () => showTab('printer'));
  takesFiles(byId('faster-drop'), byId('faster-file'), tryFaster);
  const show = () => {
    byId('tolerance-row').hidden = !byId('faster').checked;
    byId('tolerance-value').textContent = `${byId('tolerance').value} µm`;
  };
  for (const id of ['faster', 'sharper', 'tolerance']) byId(id).addEventListener('input', show);
  show();
}
