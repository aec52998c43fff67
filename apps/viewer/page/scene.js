// Numbers of the script at the present frame: of the page for literals and keyframes, of the server for expressions.

import { poseOfCaptured, poseOfModel } from "./camera.js";
import { eachTrack, getIn, isKeys, valueAt } from "./tracks.js";
import { isFinite3 } from "./vec.js";

const most = 20000; // values kept

// `value` with a number for every track; `known(text)` is the value of an expression, undefined for other texts.
export function resolved(value, frame, known) {
  if (typeof value === "number" || isKeys(value)) return valueAt(value, frame);
  if (typeof value === "string") return known(value) ?? value;
  if (Array.isArray(value)) return value.map((item) => resolved(item, frame, known));
  if (value && typeof value === "object")
    return Object.fromEntries(
      Object.entries(value).map(([key, item]) => [key, resolved(item, frame, known)]),
    );
  return value;
}

// What the server must be asked for: expressions, and the text of a camera on an orbit; each with its path in doc.
export function askedFor(doc) {
  const texts = new Map();
  eachTrack(doc, (track, path) => {
    if (typeof track === "string") texts.set(track, path);
  });
  if (doc.camera?.orbit) texts.set(JSON.stringify(doc.camera), ["camera"]);
  return texts;
}

export class Scene {
  constructor(store, server, model) {
    this.store = store;
    this.server = server;
    this.model = model; // function
    this.frames = ""; // the film's frames that values are of
    this.known = new Map(); // frame and text to value; an edit elsewhere leaves it valid
    this.latest = new Map(); // text to its newest value, shown until that of the present frame comes
    this.now = null;
    this.nowKey = "";
    this.asked = { version: -1, texts: new Map() };
  }

  texts() {
    const { doc, version } = this.store;
    if (this.asked.version !== version) this.asked = { version, texts: askedFor(doc) };
    return this.asked.texts;
  }

  // Asks for the values of expressions at the present frame, unless they are known; true if there are new ones.
  async prepare() {
    const {
        doc,
        view: { frame },
      } = this.store,
      texts = this.texts(),
      frames = JSON.stringify(doc.frames ?? null);
    if (frames !== this.frames || this.known.size > most) this.known.clear();
    this.frames = frames;
    if ([...texts.keys()].every((text) => this.known.has(`${frame} ${text}`))) return false;
    const values = await this.server.post("/values", { doc, frame });
    for (const [text, path] of texts) {
      const value = getIn(values, path);
      this.known.set(`${frame} ${text}`, value);
      this.latest.set(text, value);
    }
    this.nowKey = "";
    return true;
  }

  valueOf(text) {
    const { known, latest, store } = this,
      key = `${store.view.frame} ${text}`;
    return known.has(key) ? known.get(key) : latest.get(text);
  }

  // { camera, light, warp } in numbers.
  values() {
    const { doc, version, view } = this.store,
      key = `${version} ${view.frame}`;
    if (key === this.nowKey) return this.now;
    const known = (text) => {
      const value = this.valueOf(text);
      return typeof value === "number" ? value : undefined;
    };
    this.now = {
      camera: resolved(doc.camera ?? {}, view.frame, known),
      light: resolved(doc.light ?? [], view.frame, known),
      warp: resolved(doc.warp ?? [], view.frame, known),
    };
    this.nowKey = key;
    return this.now;
  }

  // The pose of the script's camera at the present frame.
  shotPose() {
    const { camera } = this.values(),
      model = this.model();
    if (camera.from) {
      const captured = model.cameras.find((c) => c.name === camera.from);
      if (captured) return poseOfCaptured(captured, model);
    }
    const pose = { up: [0, 1, 0], fov_deg: 30, ...camera };
    const served = this.store.doc.camera?.orbit ? this.valueOf(JSON.stringify(this.store.doc.camera)) : pose;
    return isFinite3(served?.position) &&
      isFinite3(served.look_at) &&
      isFinite3(served.up) &&
      Number.isFinite(served.fov_deg)
      ? served
      : poseOfModel(model);
  }

  captured() {
    const { camera } = this.store.view;
    return camera.kind === "captured"
      ? (this.model().cameras.find((c) => c.name === camera.name) ?? null)
      : null;
  }

  // The captured camera whose lens, and so whose shape, the picture has: chosen in the view or named by the shot.
  lens() {
    const { doc, view } = this.store,
      from = view.camera.kind === "shot" ? doc.camera?.from : undefined;
    return from === undefined ? this.captured() : (this.model().cameras.find((c) => c.name === from) ?? null);
  }

  // The pose that the picture is seen from.
  pose() {
    const { camera } = this.store.view,
      captured = this.captured();
    if (captured) return poseOfCaptured(captured, this.model());
    return camera.kind === "free" ? camera.pose : this.shotPose();
  }
}
