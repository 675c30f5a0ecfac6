// What base and nozzle do around a place.
const momentView = () => {
  const names = ["time", "contour", "rx", "ry", "bx", "by", "px", "py"];
  const unpack = text => {
    const values = new Float32Array(bytesOf(text).buffer);
    const columns = {};
    names.forEach((name, k) => {
      columns[name] = Array.from(
        {length: values.length / names.length},
        (_, i) => values[names.length * i + k],
      );
    });
    return columns;
  };

  // Curves are smoothed over this time, since a base that follows lines of a few ms hardly
  // accelerates within a line.
  const window_s = 0.004;
  const interpolated = (times, values, t) => {
    if (t < times[0] || t > times[times.length - 1]) return NaN;
    let low = 0,
      high = times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= t) low = middle;
      else high = middle;
    }
    return (
      values[low] +
      ((values[high] - values[low]) * (t - times[low])) / (times[high] - times[low] || 1)
    );
  };
  const velocity = (times, values) =>
    times.map(
      t =>
        (interpolated(times, values, t + window_s / 2) -
          interpolated(times, values, t - window_s / 2)) /
        window_s,
    );
  const acceleration = (times, values) =>
    times.map(
      t =>
        (interpolated(times, values, t + window_s) -
          2 * interpolated(times, values, t) +
          interpolated(times, values, t - window_s)) /
        window_s ** 2,
    );

  // The nozzle with its deviation from the nearest point of the path magnified by `factor`.
  const magnified = (moments, factor) => {
    const x = [],
      y = [];
    for (let i = 0; i < moments.time.length; ++i) {
      let best = Infinity,
        nx = 0,
        ny = 0;
      for (let j = Math.max(0, i - 35); j < Math.min(moments.time.length - 1, i + 35); ++j) {
        const dx = moments.rx[j + 1] - moments.rx[j],
          dy = moments.ry[j + 1] - moments.ry[j];
        const ax = moments.px[i] - moments.rx[j],
          ay = moments.py[i] - moments.ry[j];
        const along = Math.min(Math.max((ax * dx + ay * dy) / (dx * dx + dy * dy || 1), 0), 1);
        const d2 = (ax - along * dx) ** 2 + (ay - along * dy) ** 2;
        if (d2 < best) {
          best = d2;
          nx = moments.rx[j] + along * dx;
          ny = moments.ry[j] + along * dy;
        }
      }
      x.push(nx + factor * (moments.px[i] - nx));
      y.push(ny + factor * (moments.py[i] - ny));
    }
    return {x, y};
  };

  const legend = [
    ["--muted", "plan", "2 3"],
    ["--before", "nozzle before"],
    ["--after", "nozzle after"],
    ["--series-3", "base after", "6 4"],
  ];
  document
    .getElementById("moment-legend")
    .replaceChildren(
      ...legend.map(([colour, name, dash]) =>
        make(
          "span",
          {},
          make("i", {
            style: `border-color: var(${colour}); border-top-style: ${dash ? "dashed" : "solid"}`,
          }),
          name,
        ),
      ),
    );

  let axis = 0,
    before = null,
    after = null;
  const buttons = [...document.querySelectorAll("#moment .axes button")];
  const milliseconds = moments => moments.time.map(t => 1000 * t);

  const drawMotion = () => {
    buttons.forEach(button =>
      button.setAttribute("aria-pressed", String(Number(button.dataset.axis) === axis)),
    );
    const suffix = axis ? "y" : "x",
      letter = axis ? "Y" : "X";
    const curves = derivative => {
      const list = [];
      const add = (moments, key, colour, name, dash) => {
        if (moments)
          list.push({
            name,
            colour,
            dash,
            x: milliseconds(moments),
            y: derivative(moments.time, moments[key + suffix]),
          });
      };
      add(after, "r", "--muted", "plan", "2 3");
      add(before, "p", "--before", "nozzle before");
      add(after, "b", "--series-3", "base after", "6 4");
      add(after, "p", "--after", "nozzle after");
      return list;
    };
    plot(document.getElementById("velocity-plot"), {
      series: curves(velocity),
      yLabel: `mm/s along ${letter}`,
      xLabel: "ms",
      centre: 0,
      title: `Velocity along ${letter} over time`,
    });
    plot(document.getElementById("acceleration-plot"), {
      series: curves(acceleration),
      yLabel: `mm/s² along ${letter}`,
      xLabel: "ms",
      centre: 0,
      title: `Acceleration along ${letter} over time`,
    });
  };
  buttons.forEach(button =>
    button.addEventListener("click", () => {
      axis = Number(button.dataset.axis);
      drawMotion();
    }),
  );

  return place => {
    [before, after] = place.moments.map(text => (text ? unpack(text) : null));
    const strongest = [0, 1].map(k => {
      const moments = after || before;
      if (!moments) return 0;
      return Math.max(
        ...acceleration(moments.time, moments[k ? "ry" : "rx"])
          .map(Math.abs)
          .filter(Number.isFinite),
        0,
      );
    });
    axis = strongest[1] > strongest[0] ? 1 : 0;

    const series = [],
      any = after || before;
    if (any) {
      const width = Math.max(
        Math.max(...any.rx) - Math.min(...any.rx),
        Math.max(...any.ry) - Math.min(...any.ry),
      );
      const most = Math.max(...(before ? before.contour : [0]), ...(after ? after.contour : [0]));
      const rough = (0.12 * width) / Math.max(most, 1e-6);
      const factor = Math.max(
        1,
        [1, 2, 5]
          .map(f => f * 10 ** Math.floor(Math.log10(rough)))
          .filter(f => f <= rough)
          .pop() || 1,
      );
      series.push({x: any.rx, y: any.ry, colour: "--muted", width: 5, name: "path"});
      if (before) series.push({...magnified(before, factor), colour: "--before", name: "before"});
      if (after) series.push({...magnified(after, factor), colour: "--after", name: "after"});
      document.getElementById("magnified").textContent =
        factor > 1 ? `deviation magnified ${factor} times, mm` : "mm";
    }
    plot(document.getElementById("plane"), {
      series,
      equal: true,
      marks: [{x: 0, y: 0}],
      title: "Path, and nozzle with its deviation magnified, before and after",
    });
    const deviation = [];
    if (before)
      deviation.push({
        name: "before",
        colour: "--before",
        x: milliseconds(before),
        y: before.contour.map(v => 1000 * v),
      });
    if (after)
      deviation.push({
        name: "after",
        colour: "--after",
        x: milliseconds(after),
        y: after.contour.map(v => 1000 * v),
      });
    plot(document.getElementById("deviation-plot"), {
      series: deviation,
      yLabel: "µm",
      xLabel: "ms",
      fromZero: true,
      centre: 0,
      value: micrometres,
      title: "Deviation over time, before and after",
    });
    drawMotion();
  };
};
