// The section "View": layer, exposure, tone, background and the histogram.

import { nearestCaptured } from "./camera.js";
import { byId, checkBox, fillSelect } from "./dom.js";
import { finishOf, isScripted, mostStops, setFinish, whyFixed } from "./finish.js";
import { sentPlaces, shownLayer } from "./request.js";
import { drawHistogram, histogramOf, smallPixels } from "./histogram.js";

const layerNames = { color: "colour", photograph: "photograph", error: "error to the photograph" };
const hex = (rgb) =>
  "#" +
  rgb
    .map((c) =>
      Math.round(255 * c)
        .toString(16)
        .padStart(2, "0"),
    )
    .join("");
const channelColors = ["#e5484d", "#30a46c", "#3b82f6"];

// Photographs of a captured camera, as [light's name, text]; the name is "" where the light was fixed.
export function photographsOf(model, camera) {
  const at = model.cameras.indexOf(camera);
  return (model.photographs ?? [])
    .filter(([c]) => c === at)
    .map(([, light, heldOut]) => {
      const name = light < 0 ? "" : model.lights[light].name;
      return [name, (name || "fixed light") + (heldOut ? " (held out)" : "")];
    });
}

export class ViewPanel {
  constructor(app) {
    this.app = app;
    const { store } = app,
      set = (id, type, change) =>
        byId(id).addEventListener(type, (event) => store.setView(change(event.target), event.timeStamp));
    byId("show").addEventListener("change", (event) => this.show(event.target.value));
    set("photograph-light", "change", (node) => ({ light: node.value }));
    const finish = (id, type, read) =>
      byId(id).addEventListener(type, (event) => setFinish(store, id, read(event.target), event.timeStamp));
    finish("exposure", "input", (node) => node.valueAsNumber);
    finish("tone", "change", (node) => node.value);
    finish("background", "input", (node) =>
      [1, 3, 5].map((i) => Number((parseInt(node.value.slice(i, i + 2), 16) / 255).toFixed(4))),
    );
    for (const id of ["exposure", "background"])
      byId(id).addEventListener("change", () => store.endGesture());
    byId("exposure").addEventListener("dblclick", () => setFinish(store, "exposure", 0));
    byId("auto-white").addEventListener("click", () => store.setView({ white: null, photographWhite: null }));
    this.overlay = checkBox("outline of the mesh", false, (on) => store.setView({ overlay: on }), {
      id: "overlay",
    });
    byId("overlay-row").append(this.overlay.node);
    this.log = checkBox("log", false, () => this.drawHistogram(), { id: "histogram-log" });
    byId("histogram-log-row").append(this.log.node);
    this.histogram = null;
    this.drawnAt = -Infinity;
    this.advised = ""; // "white" or "dark", what was told of the picture
    this.advice = ""; // in words
  }

  // Photographs and errors need a captured camera: the nearest one is taken.
  show(layer) {
    const { store, scene } = this.app;
    const changes = { show: layer };
    if ((layer === "photograph" || layer === "error") && !scene.captured()) {
      const nearest = nearestCaptured(scene.pose(), this.app.model());
      if (nearest) changes.camera = { kind: "captured", name: nearest.name };
    }
    store.setView(changes, undefined, changes.camera ? "camera" : "view");
  }

  // The light is one that the camera has a photograph of.
  keepLight() {
    const { store, scene } = this.app,
      captured = scene.captured();
    if (!captured) return;
    const lights = photographsOf(this.app.model(), captured).map(([name]) => name);
    if (lights.length && !lights.includes(store.view.light)) store.view.light = lights[0];
  }

  update(bitmap, { background, show }, still) {
    const now = performance.now(),
      isOpen = byId("section-view").open;
    if (!still && (!isOpen || now - this.drawnAt < 100)) return;
    this.drawnAt = now;
    this.histogram = histogramOf(smallPixels(bitmap), background);
    if (isOpen) this.drawHistogram();
    if (still) this.advise(show);
  }

  // Says once, when a picture becomes too bright or too dark, what helps.
  advise(show) {
    const { n, high, low, light } = this.histogram,
      { flags } = this.app.store,
      exposure = finishOf(this.app.store, "exposure");
    const isUnlit = low === 1 || (this.app.model().relights && !sentPlaces(flags.light).length);
    const isOff = show !== "color" || n < 100 || isUnlit;
    const found = isOff ? "" : high > 0.2 ? "white" : light < 0.001 ? "dark" : "";
    if (found === this.advised) return;
    if (this.advice && this.app.status.message === this.advice) this.app.say("");
    if (!found) this.advised = "";
    if (!found || !this.app.status.isFree()) return;
    this.advised = found;
    const means = isScripted(this.app.store, "exposure")
      ? "the script's exposure"
      : (found === "white" ? exposure > 0 : exposure < 0)
        ? "exposure 0 or Auto white"
        : "Auto white";
    this.advice = `${found === "white" ? "Much of the picture is white" : "The picture is dark"}: ${means} adapts it.`;
    this.app.say(this.advice);
  }

  drawHistogram() {
    if (!this.histogram) return;
    drawHistogram(byId("histogram"), this.histogram, this.log.box.checked, channelColors);
    const share = (x) => (x > 0 && x < 0.001 ? "under 0.1" : (100 * x).toFixed(1));
    byId("clipped").textContent =
      `white ${share(this.histogram.high)} %, black ${share(this.histogram.low)} %`;
  }

  refresh() {
    const { store, scene } = this.app,
      { view } = store,
      model = this.app.model(),
      captured = scene.captured();
    const photographs = model.method === "capture" || model.hasPhotographs;
    const layers =
      model.method === "capture"
        ? ["photograph"]
        : ["color", ...model.aovs, ...(photographs && model.cameras.length ? ["photograph", "error"] : [])];
    fillSelect(
      byId("show"),
      layers.map((name) => [name, layerNames[name] ?? name.replaceAll("_", " ")]),
      layers.includes(view.show) ? view.show : layers[0],
    );
    const lights = captured ? photographsOf(model, captured) : [];
    byId("light-row").hidden =
      !lights.length || !["photograph", "error"].includes(shownLayer(view, model, captured));
    fillSelect(byId("photograph-light"), lights, view.light ?? "");
    byId("overlay-row").hidden = model.method !== "capture";
    this.overlay.box.checked = view.overlay;
    const exposure = finishOf(store, "exposure");
    byId("exposure").min = -mostStops(store);
    byId("exposure").max = mostStops(store);
    byId("exposure").value = exposure;
    byId("exposure-value").textContent = `${exposure > 0 ? "+" : ""}${exposure.toFixed(1)}`;
    byId("tone").value = finishOf(store, "tone");
    byId("background").value = hex(finishOf(store, "background"));
    for (const key of ["exposure", "tone", "background"]) {
      const why = whyFixed(store, key);
      byId(key).disabled = why !== "";
      byId(key).title = why || (isScripted(store, key) ? "Of the script" : "");
    }
    byId("auto-white").disabled = isScripted(store, "exposure");
  }
}
