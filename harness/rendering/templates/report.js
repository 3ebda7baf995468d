"use strict";
// The moving parts of a report: the copy button, the skeletons, the distribution. Without them the page says the same in tables.

const byId = (id) => document.getElementById(id);

async function inflate(base64) {
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
}

async function loadPlotly() {
  const script = document.createElement("script");
  script.textContent = await inflate(byId("plotly").textContent);
  document.head.append(script);
}

function ink() {
  const style = getComputedStyle(document.documentElement);
  const [text, paper, line] = ["--ink", "--paper", "--line"].map((name) => style.getPropertyValue(name).trim());
  return {
    text,
    base: { paper_bgcolor: paper, plot_bgcolor: paper, font: { color: text, family: "system-ui, sans-serif", size: 13 } },
    axis: { gridcolor: line, zerolinecolor: line, linecolor: line, color: text, showbackground: false },
  };
}

const HOME = { eye: { x: 1.5, y: 1.5, z: 0.8 }, up: { x: 0, y: 0, z: 1 }, center: { x: 0, y: 0, z: -0.05 } };
const CONFIG = { displayModeBar: false, responsive: true, displaylogo: false };

function drawSkeleton(figures) {
  const plot = byId("skeleton");
  const found = figures[byId("skeleton-source").value];
  const wanted = byId("skeleton-magnified");
  for (const panel of document.querySelectorAll("[data-pose]")) panel.hidden = panel.dataset.pose !== byId("skeleton-source").value;
  if (!found) {
    Plotly.purge(plot);
    plot.textContent = "Not drawn, to keep this file small. The table below has the numbers.";
    return;
  }
  if (!plot.layout) plot.textContent = "";
  wanted.disabled = !found.magnified;
  byId("skeleton-factor").textContent = found.magnified ? `differences drawn ${found.factor.toLocaleString("en")} times as large` : "nothing to magnify";
  const traces = structuredClone(found.magnified && wanted.checked ? found.magnified : found.true);
  const { base, axis, text } = ink();
  for (const trace of traces) trace.textfont = { color: trace.line && trace.name.endsWith(" axes") ? trace.line.color : text, size: 12 };
  const title = (letter) => ({ ...axis, title: { text: `${letter} [m]` }, nticks: 5 });
  const camera = plot.layout?.scene?.camera ?? HOME;
  const layout = {
    ...base,
    margin: { l: 0, r: 0, t: 0, b: 0 },
    legend: { orientation: "h", y: 0, yanchor: "top" },
    scene: { xaxis: title("x"), yaxis: title("y"), zaxis: title("z"), aspectmode: "data", camera: structuredClone(camera), dragmode: "orbit" },
    uirevision: "kept",
    annotations: found.magnified && wanted.checked ? [{ text: `<b>differences × ${found.factor.toLocaleString("en")}</b>`, xref: "paper", yref: "paper", x: 0.01, y: 0.99, showarrow: false, xanchor: "left", yanchor: "top", font: { color: text, size: 14 } }] : [],
  };
  return Plotly.react(plot, traces, layout, CONFIG);
}

let pending;

// A drawing in 3D comes out blank on paper: a picture of it is kept there, renewed when it is at rest.
function keepPicture(plot) {
  clearTimeout(pending);
  pending = setTimeout(async () => {
    const picture = byId("skeleton-paper");
    picture.src = await Plotly.toImage(plot, { format: "png", width: 1000, height: 560 }).catch(() => "");
    picture.hidden = !picture.src.startsWith("data:");
    plot.dataset.kept = "yes";
  }, 400);
}

function turn(plot, around, up, closer) {
  const camera = structuredClone(plot.layout.scene.camera);
  const { x, y, z } = camera.eye;
  const radius = Math.hypot(x, y, z) * closer;
  const azimuth = Math.atan2(y, x) + around;
  const elevation = Math.min(1.5, Math.max(-1.5, Math.atan2(z, Math.hypot(x, y)) + up));
  camera.eye = { x: radius * Math.cos(elevation) * Math.cos(azimuth), y: radius * Math.cos(elevation) * Math.sin(azimuth), z: radius * Math.sin(elevation) };
  return Plotly.relayout(plot, { "scene.camera": camera });
}

function drawDistribution(traces) {
  const { base, axis } = ink();
  const along = (title) => ({ ...axis, title: { text: title }, tickprefix: "1e", dtick: 2, automargin: true });
  const count = { ...axis, title: { text: "configurations" }, rangemode: "tozero" };
  const layout = {
    ...base,
    grid: { rows: 2, columns: 1, pattern: "independent", ygap: 0.35 },
    barmode: "group",
    margin: { l: 60, r: 10, t: 10, b: 60 },
    legend: { orientation: "h", y: 1.02, yanchor: "bottom" },
    xaxis: along("position discrepancy [m]"), yaxis: count, xaxis2: along("rotation discrepancy [rad]"), yaxis2: count,
  };
  return Plotly.react(byId("distribution"), traces, layout, CONFIG);
}

function showsWebGL() {
  const canvas = document.createElement("canvas");
  return Boolean(canvas.getContext("webgl2") || canvas.getContext("webgl"));
}

async function figures() {
  const data = JSON.parse(byId("figures").textContent);
  const plot = byId("skeleton");
  const inSpace = plot && showsWebGL(); // asked once: each question opens a context, of which a browser has few
  await loadPlotly();
  const redraw = async () => {
    if (inSpace) {
      await drawSkeleton(data.skeletons);
      if (plot.layout) keepPicture(plot);
    }
    if (byId("distribution")) await drawDistribution(data.distribution);
  };
  await redraw();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  if (inSpace) {
    byId("skeleton-source").addEventListener("change", redraw);
    byId("skeleton-magnified").addEventListener("change", redraw);
    // What turns under the mouse turns by keyboard as well.
    const steps = { left: [-0.2, 0, 1], right: [0.2, 0, 1], up: [0, 0.2, 1], down: [0, -0.2, 1], closer: [0, 0, 0.8], further: [0, 0, 1.25] };
    // A link to a source shows that source.
    const choose = () => {
      const chosen = byId(decodeURIComponent(location.hash.slice(1)))?.dataset.pose;
      if (!chosen) return;
      byId("skeleton-source").value = chosen;
      redraw().then(follow);
    };
    addEventListener("hashchange", choose);
    choose();
    for (const button of document.querySelectorAll("[data-turn]")) button.addEventListener("click", () => turn(plot, ...steps[button.dataset.turn]));
    byId("skeleton-home").addEventListener("click", () => Plotly.relayout(plot, { "scene.camera": structuredClone(HOME) }));
    plot.on?.("plotly_relayout", () => keepPicture(plot));
  } else if (plot) {
    plot.textContent = "This browser shows no 3D (WebGL). The table below has both placements of every frame.";
  }
  document.documentElement.dataset.drawn = "yes";
}

addEventListener("DOMContentLoaded", () => {
  byId("copy").addEventListener("click", () => copyFrom(byId("markdown"), byId("copied")));
  figures().catch((error) => {
    for (const id of ["skeleton", "distribution"]) if (byId(id)) byId(id).textContent = `Not drawn: ${error.message}. The tables say the same.`;
  });
});
