// The two pictures of a layer, and how they are moved.
const layerView = (data, onLayer) => {
  const canvases = [document.getElementById("view-before"), document.getElementById("view-after")];
  const reader = layerReader(bytesOf(document.getElementById("paths").textContent), data.layers);
  const step = data.layer_step;
  const drawn = index => Math.min(index - (index % step), data.layers.length - 1);
  // What is shown: the layer, the point in the middle, pixels per mm, and the chosen place.
  const state = {layer: 0, x: 0, y: 0, scale: 1, chosen: null};
  let places = [];
  let asked = false;

  // Colours on a logarithmic scale. They go from pale to dark in the light theme, and from dark to
  // pale in the dark one, so that the colour-blind see their order, too. Lines also grow a little
  // with the deviation.
  const stops = {
    light: [
      [196, 208, 220],
      [140, 184, 216],
      [206, 148, 36],
      [201, 84, 18],
      [92, 14, 60],
    ],
    dark: [
      [58, 72, 88],
      [58, 118, 176],
      [214, 142, 44],
      [247, 196, 84],
      [255, 250, 214],
    ],
  };
  const shades = 32;
  const top = Math.max(data.deviation[0].max, data.deviation[1].max, 1);
  const bottom = top / 200;
  const fraction = um =>
    Math.min(Math.max(Math.log(Math.max(um, 1e-9) / bottom) / Math.log(top / bottom), 0), 1);
  const shadeOfCode = Uint8Array.from({length: 256}, (_, code) =>
    Math.round(fraction(codeToUm(code)) * (shades - 1)),
  );
  const colours = () => {
    const list = stops[unflex.isDark() ? "dark" : "light"];
    return Array.from({length: shades}, (_, i) => {
      const at = (i / (shades - 1)) * (list.length - 1),
        k = Math.min(Math.floor(at), list.length - 2),
        f = at - k;
      return `rgb(${list[k].map((c, j) => Math.round(c + f * (list[k + 1][j] - c))).join(",")})`;
    });
  };

  const bounds = data.frame;

  const size = canvas => ({width: canvas.clientWidth, height: canvas.clientHeight});
  const toScreen = (canvas, x, y) => {
    const {width, height} = size(canvas);
    return [width / 2 + (x - state.x) * state.scale, height / 2 - (y - state.y) * state.scale];
  };
  const toPrint = (canvas, px, py) => {
    const {width, height} = size(canvas);
    return [state.x + (px - width / 2) / state.scale, state.y - (py - height / 2) / state.scale];
  };

  const drawGrid = (context, canvas, width, height) => {
    const step = [1, 10, 100].find(s => s * state.scale > 12) || 1000;
    const [left, upper] = toPrint(canvas, 0, 0),
      [right, lower] = toPrint(canvas, width, height);
    context.beginPath();
    for (let x = Math.ceil(left / step) * step; x < right; x += step) {
      const px = Math.round(toScreen(canvas, x, 0)[0]) + 0.5;
      context.moveTo(px, 0);
      context.lineTo(px, height);
    }
    for (let y = Math.ceil(lower / step) * step; y < upper; y += step) {
      const py = Math.round(toScreen(canvas, 0, y)[1]) + 0.5;
      context.moveTo(0, py);
      context.lineTo(width, py);
    }
    context.strokeStyle = unflex.colour("--line");
    context.globalAlpha = 0.6;
    context.lineWidth = 1;
    context.stroke();
    context.globalAlpha = 1;
    context.fillStyle = unflex.colour("--muted");
    context.font = "12px system-ui, sans-serif";
    context.fillText(`grid ${step} mm`, 8, height - 8);
  };

  const drawPaths = (context, canvas, version, palette, width, height) => {
    const layer = reader(drawn(state.layer));
    const strokes = Array.from({length: shades}, () => new Path2D());
    const used = new Uint8Array(shades);
    const {places, codes} = layer;
    const ox = width / 2 - state.x * state.scale,
      oy = height / 2 + state.y * state.scale,
      s = state.scale;
    for (let i = 0, last = -1; i < layer.count; ++i) {
      const x0 = ox + places[4 * i] * s,
        y0 = oy - places[4 * i + 1] * s;
      const x1 = ox + places[4 * i + 2] * s,
        y1 = oy - places[4 * i + 3] * s;
      if (
        (x0 < -9 && x1 < -9) ||
        (y0 < -9 && y1 < -9) ||
        (x0 > width + 9 && x1 > width + 9) ||
        (y0 > height + 9 && y1 > height + 9)
      ) {
        last = -1;
        continue;
      }
      const shade = shadeOfCode[codes[2 * i + version]];
      const stroke = strokes[shade];
      if (shade !== last || layer.path[i] !== layer.path[i - 1]) stroke.moveTo(x0, y0);
      stroke.lineTo(x1, y1);
      last = shade;
      used[shade] = 1;
    }
    context.lineCap = "round";
    context.lineJoin = "round";
    // An extrusion is about 0.4 mm wide.
    const line = Math.min(Math.max(0.34 * s, 1), 14);
    for (let shade = 0; shade < shades; ++shade) {
      if (!used[shade]) continue;
      context.strokeStyle = palette[shade];
      context.lineWidth = line * (0.8 + (0.6 * shade) / (shades - 1));
      context.stroke(strokes[shade]);
    }
  };

  const drawPlaces = (context, canvas) => {
    for (const place of places) {
      const chosen = place === state.chosen;
      if (place.layer !== state.layer && !(chosen && drawn(place.layer) === drawn(state.layer)))
        continue;
      const [px, py] = toScreen(canvas, place.at[0], place.at[1]);
      context.beginPath();
      context.arc(px, py, chosen ? 13 : 7, 0, 7);
      context.lineWidth = chosen ? 3 : 1.5;
      context.strokeStyle = unflex.colour("--text");
      context.stroke();
    }
  };

  const draw = () => {
    asked = false;
    const palette = colours();
    canvases.forEach((canvas, version) => {
      const {width, height} = size(canvas),
        ratio = devicePixelRatio || 1;
      if (
        canvas.width !== Math.round(width * ratio) ||
        canvas.height !== Math.round(height * ratio)
      ) {
        canvas.width = Math.round(width * ratio);
        canvas.height = Math.round(height * ratio);
      }
      const context = canvas.getContext("2d");
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.clearRect(0, 0, width, height);
      drawGrid(context, canvas, width, height);
      if (data.layers.length) drawPaths(context, canvas, version, palette, width, height);
      drawPlaces(context, canvas);
    });
  };
  const redraw = () => {
    if (!asked) {
      asked = true;
      requestAnimationFrame(draw);
    }
  };

  const drawScale = () => {
    const canvas = document.getElementById("scale"),
      context = canvas.getContext("2d");
    canvas.width = shades;
    colours().forEach((colour, i) => {
      context.fillStyle = colour;
      context.fillRect(i, 0, 1, 12);
    });
    const ticks = document.getElementById("scale-ticks");
    ticks.replaceChildren();
    for (let e = -3; e < 6; ++e)
      for (const f of [1, 3]) {
        const um = f * 10 ** e;
        if (um < bottom * 1.05 || um > top * 0.75) continue;
        ticks.append(
          make(
            "span",
            {style: `left: ${100 * fraction(um)}%`},
            String(parseFloat(um.toPrecision(2))),
          ),
        );
      }
    ticks.append(make("span", {style: "left: 100%"}, micrometres(top)));
    // From the right, so that the end of the scale keeps its label.
    const between = 4;
    let next = Infinity;
    for (const tick of [...ticks.children].reverse()) {
      const box = tick.getBoundingClientRect();
      if (box.right + between > next) tick.remove();
      else next = box.left;
    }
  };

  const fitScale = () => {
    const {width, height} = size(canvases[0]);
    return (
      0.92 *
      Math.min(
        width / Math.max(bounds[2] - bounds[0], 1),
        height / Math.max(bounds[3] - bounds[1], 1),
      )
    );
  };
  const fit = () => {
    state.x = (bounds[0] + bounds[2]) / 2;
    state.y = (bounds[1] + bounds[3]) / 2;
    state.scale = fitScale();
    redraw();
  };
  const zoom = (factor, canvas, px, py) => {
    const {width, height} = size(canvases[0]);
    const at = canvas ? [px, py] : [width / 2, height / 2];
    const [x, y] = toPrint(canvases[0], ...at);
    state.scale = Math.min(Math.max(state.scale * factor, fitScale() / 4), 2000);
    const [x2, y2] = toPrint(canvases[0], ...at);
    state.x += x - x2;
    state.y += y - y2;
    redraw();
  };
  const pan = (dx, dy) => {
    state.x -= dx / state.scale;
    state.y += dy / state.scale;
    redraw();
  };
  const setLayer = index => {
    state.layer = Math.min(Math.max(Math.round(index), 0), Math.max(data.layers.length - 1, 0));
    onLayer(state.layer);
    redraw();
  };

  // The stretch nearest to a point of the picture, within some pixels.
  const nearest = (canvas, px, py) => {
    if (!data.layers.length) return null;
    const layer = reader(drawn(state.layer)),
      [x, y] = toPrint(canvas, px, py);
    let best = (10 / state.scale) ** 2,
      found = -1;
    for (let i = 0; i < layer.count; ++i) {
      const x0 = layer.places[4 * i],
        y0 = layer.places[4 * i + 1];
      const dx = layer.places[4 * i + 2] - x0,
        dy = layer.places[4 * i + 3] - y0;
      const along = Math.min(
        Math.max(((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy || 1), 0),
        1,
      );
      const d2 = (x - x0 - along * dx) ** 2 + (y - y0 - along * dy) ** 2;
      if (d2 < best) {
        best = d2;
        found = i;
      }
    }
    if (found < 0) return null;
    const head = layer.heads[layer.path[found]];
    return {
      first: head.first,
      last: head.last,
      feature: data.features[head.feature].name,
      before: codeToUm(layer.codes[2 * found]),
      after: codeToUm(layer.codes[2 * found + 1]),
    };
  };
  const readout = document.getElementById("readout");
  const point = (canvas, event) => {
    const box = canvas.getBoundingClientRect();
    const found = nearest(canvas, event.clientX - box.left, event.clientY - box.top);
    if (!found) return;
    const lines =
      found.first === found.last ? `line ${found.first}` : `lines ${found.first} to ${found.last}`;
    readout.textContent = `${found.feature || "path"}, ${lines}: ${micrometres(found.before)} before, ${micrometres(found.after)} after`;
  };

  canvases.forEach(canvas => {
    const pointers = new Map();
    canvas.addEventListener("pointerdown", event => {
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      canvas.setPointerCapture(event.pointerId);
      canvas.classList.add("dragging");
      if (event.pointerType !== "mouse") point(canvas, event);
    });
    const release = event => {
      pointers.delete(event.pointerId);
      canvas.classList.toggle("dragging", pointers.size > 0);
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("pointermove", event => {
      const before = pointers.get(event.pointerId);
      if (!before) {
        point(canvas, event);
        return;
      }
      const now = [event.clientX, event.clientY];
      if (pointers.size === 1) pan(now[0] - before[0], now[1] - before[1]);
      else {
        const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
        const box = canvas.getBoundingClientRect();
        const spread = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]) || 1;
        zoom(
          spread(now, other) / spread(before, other),
          canvas,
          (now[0] + other[0]) / 2 - box.left,
          (now[1] + other[1]) / 2 - box.top,
        );
        pan((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
      }
      pointers.set(event.pointerId, now);
    });
    // Over a picture without focus the wheel scrolls the page.
    canvas.addEventListener(
      "wheel",
      event => {
        if (!event.ctrlKey && document.activeElement !== canvas) return;
        event.preventDefault();
        const box = canvas.getBoundingClientRect();
        zoom(
          Math.exp(-0.0015 * event.deltaY * (event.deltaMode ? 20 : 1)),
          canvas,
          event.clientX - box.left,
          event.clientY - box.top,
        );
      },
      {passive: false},
    );
    canvas.addEventListener("dblclick", event => {
      const box = canvas.getBoundingClientRect();
      zoom(2, canvas, event.clientX - box.left, event.clientY - box.top);
    });
    canvas.addEventListener("keydown", event => {
      const moves = {
        ArrowLeft: [60, 0],
        ArrowRight: [-60, 0],
        ArrowUp: [0, 60],
        ArrowDown: [0, -60],
      };
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (moves[event.key]) pan(...moves[event.key]);
      else if (event.key === "+" || event.key === "=") zoom(1.4);
      else if (event.key === "-") zoom(1 / 1.4);
      else if (event.key === "0") fit();
      else if (event.key === "PageUp") setLayer(state.layer + 1);
      else if (event.key === "PageDown") setLayer(state.layer - 1);
      else return;
      event.preventDefault();
    });
  });
  let width = 0;
  new ResizeObserver(() => {
    const now = size(canvases[0]).width;
    if (width) state.scale *= now / width;
    width = now;
    drawScale();
    redraw();
  }).observe(canvases[0]);
  unflex.theme(() => {
    drawScale();
    redraw();
  });
  drawScale();
  fit();

  return {
    state,
    fit,
    zoom,
    setLayer,
    toScreen: (x, y) => toScreen(canvases[0], x, y),
    draw,
    canvases,
    shownLayer: () => drawn(state.layer),
    setPlaces: list => {
      places = list;
      redraw();
    },
    // Shows a place in the middle, with some mm around it.
    show: place => {
      const {width, height} = size(canvases[0]);
      state.chosen = place;
      [state.x, state.y] = place.at;
      state.scale = Math.max(Math.min(width, height) / 16, fitScale());
      setLayer(place.layer);
    },
  };
};
