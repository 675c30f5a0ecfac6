// Elements and line plots as inline SVG. Text only ever becomes text nodes.
const make = (() => {
  const svgNames = new Set(["svg", "g", "path", "line", "text", "circle", "rect", "title"]);
  return (name, attributes = {}, ...children) => {
    const node = svgNames.has(name)
      ? document.createElementNS("http:" + "//www.w3.org/2000/svg", name)
      : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
      if (key === "style") node.style.cssText = value;
      else if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
      else node.setAttribute(key, value);
    }
    node.append(...children);
    return node;
  };
})();

// Micrometres with three figures.
const figures = value =>
  value >= 99.95 ? value.toFixed(0) : value >= 9.995 ? value.toFixed(1) : value.toFixed(2);
const micrometres = value => figures(value) + "\u00a0µm";

const plot = (() => {
  const margin = {left: 52, right: 12, top: 10, bottom: 34};

  const linearTicks = (low, high, count) => {
    const rough = (high - low) / count;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map(f => f * power).find(s => s >= rough * 0.999);
    const ticks = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; ++i)
      ticks.push(i * step);
    return ticks;
  };
  const logTicks = (low, high) => {
    const ticks = [];
    const dense = high / low < 3000;
    for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); ++e) {
      for (const f of dense ? [1, 3] : [1]) {
        const tick = f * 10 ** e;
        if (tick >= low * 0.999 && tick <= high * 1.001) ticks.push(tick);
      }
    }
    return ticks;
  };
  const tickText = value =>
    Math.abs(value) < 1e-12
      ? "0"
      : Math.abs(value) >= 1e4
        ? (value / 1000).toFixed(0) + "k"
        : String(parseFloat(value.toPrecision(3)));

  const scaleOf = (log, low, high, from, to) => {
    const f = log ? Math.log : v => v;
    const k = (to - from) / (f(high) - f(low));
    return {
      at: v => from + (f(log ? Math.max(v, low * 1e-3) : v) - f(low)) * k,
      back: p => (log ? Math.exp : v => v)(f(low) + (p - from) / k),
      low,
      high,
    };
  };

  const extent = (series, key) => {
    let low = Infinity,
      high = -Infinity;
    for (const one of series)
      for (const v of one[key]) {
        if (!Number.isFinite(v)) continue;
        if (v < low) low = v;
        if (v > high) high = v;
      }
    return low <= high ? [low, high] : [0, 1];
  };

  // spec: series [{name, x, y, colour (a custom property), dash, width, points}], xLabel, yLabel,
  // xLog, yLog, x, y ([low, high]), equal (both axes to one scale), labels (names at the right end if there is room),
  // zero (a line at y = 0), title, value (text of a y), marks ([{x, y, text}]), onpick(x), band
  // (shaded: {from, to, text}).
  return (box, spec) => {
    const draw = () => {
      const width = box.clientWidth,
        height = box.clientHeight;
      if (width < 40 || height < 40) return;
      const longest = Math.max(0, ...spec.series.map(one => (one.name || "").length));
      const labelled = spec.labels && width >= 380;
      const right = labelled ? 6.6 * longest + 16 : spec.xTicks ? 20 : margin.right;
      const inner = {
        left: margin.left,
        right: width - right,
        top: margin.top,
        bottom: height - (spec.bare ? 4 : margin.bottom),
      };
      let [x0, x1] = spec.x || extent(spec.series, "x");
      let [y0, y1] = spec.y || extent(spec.series, "y");
      if (!spec.y) {
        if (spec.yLog) {
          y0 /= spec.band ? 1.6 : 1.2;
          y1 *= spec.band ? 1.5 : 1.2;
        } else {
          const pad = 0.06 * (y1 - y0) || 1;
          y0 = spec.fromZero ? 0 : y0 - pad;
          y1 += pad;
        }
      }
      if (x1 <= x0) x1 = x0 + 1;
      if (y1 <= y0) y1 = y0 * 2 + 1;
      if (spec.equal) {
        const pad = 1.1,
          mx = (x0 + x1) / 2,
          my = (y0 + y1) / 2;
        const unit =
          pad *
          Math.max((x1 - x0) / (inner.right - inner.left), (y1 - y0) / (inner.bottom - inner.top));
        x0 = mx - (unit * (inner.right - inner.left)) / 2;
        x1 = 2 * mx - x0;
        y0 = my - (unit * (inner.bottom - inner.top)) / 2;
        y1 = 2 * my - y0;
      }
      const x = scaleOf(spec.xLog, x0, x1, inner.left, inner.right);
      const y = scaleOf(spec.yLog, y0, y1, inner.bottom, inner.top);
      const svg = make("svg", {
        class: "plot",
        viewBox: `0 0 ${width} ${height}`,
        width,
        height,
        role: "img",
        "aria-label": spec.title || "",
      });
      const grid = make("g", {stroke: "var(--line)", "stroke-width": 1});
      const texts = make("g");
      for (const tick of spec.yLog
        ? logTicks(y0, y1)
        : linearTicks(y0, y1, Math.max(2, height / 55))) {
        const py = y.at(tick);
        grid.append(make("line", {x1: inner.left, x2: inner.right, y1: py, y2: py}));
        texts.append(
          make("text", {x: inner.left - 6, y: py + 4, "text-anchor": "end"}, tickText(tick)),
        );
      }
      if (!spec.bare) {
        for (const tick of spec.xTicks ||
          (spec.xLog ? logTicks(x0, x1) : linearTicks(x0, x1, Math.max(2, width / 90)))) {
          const px = x.at(tick);
          grid.append(
            make("line", {x1: px, x2: px, y1: inner.bottom, y2: inner.top, opacity: 0.5}),
          );
          texts.append(
            make(
              "text",
              {x: px, y: inner.bottom + 16, "text-anchor": "middle"},
              (spec.xText || tickText)(tick),
            ),
          );
        }
        texts.append(
          make("text", {x: inner.right, y: height - 3, "text-anchor": "end"}, spec.xLabel || ""),
        );
      }
      texts.append(make("text", {x: inner.left + 4, y: inner.top + 9}, spec.yLabel || ""));
      if (spec.band) {
        const from = Math.max(x.at(spec.band.from), inner.left),
          to = Math.min(x.at(spec.band.to), inner.right);
        svg.append(
          make("rect", {
            class: "band",
            x: from,
            y: inner.top,
            width: to - from,
            height: inner.bottom - inner.top,
            fill: "var(--raised)",
          }),
        );
        texts.append(
          make(
            "text",
            {x: (from + to) / 2, y: inner.bottom - 6, "text-anchor": "middle"},
            spec.band.text,
          ),
        );
      }
      svg.append(grid);
      if (spec.centre !== undefined) {
        const px = x.at(spec.centre);
        svg.append(
          make("line", {
            x1: px,
            x2: px,
            y1: inner.top,
            y2: inner.bottom,
            stroke: "var(--muted)",
            "stroke-dasharray": "2 3",
          }),
        );
      }
      const lines = make("g", {fill: "none", "stroke-linejoin": "round"});
      for (const one of spec.series) {
        let d = "",
          pen = false;
        for (let i = 0; i < one.x.length; ++i) {
          if (!Number.isFinite(one.y[i])) {
            pen = false;
            continue;
          }
          const px = x.at(one.x[i]),
            py = Math.min(Math.max(y.at(one.y[i]), -1e4), 1e4);
          if (one.step && pen) d += `H${px.toFixed(1)}`;
          d += `${pen ? "L" : "M"}${px.toFixed(1)} ${py.toFixed(1)}`;
          pen = true;
        }
        const attributes = {d, stroke: `var(${one.colour})`, "stroke-width": one.width || 2};
        if (one.dash) attributes["stroke-dasharray"] = one.dash;
        if (one.fill) {
          lines.append(
            make("path", {
              d: d + `V${y.at(y0)}H${x.at(one.x[0])}Z`,
              fill: `var(${one.colour})`,
              "fill-opacity": 0.16,
            }),
          );
        }
        lines.append(make("path", attributes));
        if (one.points)
          for (let i = 0; i < one.x.length; ++i)
            if (Number.isFinite(one.y[i])) {
              lines.append(
                make("circle", {
                  cx: x.at(one.x[i]),
                  cy: y.at(one.y[i]),
                  r: 3,
                  fill: `var(${one.colour})`,
                }),
              );
            }
      }
      svg.append(lines);
      for (const mark of spec.marks || []) {
        svg.append(
          make("circle", {
            cx: x.at(mark.x),
            cy: y.at(mark.y),
            r: 5,
            fill: "none",
            stroke: "var(--text)",
            "stroke-width": 2,
          }),
        );
      }
      svg.append(texts);
      if (labelled) svg.append(endLabels(spec.series, x, y, inner));
      const cursor = make("g");
      svg.append(cursor);
      hover(svg, cursor, spec, x, y, inner, width);
      box.replaceChildren(svg);
    };
    if (box.plotObserver) box.plotObserver.disconnect();
    box.plotObserver = new ResizeObserver(draw);
    box.plotObserver.observe(box);
    draw();
    return draw;
  };

  // Names at the ends of the curves, moved apart.
  function endLabels(series, x, y, inner) {
    const labels = series
      .filter(one => one.y.length)
      .map(one => ({one, py: y.at(one.y[one.y.length - 1])}));
    labels.sort((a, b) => a.py - b.py);
    const gap = 14;
    for (let i = 1; i < labels.length; ++i)
      labels[i].py = Math.max(labels[i].py, labels[i - 1].py + gap);
    for (let i = labels.length - 1, limit = inner.bottom; i >= 0; --i, limit -= gap)
      labels[i].py = Math.min(labels[i].py, limit);
    const group = make("g");
    for (const {one, py} of labels) {
      group.append(
        make(
          "text",
          {
            x: inner.right + 8,
            y: py + 4,
            style: `fill: var(${one.colour}); font-weight: ${one.width > 2 ? 700 : 400}`,
          },
          one.name,
        ),
      );
    }
    return group;
  }

  // Shows the values of all curves at the pointer.
  function hover(svg, cursor, spec, x, y, inner, width) {
    if (spec.equal) return;
    const value = spec.value || (v => String(parseFloat(v.toPrecision(3))));
    svg.addEventListener("pointerleave", () => cursor.replaceChildren());
    svg.addEventListener("pointermove", event => {
      const box = svg.getBoundingClientRect();
      const px = Math.min(Math.max(event.clientX - box.left, inner.left), inner.right);
      const at = x.back(px);
      const shown = spec.series
        .filter(one => one.name && one.x.length)
        .map(one => {
          let best = 0;
          for (let i = 1; i < one.x.length; ++i)
            if (Math.abs(one.x[i] - at) < Math.abs(one.x[best] - at)) best = i;
          return {one, text: `${one.name} ${value(one.y[best])}`};
        });
      const toLeft = px > width / 2;
      const wide = Math.max(...shown.map(s => s.text.length)) * 6.6 + 14;
      const left = toLeft ? px - wide - 8 : px + 8;
      cursor.replaceChildren(
        make("line", {x1: px, x2: px, y1: inner.top, y2: inner.bottom, stroke: "var(--muted)"}),
        make("rect", {
          x: left,
          y: inner.top,
          width: wide,
          height: 8 + 15 * shown.length,
          rx: 6,
          fill: "var(--surface)",
          stroke: "var(--line)",
        }),
        ...shown.map((s, i) =>
          make(
            "text",
            {x: left + 7, y: inner.top + 16 + 15 * i, style: `fill: var(${s.one.colour})`},
            s.text,
          ),
        ),
      );
    });
    if (spec.onpick) {
      svg.style.cursor = "pointer";
      svg.addEventListener("click", event =>
        spec.onpick(x.back(event.clientX - svg.getBoundingClientRect().left)),
      );
    }
  }
})();
