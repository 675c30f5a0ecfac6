// Builds the report of a print.
const unflexReport = (() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const byId = id => document.getElementById(id);
  const featureName = index => (data.features[index] && data.features[index].name) || "not named";
  const rows = data.layers;

  // As the slicer counts them. What comes before its first layer primes the nozzle.
  const layers = rows.length - data.start_layers;
  const layerText = index =>
    index < data.start_layers ? "before the first layer" : `layer ${index - data.start_layers + 1}`;
  const capital = text => text[0].toUpperCase() + text.slice(1);
  const slider = byId("layer"),
    layerName = byId("layer-name");
  slider.max = Math.max(rows.length - 1, 0);
  const view = layerView(data, index => {
    slider.value = index;
    const row = rows[index];
    if (!row) {
      layerName.textContent = "No filament is laid in this file.";
      return;
    }
    const shown = view ? view.shownLayer() : index;
    layerName.textContent =
      `${capital(layerText(index))}${index < data.start_layers ? "" : ` of ${layers}`}, Z ${+Number(row[0]).toFixed(3)} mm, from line ${row[1]}` +
      (shown === index ? "" : ` (drawn: ${layerText(shown)})`);
    slider.setAttribute("aria-valuetext", layerName.textContent);
    [
      ["before", 3],
      ["after", 5],
    ].forEach(([name, k]) => {
      byId(name + "-note").textContent =
        `up to ${micrometres(row[k])}, typically ${micrometres(row[k + 1])}`;
      byId("view-" + name).setAttribute(
        "aria-label",
        `${capital(layerText(index))}, ${name} compensation: up to ${micrometres(row[k])}, typically ${micrometres(row[k + 1])} off the path`,
      );
    });
    drawStrip();
  });
  slider.addEventListener("input", () => view.setLayer(Number(slider.value)));
  byId("layer-up").addEventListener("click", () => view.setLayer(view.state.layer + 1));
  byId("layer-down").addEventListener("click", () => view.setLayer(view.state.layer - 1));
  byId("zoom-in").addEventListener("click", () => view.zoom(1.6));
  byId("zoom-out").addEventListener("click", () => view.zoom(1 / 1.6));
  byId("zoom-fit").addEventListener("click", () => {
    view.state.chosen = null;
    view.fit();
  });

  if (data.tolerance_mm > 0.006) {
    const layers = data.layer_step > 1 ? `, and one layer of ${data.layer_step}` : "";
    byId("coarse").textContent =
      `This print is long: its paths are drawn to ${data.tolerance_mm} mm${layers}.`;
    byId("coarse").hidden = false;
  }

  // Draws the largest deviation of every layer above the slider.
  function drawStrip() {
    const strip = byId("strip");
    if (rows.length < 2) {
      strip.hidden = true;
      return;
    }
    const width = strip.clientWidth,
      height = 44;
    if (!width) return;
    const most = Math.max(...rows.map(row => row[3]), ...rows.map(row => row[5]), 1);
    const pad = 8,
      x = i => pad + (i / (rows.length - 1)) * (width - 2 * pad);
    const y = um =>
      height -
      2 -
      (height - 6) *
        Math.min(Math.max(Math.log((Math.max(um, 1e-9) / most) * 300) / Math.log(300), 0), 1);
    const line = k =>
      rows.map((row, i) => `${i ? "L" : "M"}${x(i).toFixed(1)} ${y(row[k]).toFixed(1)}`).join("");
    const at = x(view ? view.state.layer : 0);
    const svg = make(
      "svg",
      {
        width,
        height,
        viewBox: `0 0 ${width} ${height}`,
        style: "display: block; cursor: pointer",
        role: "img",
        "aria-label": "Largest deviation of each layer, before and after",
      },
      make("path", {d: line(3), fill: "none", stroke: "var(--before)", "stroke-width": 1.5}),
      make("path", {d: line(5), fill: "none", stroke: "var(--after)", "stroke-width": 1.5}),
      make("line", {x1: at, x2: at, y1: 0, y2: height, stroke: "var(--text)", "stroke-width": 1.5}),
    );
    svg.addEventListener("click", event =>
      view.setLayer(
        ((event.clientX - svg.getBoundingClientRect().left - pad) / (width - 2 * pad)) *
          (rows.length - 1),
      ),
    );
    strip.replaceChildren(svg);
  }
  new ResizeObserver(drawStrip).observe(byId("strip"));

  // The worst places.
  const showMoment = momentView();
  const buttons = [];
  const look = (place, button) => {
    buttons.forEach(each => each.setAttribute("aria-current", String(each === button)));
    byId("moment-note").textContent =
      `Line ${place.line}, ${featureName(place.feature)}, ${layerText(place.layer)}, X ${place.at[0]} Y ${place.at[1]} Z ${place.at[2]}: ${micrometres(place.um[0])} before, ${micrometres(place.um[1])} after. Time counts from when the plan is there.`;
    showMoment(place);
  };
  const choose = (place, button) => {
    look(place, button);
    view.show(place);
    byId("print").scrollIntoView({
      behavior: matchMedia("(prefers-reduced-motion: reduce)").matches ? "auto" : "smooth",
      block: "start",
    });
  };
  [
    ["worst-before", data.worst[0]],
    ["worst-after", data.worst[1]],
  ].forEach(([id, places]) => {
    byId(id).replaceChildren(
      ...places.map(place => {
        const button = make(
          "button",
          {type: "button"},
          make(
            "span",
            {class: "change"},
            make("span", {class: "before"}, figures(place.um[0])),
            " → ",
            make("span", {class: "after"}, micrometres(place.um[1])),
          ),
          make(
            "span",
            {class: "what"},
            `line ${place.line} · ${layerText(place.layer)} · ${featureName(place.feature)}`,
          ),
        );
        button.addEventListener("click", () => choose(place, button));
        buttons.push(button);
        return make("li", {}, button);
      }),
    );
    if (!places.length) byId(id).append(make("li", {class: "note"}, "None."));
  });
  const places = [...data.worst[0], ...data.worst[1]];
  view.setPlaces(places);

  // For how long the nozzle deviates how far.
  const histogram = () => {
    const cells = data.histogram,
      total = Math.max(data.extruding_s, 1e-9),
      least = 0.05;
    const low = cells.findIndex(cell => cell[0] > 0.99 * least);
    const high = cells.reduce((last, cell, i) => (cell[1] + cell[2] > 0 ? i : last), low) + 2;
    const shown = cells.slice(low, Math.min(high, cells.length - 1));
    const below = k =>
      ((100 * cells.slice(0, low).reduce((sum, cell) => sum + cell[k], 0)) / total).toFixed(0) +
      " %";
    const curve = k => ({
      x: shown.map(cell => cell[0]),
      y: shown.map(cell => (100 * cell[k]) / total),
      step: true,
      fill: true,
    });
    plot(byId("histogram"), {
      series: [
        {...curve(1), name: "before", colour: "--before"},
        {...curve(2), name: "after", colour: "--after"},
      ],
      xLog: true,
      yLabel: "% of the time",
      xLabel: "µm",
      fromZero: true,
      value: v => v.toFixed(1) + " %",
      title: "Share of the time over the deviation, before and after",
    });
    byId("distribution-note").textContent =
      `Share of the extruding time that the nozzle is this far from its path. Nearer than ${least} µm, as on straight lines at constant speed, it is during ${below(1)} before and ${below(2)} after.`;
  };

  const head = (...names) =>
    make("thead", {}, make("tr", {}, ...names.map(name => make("th", {scope: "col"}, name))));
  const bars = (before, after, most) => {
    const bar = (um, colour) =>
      make(
        "div",
        {},
        make("span", {
          class: "bar",
          style: `width: ${Math.max((100 * um) / most, 0.5)}%; background: var(${colour})`,
        }),
      );
    return make(
      "td",
      {class: "bars", "aria-hidden": "true"},
      bar(before, "--before"),
      bar(after, "--after"),
    );
  };
  const features = () => {
    const shown = data.features.filter(feature => feature.time > 0).sort((a, b) => b.time - a.time);
    const most = Math.max(...shown.map(feature => feature.change[0][1]), 1e-9);
    byId("features").replaceChildren(
      head("Feature", "Time", "Typical, µm", "", "Largest, µm"),
      make(
        "tbody",
        {},
        ...shown.map(feature => {
          const [[beforeMax, beforeRms], [afterMax, afterRms]] = feature.change;
          return make(
            "tr",
            {},
            make("th", {scope: "row", style: "font-weight: 500"}, feature.name || "not named"),
            make(
              "td",
              {},
              `${((100 * feature.time) / Math.max(data.extruding_s, 1e-9)).toFixed(1)} %`,
            ),
            make("td", {}, `${figures(beforeRms)} → ${figures(afterRms)}`),
            bars(beforeRms, afterRms, most),
            make("td", {}, `${figures(beforeMax)} → ${figures(afterMax)}`),
          );
        }),
      ),
    );
  };

  const rivals = () => {
    const errors = data.frequency_errors.map(e => 100 * e),
      exact = errors.indexOf(0);
    // As sliced, unflex, then the shapers.
    const looks = [
      ["--before"],
      ["--after"],
      ["--series-3"],
      ["--series-4"],
      ["--series-5"],
      ["--series-6", "7 4"],
    ];
    const series = data.contenders
      .filter(c => c.drawn)
      .map((c, i) => ({
        name: c.name,
        x: errors,
        y: c.spreads.map(s => Math.max(s[1], 1e-3)),
        colour: looks[i % looks.length][0],
        dash: looks[i % looks.length][1],
        points: true,
        width: i === 1 ? 3.5 : 1.8,
      }))
      .filter(c => c.y.length);
    byId("sensitivity-legend").replaceChildren(
      ...series.map(c =>
        make(
          "span",
          {},
          make("i", {style: `border-color: var(${c.colour}); border-top-style: ${c.dash ? "dashed" : "solid"}`}),
          c.name,
        ),
      ),
    );
    const band = 100 * data.freq_error;
    plot(byId("sensitivity"), {
      series,
      band: band > 0 && {from: -band, to: band, text: `designed for ±${+band.toFixed(1)} %`},
      yLog: true,
      labels: true,
      xTicks: errors,
      xText: v => (v > 0 ? "+" : "") + v.toFixed(0) + " %",
      xLabel: "true frequency against the settings",
      yLabel: "typical deviation, µm",
      value: micrometres,
      title: "Typical deviation over the error of the frequency, for each method",
    });
    const worst = (contender, size, k) =>
      Math.max(
        ...errors.map((e, i) =>
          Math.abs(Math.abs(e) - size) < 1e-9 ? contender.spreads[i][k] : 0,
        ),
      );
    byId("contenders").replaceChildren(
      head("Typical, µm", "exact", "±5 %", "±10 %", "±15 %", "largest, exact", "at corners, exact"),
      make(
        "tbody",
        {},
        ...data.contenders.map((contender, i) =>
          make(
            "tr",
            i === 1 ? {class: "own"} : contender.printers ? {class: "printers"} : {},
            make("th", {scope: "row", style: "font-weight: inherit"}, contender.name),
            ...(contender.spreads.length
              ? [
                  contender.spreads[exact][1],
                  worst(contender, 5, 1),
                  worst(contender, 10, 1),
                  worst(contender, 15, 1),
                  contender.spreads[exact][0],
                  contender.corners,
                ].map(um => make("td", {}, um === null ? "–" : figures(um)))
              : [make("td", {colspan: 6}, "not defined for this damping")]),
          ),
        ),
      ),
    );
    const minutes = s => (s < 120 ? `${s.toFixed(0)} s` : `${(s / 60).toFixed(0)} min`);
    const all = data.shapers_s > 0.98 * data.extruding_s;
    byId("rivals-note").textContent =
      "What becomes of each method if the machine's true frequency is a little different. Input shapers are tuned to the frequencies in the settings, the printer's own to those of its configuration. They leave the print time as sliced." +
      (all
        ? ""
        : ` They were measured during ${minutes(data.shapers_s)} of ${minutes(data.extruding_s)}, spread over the print.`);
  };

  const details = () => {
    byId("facts").replaceChildren(
      ...data.facts.flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)]),
    );
    const remarks = data.remarks,
      block = byId("remarks");
    const list = (title, texts, count) => {
      if (!texts.length) return;
      block.append(
        make("h3", {}, count > texts.length ? `${title} (${texts.length} of ${count})` : title),
        make("ul", {}, ...texts.map(text => make("li", {}, text))),
      );
    };
    list("Rules broken", remarks.violations, remarks.violation_count);
    list(
      "Runs that keep their original moves",
      remarks.fallbacks.map(([first, last, reason]) => `lines ${first} to ${last}: ${reason}`),
      remarks.fallback_count,
    );
    list(
      "Moves that are not rewritten",
      Object.entries(remarks.kept_moves).map(([reason, count]) => `${count}: ${reason}`),
      0,
    );
    list("Warnings", remarks.warnings, remarks.warning_count);
    byId("settings").replaceChildren(
      head("Key", "Value", "From"),
      make(
        "tbody",
        {},
        ...data.settings.map(row => make("tr", {}, ...row.map(text => make("td", {}, text)))),
      ),
    );
  };

  // First how robust the print is and the picture of the most telling layer. The rest is built when
  // they are on screen.
  rivals();
  const weight = (row, i) => (row[2] - (i ? rows[i - 1][2] : 0)) * row[4] ** 2;
  const telling = rows.reduce(
    (best, row, i) =>
      i >= data.start_layers && weight(row, i) > weight(rows[best], best) ? i : best,
    Math.min(data.start_layers, rows.length - 1),
  );
  view.setLayer(telling);
  view.draw();
  performance.mark("unflex-first-view");
  requestAnimationFrame(() =>
    setTimeout(() => {
      histogram();
      features();
      details();
      if (places.length) look(places[0], buttons[0]);
      else byId("moment").hidden = true;
      performance.mark("unflex-complete");
    }),
  );
  return {data, view};
})();
