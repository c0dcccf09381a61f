"use strict";
(() => {
  const PRINTED_PX = 660; // inside the cards of an A4 page with its margins
  const PRINTED_HEIGHT = 0.78; // two plots on a page
  const NARROW_PX = 640;
  const plots = [...document.querySelectorAll(".plot")];
  const font = { family: "system-ui, -apple-system, 'Segoe UI', Roboto, Arial, sans-serif", size: 12, color: "#1f2937" };
  const axes = (layout) => Object.keys(layout).filter((key) => /^[xy]axis\d*$/.test(key));

  function styled(spec, width) {
    const narrow = width < NARROW_PX;
    const layout = structuredClone(spec.layout);
    for (const key of axes(layout)) {
      const horizontal = key[0] === "x";
      layout[key] = {
        gridcolor: "#e6e9ee", zeroline: false, linecolor: "#9aa3af", showline: true, ticks: "outside", ticklen: 4,
        automargin: true, fixedrange: !horizontal, ...layout[key],
      };
      layout[key].title = { standoff: horizontal ? 8 : 6, ...layout[key].title };
      if (horizontal && narrow) layout[key].nticks = 5;
    }
    return {
      font, paper_bgcolor: "#fff", plot_bgcolor: "#fff", hovermode: "closest", dragmode: narrow ? false : "zoom",
      margin: { l: narrow ? 48 : 62, r: narrow ? 8 : 16, t: narrow ? 8 : 44, b: 44 },
      legend: { orientation: "h", x: 0, y: 1, yanchor: "bottom", font: { size: 12 } },
      ...layout,
    };
  }

  function lean(data, width) {
    if (width >= NARROW_PX) return data;
    return data.map((trace) => trace.colorbar
      ? { ...trace, colorbar: { ...trace.colorbar, thickness: 8, title: undefined, tickfont: { size: 10 } } } : trace);
  }

  let printing = false;
  const specs = new Map();
  function draw(plot, width) {
    if (!specs.has(plot)) specs.set(plot, JSON.parse(document.getElementById(plot.id + "-data").textContent));
    const spec = specs.get(plot);
    // On a narrow page every entry of the legend takes a row of its own.
    const entries = spec.data.filter((trace) => trace.type !== "heatmap" && trace.showlegend !== false).length;
    const rows = width < NARROW_PX && spec.layout.showlegend !== false && entries > 1 ? entries : 0;
    const height = Number(plot.dataset.height) * (printing ? PRINTED_HEIGHT : 1) + 19 * rows;
    plot.style.height = height + "px";
    const layout = { ...styled(spec, width), width, height };
    const config = { displaylogo: false, displayModeBar: width >= NARROW_PX ? "hover" : false,
      modeBarButtons: [["toImage", "zoom2d", "pan2d", "resetScale2d"]] };
    return Plotly.react(plot, lean(spec.data, width), layout, config);
  }

  const drawAll = (width) => Promise.all(plots.map((plot) => draw(plot, width ?? plot.clientWidth)));
  let last = window.innerWidth;
  let waiting = 0;
  window.addEventListener("resize", () => {
    if (printing || window.innerWidth === last) return;
    last = window.innerWidth;
    clearTimeout(waiting);
    waiting = setTimeout(() => drawAll(), 120);
  });
  window.addEventListener("beforeprint", () => { printing = true; drawAll(PRINTED_PX); });
  window.addEventListener("afterprint", () => { printing = false; drawAll(); });
  window.gearsimReport = { specs, ready: drawAll().then(() => { document.body.dataset.ready = "yes"; }) };
})();
