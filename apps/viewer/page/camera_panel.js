// The section "Camera": what the picture is seen from, captured cameras, and the shot's camera.

import { nearestCaptured, poseOfModel } from "./camera.js";
import { byId, fillSelect, setPressed } from "./dom.js";
import { fieldsOf } from "./field.js";
import { cameraOfPose, unplaced } from "./request.js";
import { cameraFields, orbitFields, orbitOuterFields } from "./schema.js";
import { isKeys, withKey } from "./tracks.js";
import { tidy, tidy3 } from "./vec.js";

const tidyPose = (pose) => ({
  position: tidy3(pose.position),
  look_at: tidy3(pose.look_at),
  up: tidy3(pose.up),
  fov_deg: tidy(pose.fov_deg),
});

export class CameraPanel {
  constructor(app) {
    this.app = app;
    this.built = "";
    byId("camera-free").addEventListener("click", () => this.free(app.scene.pose()));
    byId("camera-shot").addEventListener("click", () => this.shot());
    byId("camera-captured").addEventListener("click", () =>
      this.snap(nearestCaptured(app.scene.pose(), app.model())?.name),
    );
    byId("captured-camera").addEventListener("change", (event) => this.snap(event.target.value));
    byId("previous-camera").addEventListener("click", () => this.step(-1));
    byId("next-camera").addEventListener("click", () => this.step(1));
    byId("camera-home").addEventListener("click", () => this.home());
    byId("camera-set").addEventListener("click", () => this.setShot());
    byId("camera-key").addEventListener("click", () => this.keyShot());
    byId("picture-shape").addEventListener("change", (event) =>
      app.store.setView({ shape: event.target.value }, event.timeStamp),
    );
    const fov = byId("fov");
    fov.addEventListener("input", (event) =>
      this.free({ ...app.scene.pose(), fov_deg: fov.valueAsNumber }, event.timeStamp),
    );
  }

  free(pose, stamp) {
    if (this.app.model().method === "capture") return;
    this.app.store.setView(
      { ...this.ownLayer(), camera: { kind: "free", pose: cameraOfPose(pose) } },
      stamp,
      "camera",
    );
  }

  // Photographs are seen from captured cameras only; elsewhere, the picture shows its own colour.
  ownLayer() {
    return ["photograph", "error"].includes(this.app.store.view.show) ? { show: "color" } : {};
  }

  shot() {
    if (!this.app.store.doc.camera)
      return this.app.say("The script has no camera yet; set the present view as the shot's camera.");
    this.app.store.setView({ ...this.ownLayer(), camera: { kind: "shot" } }, undefined, "camera");
  }

  snap(name, stamp) {
    if (name) this.app.store.setView({ camera: { kind: "captured", name } }, stamp, "camera");
  }

  // The next or previous captured camera.
  step(by) {
    const { cameras } = this.app.model(),
      captured = this.app.scene.captured();
    if (!cameras.length) return;
    if (!captured) return this.snap(nearestCaptured(this.app.scene.pose(), this.app.model()).name);
    const n = cameras.length;
    this.snap(cameras[(cameras.indexOf(captured) + by + n) % n].name);
  }

  home() {
    this.free(poseOfModel(this.app.model()));
  }

  // Whether a script can name a captured camera: its model holds it, so that it is not held out, and the film has the
  // shape of its pictures up to a pixel, as the server demands.
  canName({ name, width, height }) {
    const { models, store } = this.app,
      [filmWidth, filmHeight] = store.doc.output?.size ?? [width, height];
    return (
      models[0].cameras.some((c) => c.name === name) &&
      !models.some((model) => model.cameras.some((c) => c.name === name && c.heldOut)) &&
      Math.abs(filmWidth * height - filmHeight * width) <= Math.max(filmWidth, width)
    );
  }

  // Makes the present view the shot's camera, for all frames: a captured camera by its name or else by its pose.
  setShot() {
    const { store, scene } = this.app,
      captured = scene.captured();
    const isNamed = captured !== null && this.canName(captured);
    const camera = isNamed ? { from: captured.name } : tidyPose(scene.pose());
    store.edit((doc) => {
      doc.camera = { ...camera, ...unplaced(doc.camera) };
    });
    store.setView({ camera: { kind: "shot" } }, undefined, "camera");
    this.app.say(
      captured && !isNamed
        ? `The shot's camera takes the pose of ${captured.name}, as the script cannot name that camera.`
        : "The shot's camera stands here in all frames now.",
    );
  }

  // Makes the present view the shot's camera at the present frame.
  keyShot() {
    const { store, scene } = this.app,
      pose = tidyPose(scene.pose()),
      { frame } = store.view;
    const old = store.doc.camera ?? {};
    const replaces =
      old.orbit || old.from || JSON.stringify(old).match(/"(position|look_at|up|fov_deg)":(\[[^\]]*)?"/);
    store.edit((doc) => {
      const keyed = (track, value) => withKey(isKeys(track) ? track : undefined, frame, value);
      const was = replaces ? {} : old;
      const camera = {
        position: pose.position.map((x, i) => keyed(was.position?.[i], x)),
        look_at: pose.look_at.map((x, i) => keyed(was.look_at?.[i], x)),
        up: was.up?.some?.(isKeys) ? pose.up.map((x, i) => keyed(was.up[i], x)) : pose.up,
        fov_deg: keyed(was.fov_deg, pose.fov_deg),
        ...unplaced(old),
      };
      doc.camera = camera;
    });
    store.setView({ camera: { kind: "shot" } }, undefined, "camera");
    this.app.say(
      replaces
        ? `The shot's old camera is replaced by a key at frame ${frame}; Undo brings it back.`
        : `The shot's camera has a key at frame ${frame}.`,
    );
  }

  refresh() {
    const { store, scene } = this.app,
      model = this.app.model(),
      { kind } = store.view.camera;
    const captureOnly = model.method === "capture",
      pose = scene.pose();
    for (const name of ["free", "shot", "captured"]) setPressed(byId(`camera-${name}`), kind === name);
    for (const id of ["camera-free", "camera-shot", "camera-home", "camera-set", "camera-key"])
      byId(id).disabled = captureOnly;
    for (const id of ["camera-captured", "captured-camera", "previous-camera", "next-camera"])
      byId(id).disabled = !model.cameras.length;
    fillSelect(
      byId("captured-camera"),
      [["", "none"], ...model.cameras.map((c) => [c.name, c.heldOut ? `${c.name} (held out)` : c.name])],
      kind === "captured" ? store.view.camera.name : "",
    );
    const fov = byId("fov");
    fov.value = pose.fov_deg;
    fov.disabled = captureOnly;
    byId("fov-value").textContent = `${tidy(pose.fov_deg, 3)}°`;
    byId("picture-shape").disabled = scene.lens() !== null || !store.doc.output?.size;
    byId("picture-shape").value = store.view.shape;
    this.refreshShot();
  }

  refreshShot() {
    const { camera } = this.app.store.doc,
      host = byId("shot-camera");
    const form = !camera
      ? "none"
      : camera.from !== undefined
        ? `from ${camera.from}`
        : camera.orbit
          ? "orbit"
          : "placed";
    if (form !== this.built) {
      this.built = form;
      this.fields =
        form === "orbit"
          ? [
              fieldsOf(this.app, ["camera", "orbit"], orbitFields, "Shot's camera"),
              fieldsOf(this.app, ["camera"], orbitOuterFields, "Shot's camera"),
            ]
          : form === "placed"
            ? [fieldsOf(this.app, ["camera"], cameraFields, "Shot's camera")]
            : [];
      host.replaceChildren(...this.fields.flatMap((f) => f.nodes));
      if (!this.fields.length)
        host.textContent = camera ? `The captured camera ${camera.from}.` : "The script has no camera.";
    }
    for (const fields of this.fields) fields.refresh();
  }
}
