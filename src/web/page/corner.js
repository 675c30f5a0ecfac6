// One corner with sliders: what the nozzle does as sliced, and with what unflex makes of it.
'use strict';

const corner = { waits: undefined, isBusy: false, again: false };
const sliders = ['freq', 'damping', 'accel', 'speed', 'angle'];
const cornerValue = (name) => Number(byId(`corner-${name}`).value);

// Two lines of 40 mm with a corner between them.
function cornerPrint({ speed, angle }) {
  const turn = (angle * Math.PI) / 180;
  const x = 100 + 40 * Math.cos(turn);
  const y = 100 + 40 * Math.sin(turn);
  const feed = (60 * speed).toFixed(0);
  return `G28\nG90\nM83\nG1 X60 Y100 Z0.2 F6000\nG1 X100 Y100 E2 F${feed}\nG1 X${x.toFixed(4)} Y${y.toFixed(4)} E2\n`;
}

// Samples (x, y) of the motors each 0.1 ms, from constant-speed lines.
function motionOfLines(text) {
  const samples = [];
  let at = { x: 0, y: 0, feed: 6000 };
  let known = false;
  const step = 1e-4;
  let rest = 0;
  for (const line of text.split('\n')) {
    if (!/^G[01] /.test(line)) continue;
    const word = (letter) => {
      const found = new RegExp(` ${letter}(-?[\\d.]+)`).exec(line);
      return found ? Number(found[1]) : undefined;
    };
    const to = { x: word('X') ?? at.x, y: word('Y') ?? at.y, feed: word('F') ?? at.feed };
    const length = Math.hypot(to.x - at.x, to.y - at.y);
    const time = length / (to.feed / 60);
    if (known && length > 0) {
      for (; rest < time; rest += step) {
        samples.push([at.x + ((to.x - at.x) * rest) / time, at.y + ((to.y - at.y) * rest) / time]);
      }
      rest -= time;
    }
    known = true;
    at = to;
  }
  return samples;
}

// The corner as a firmware plans it: trapezoids with a speed at the corner (Klipper's rule).
function motionAsSliced({ speed, accel, angle }) {
  const step = 1e-4;
  const turn = (angle * Math.PI) / 180;
  const half = Math.sin((Math.PI - turn) / 2);
  const deviation = (25 * (Math.SQRT2 - 1)) / accel;
  const junction = half > 0.9999 ? speed : Math.min(speed, Math.sqrt((deviation * accel * half) / (1 - half)));
  const samples = [];
  for (const [from, to, x, y, direction] of [[0, junction, 60, 100, 0], [junction, 0, 100, 100, turn]]) {
    const length = 40;
    const top = Math.min(speed, Math.sqrt(accel * length + (from * from + to * to) / 2));
    let place = 0;
    let velocity = from;
    while (place < length) {
      const left = length - place;
      const braking = (velocity * velocity - to * to) / (2 * accel);
      velocity = braking >= left ? Math.max(velocity - accel * step, Math.max(to, 1e-3)) : Math.min(velocity + accel * step, top);
      place += velocity * step;
      samples.push([x + Math.min(place, length) * Math.cos(direction), y + Math.min(place, length) * Math.sin(direction)]);
    }
  }
  return samples;
}

// The nozzle on a spring: x″ = ω² (u − x) + 2ζω (u′ − x′), by Runge and Kutta's method of order 4.
// Between samples the motors go straight.
function nozzleOf(motors, { freq, damping }) {
  const step = 1e-4;
  const omega = 2 * Math.PI * freq;
  const path = motors.map(() => [0, 0]);
  for (const axis of [0, 1]) {
    let x = motors[0][axis];
    let v = 0;
    path[0][axis] = x;
    for (let i = 1; i < motors.length; ++i) {
      const from = motors[i - 1][axis];
      const speed = (motors[i][axis] - from) / step;
      const pull = (time, place, velocity) =>
        omega * omega * (from + speed * time - place) + 2 * damping * omega * (speed - velocity);
      const a1 = pull(0, x, v);
      const a2 = pull(step / 2, x + (step / 2) * v, v + (step / 2) * a1);
      const a3 = pull(step / 2, x + (step / 2) * v + (step * step / 4) * a1, v + (step / 2) * a2);
      const a4 = pull(step, x + step * v + (step * step / 2) * a2, v + step * a3);
      x += step * v + (step * step / 6) * (a1 + a2 + a3);
      v += (step / 6) * (a1 + 2 * a2 + 2 * a3 + a4);
      path[i][axis] = x;
    }
  }
  return path;
}

// The place of the sliced path that is nearest to (x, y).
function nearestOfSliced([x, y], turn) {
  const along = Math.max(0, (x - 100) * Math.cos(turn) + (y - 100) * Math.sin(turn));
  const first = [Math.min(x, 100), 100];
  const second = [100 + along * Math.cos(turn), 100 + along * Math.sin(turn)];
  const distance = ([a, b]) => Math.hypot(x - a, y - b);
  return distance(first) < distance(second) ? first : second;
}

// How far a path strays from the sliced one within 15 mm of the corner, RMS in µm.
function strayed(path, turn) {
  const near = path.filter(([x, y]) => Math.hypot(x - 100, y - 100) < 15);
  const sum = near.reduce((total, [x, y]) => {
    const [a, b] = nearestOfSliced([x, y], turn);
    return total + (x - a) ** 2 + (y - b) ** 2;
  }, 0);
  return 1000 * Math.sqrt(sum / Math.max(near.length, 1));
}

const exaggeration = 8;
const pixelsPerMm = 28;

function drawCorner({ angle }, before, after) {
  const turn = (angle * Math.PI) / 180;
  const point = ([x, y]) => `${((x - 100) * pixelsPerMm).toFixed(1)},${((100 - y) * pixelsPerMm).toFixed(1)}`;
  const exaggerated = ([x, y]) => {
    const [a, b] = nearestOfSliced([x, y], turn);
    return [a + exaggeration * (x - a), b + exaggeration * (y - b)];
  };
  const line = (path, name) => {
    const near = path.filter(([x, y], i) => i % 4 === 0 && Math.hypot(x - 100, y - 100) < 9);
    return `<polyline class="${name}" points="${near.map((place) => point(exaggerated(place))).join(' ')}"/>`;
  };
  const end = [100 + 9 * Math.cos(turn), 100 + 9 * Math.sin(turn)];
  const sliced = `<polyline class="sliced" points="${[[91, 100], [100, 100], end].map(point).join(' ')}"/>`;
  byId('corner-picture').innerHTML = `<svg viewBox="-270 -270 540 330" role="img" aria-label="The nozzle's path around the corner">${sliced}${line(before, 'before')}${after ? line(after, 'after') : ''}</svg>`;
  const told = `Off the path near the corner: ${strayed(before, turn).toFixed(1)} µm RMS as sliced`;
  byId('corner-told').textContent = after ? `${told}, ${strayed(after, turn).toFixed(1)} µm with unflex.` : `${told}.`;
}

async function computeCorner() {
  const values = Object.fromEntries(sliders.map((name) => [name, cornerValue(name)]));
  const units = { freq: 'Hz', damping: '', accel: 'mm/s²', speed: 'mm/s', angle: '°' };
  for (const name of sliders) byId(`corner-${name}-value`).textContent = `${values[name]} ${units[name]}`.trim();
  const before = nozzleOf(motionAsSliced(values), values);
  drawCorner(values, before);
  if (corner.isBusy) {
    corner.again = true;
    return;
  }
  corner.isBusy = true;
  const settings = {
    'printer.firmware': 'klipper', 'limits.max_velocity_mm_s': Math.max(values.speed, 10), 'limits.max_accel_mm_s2': values.accel,
    'dynamics.x.freq_hz': values.freq, 'dynamics.y.freq_hz': values.freq, 'dynamics.x.damping_ratio': values.damping, 'dynamics.y.damping_ratio': values.damping,
    'dynamics.freq_error': 0,
  };
  const done = await run(['compensate', '/print/corner.gcode', '-o', '/made/corner.gcode', ...Object.entries(settings).flatMap(([key, value]) => ['--set', `${key}=${value}`])],
    { files: { '/made/.keep': '', '/print/corner.gcode': cornerPrint(values) }, wanted: ['/made/corner.gcode'] });
  corner.isBusy = false;
  if (corner.again) {
    corner.again = false;
    computeCorner();
    return;
  }
  const made = done.files['/made/corner.gcode'];
  if (made) drawCorner(values, before, nozzleOf(motionOfLines(await made.text()), values));
  else byId('corner-told').textContent = done.said.join(' ');
}

function startCorner() {
  for (const name of sliders) {
    byId(`corner-${name}`).addEventListener('input', () => {
      clearTimeout(corner.waits);
      corner.waits = setTimeout(computeCorner, 30);
    });
  }
}
