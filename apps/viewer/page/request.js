// Composes the requests for pictures from the page's state.

import { exposed, finishOf } from "./finish.js";

// Places of the items that are sent: all but muted ones, and only those on solo if any is.
export function sentPlaces(flags) {
  const solo = flags.some((flag) => flag.solo);
  return flags.flatMap((flag, i) => ((solo ? flag.solo : !flag.mute) ? [i] : []));
}

const darkLamp = { type: "directional", direction: [0, 0, 1], intensity: 0 };

// The lights sent. Without any, the picture is dark: a script without lights is an error.
function sentLights(lights, flags) {
  const sent = sentPlaces(flags).map((i) => lights[i]);
  return sent.length ? sent : [darkLamp];
}

// The script that a picture shows: the doc with what is muted, and what the model cannot do, left out.
export function sentDoc({ doc, flags }, model, camera) {
  const sent = { ...doc, camera };
  if (!model.relights) {
    delete sent.light;
    delete sent.ground;
  } else {
    sent.light = sentLights(doc.light ?? [], flags.light);
  }
  if (!model.deforms) delete sent.warp;
  else if (doc.warp) sent.warp = sentPlaces(flags.warp).map((i) => doc.warp[i]);
  return sent;
}

// A pose as a script's camera, with readable numbers.
export const cameraOfPose = ({ position, look_at, up, fov_deg }) => ({ position, look_at, up, fov_deg });

// The keys of a script's camera that do not place it, such as its blur. A camera that is placed anew keeps them.
const placing = ["from", "file", "orbit", "position", "look_at", "up", "fov_deg"];
export const unplaced = (camera) =>
  Object.fromEntries(Object.entries(camera ?? {}).filter(([key]) => !placing.includes(key)));

// The camera that a picture is seen through; only the shot's own blurs.
export function sentCamera({ doc, view }, pose) {
  if (view.camera.kind === "captured") return exposed({ from: view.camera.name }, { doc });
  return view.camera.kind === "free" || !doc.camera ? exposed(cameraOfPose(pose), { doc }) : doc.camera;
}

// Width over height of the picture; `lens` is the captured camera whose shape it must have, or null.
export function pictureShape({ doc, view }, lens, stage) {
  if (lens) return lens.width / lens.height;
  const size = doc.output?.size;
  return view.shape === "film" && size ? size[0] / size[1] : stage.width / Math.max(stage.height, 1);
}

// Layers that name a photograph, and of these the scores, which are rendered in full only.
const ofPhotograph = ["photograph", "match", "error"];
export const isOfPhotograph = (layer) => ofPhotograph.includes(layer);
export const isScore = (layer) => layer === "match" || layer === "error";

// The key of `view` with the white level of a layer. Photographs and what is shown like them share one of their own.
export function whiteOf(view, layer) {
  const apart = view.compare.kind === "photograph" && !view.compare.match;
  return ofPhotograph.includes(layer) && !apart ? "photographWhite" : "white";
}

// The largest rectangle of a shape on the stage.
export function fitted(shape, stage) {
  const width = Math.min(stage.width, stage.height * shape);
  return { width, height: width / shape };
}

// Size of the requested picture in pixels.
export function pixelSize(shape, stage, scale, side) {
  const { width, height } = fitted(shape, stage);
  const k = Math.min(scale, side / Math.max(width, height));
  return [width, height].map((length) => Math.max(16, Math.min(side, Math.round(length * k))));
}

// What a model can show under a view; photographs and errors need a captured camera.
export function shownLayer(view, model, captured) {
  if (model.method === "capture") return "photograph";
  if (view.show === "photograph" || view.show === "error")
    return captured && model.hasPhotographs ? view.show : "color";
  return view.show === "color" || model.aovs.includes(view.show) ? view.show : "color";
}

// What pane A shows. Beside a photograph: "match", the model at rest under the photograph's light, scored against it.
export function layerOfA(view, model, captured) {
  const show = shownLayer(view, model, captured);
  return show === "color" && captured && view.compare.kind === "photograph" && view.compare.match
    ? "match"
    : show;
}

// Why pane A does not show the scene that a probe, a handle, a snapshot or a film is of; null if it does.
export function whyNoScene(view, model, captured) {
  if (model.method === "capture") return "A capture has no model to render; open a model for this.";
  switch (layerOfA(view, model, captured)) {
    case "photograph":
      return "Pane A shows a photograph: choose colour or another layer in the section View first.";
    case "error":
      return "Pane A shows the error to the photograph: choose colour or another layer in the section View first.";
    case "match":
      return "Pane A is under the photograph's light, at rest: untick that in the section Compare first.";
    default:
      return null;
  }
}

// Text of all that the picture of a photograph depends on; null for requests of other layers.
export function photographKey({ show, doc, frame, light, white, exposure, tone, background, overlay, size }) {
  if (show !== "photograph") return null;
  const moves = typeof (doc.camera?.exposure ?? 0) !== "number"; // the shot's exposure
  return JSON.stringify([
    doc.camera,
    moves ? frame : null,
    light,
    white,
    exposure,
    tone,
    background,
    overlay,
    size,
  ]);
}

// Pane B shows the scene otherwise: { model, options, preset, show }.
function changesOfB(view, models) {
  const { kind, model, options, preset } = view.compare;
  if (kind === "model" && models[model]) return { model };
  if (kind === "options") return { options };
  if (kind === "preset") return { preset };
  if (kind === "photograph") return { show: "photograph" };
  return {};
}

// The chosen options that a model has.
const optionsOf = (model, options) =>
  Object.fromEntries(
    Object.entries(options).filter(([name]) => model.options?.some((row) => row.name === name)),
  );

// The body of a request for a pane's picture. `number` counts requests; `stage` is in device pixels.
export function frameRequest({
  store,
  models,
  captured,
  lens,
  pose,
  stage,
  limits,
  number,
  pane,
  quality,
  scale,
}) {
  const { view } = store;
  const changes = pane === "b" ? changesOfB(view, models) : {};
  const at = changes.model ?? view.model,
    model = models[at],
    preset = changes.preset ?? view.preset;
  const show = changes.show ?? layerOfA(view, model, captured),
    doc = sentDoc(store, model, sentCamera(store, pose));
  const body = {
    number,
    pane,
    model: at,
    doc,
    frame: view.frame,
    size: pixelSize(pictureShape(store, lens, stage), stage, scale, limits.side),
    quality: quality === "full" ? preset : "preview",
    options: optionsOf(model, changes.options ?? view.options),
    show,
    overlay: view.overlay,
    exposure: view.exposure,
    white: view[whiteOf(view, show)],
    tone: finishOf(store, "tone"),
    background: finishOf(store, "background"),
  };
  if (ofPhotograph.includes(show) && view.light) body.light = view.light;
  return body;
}
