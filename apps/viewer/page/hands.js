// Lamps and handles on the picture: their markers, and what dragging, scaling and deleting these does to the script.

import { borderPlace, isFree } from "./border.js";
import { onPlaneThrough, project } from "./camera.js";
import { byId } from "./dom.js";
import { atDistance, colorOf, draggedOnSphere, hexOfLinear, inkOn, markerPlace, movedTo, turned } from "./lamps.js";
import { lampName } from "./lamps_panel.js";
import { Markers } from "./markers.js";
import { isOfPhotograph, layerOfA } from "./request.js";
import { getIn, kindOf, setIn, withValue } from "./tracks.js";
import { isFinite3, tidy } from "./vec.js";

const controls = ["modes", "rig-box", "name-a", "name-b"]; // on the picture
const farthest = 1.5; // from the picture's middle, in its sides: places up to there follow the pointer exactly

export class Hands {
  constructor(app) {
    this.app = app;
    this.boxes = []; // of the controls, in pixels of the picture
    this.markers = new Markers(
      {
        drag: (...args) => this.drag(...args),
        scale: (...args) => this.scale(...args),
        remove: (marker) => this.remove(marker),
        select: (marker) => this.select(marker),
        ended: () => app.store.endGesture(),
      },
      (event) => app.stage.place(event),
    );
  }

  // Finds out where controls lie over the picture.
  measure() {
    const { left, top } = this.markers.layer.getBoundingClientRect();
    this.boxes = controls.flatMap((id) => {
      const box = byId(id).getBoundingClientRect();
      if (!box.width) return [];
      return [
        { left: box.left - left, top: box.top - top, right: box.right - left, bottom: box.bottom - top },
      ];
    });
  }

  // Whether pane A shows the scene with its lamps, rather than a photograph or what is like it.
  showsScene() {
    const { store, scene } = this.app;
    return !isOfPhotograph(layerOfA(store.view, this.app.model(), scene.captured()));
  }

  show() {
    const { app } = this,
      model = app.model(),
      values = app.scene.values();
    if (!this.showsScene()) return this.markers.show([]);
    const shown = [];
    if (model.relights) values.light.forEach((lamp, index) => shown.push(this.lampMarker(lamp, index)));
    if (model.deforms)
      values.warp.forEach((warp, index) => {
        if (warp.type !== "handles" || app.store.flags.warp[index]?.mute) return;
        (warp.handle ?? []).forEach((handle, i) => shown.push(this.handleMarker(handle, index, i)));
      });
    this.markers.show(this.placed(shown.filter((marker) => marker !== null)));
  }

  // Puts markers of places outside of the picture along its border.
  placed(markers) {
    const { clientWidth: width, clientHeight: height } = this.markers.layer,
      inPixels = ({ x, y }) => ({ x: x * width, y: y * height }),
      taken = markers.filter((marker) => !marker.out).map(inPixels);
    for (const marker of markers) {
      if (!marker.out) continue;
      const dx = (marker.x - 0.5) * width,
        dy = (marker.y - 0.5) * height,
        place = borderPlace(dx, dy, width, height, this.boxes, taken);
      taken.push(place);
      Object.assign(marker, { x: place.x / width, y: place.y / height, direction: Math.atan2(dy, dx) });
    }
    return markers;
  }

  // Whether a new marker at a place would be well inside of the picture, clear of the controls and of other markers.
  isFree(place) {
    const { x, y, depth } = this.seen(place),
      { clientWidth: width, clientHeight: height } = this.markers.layer,
      taken = [...this.markers.nodes.values()].map(({ marker }) => ({ x: marker.x * width, y: marker.y * height })),
      isInside = (part) => part > 0.06 && part < 0.94;
    return depth > 0 && isInside(x) && isInside(y) && isFree(x * width, y * height, this.boxes, taken);
  }

  // Where a place is on the picture; `out` if it is not.
  seen(place) {
    const { x, y, depth } = project(this.app.scene.pose(), this.app.stage.aspect(), place);
    return { x, y, depth, out: !(depth > 0 && x >= 0 && x <= 1 && y >= 0 && y <= 1) };
  }

  lampMarker(lamp, index) {
    const { app } = this,
      place = markerPlace(lamp, app.model());
    if (!isFinite3(place)) return null;
    const color = colorOf(lamp),
      name = lampName(lamp, index),
      seen = this.seen(place),
      where = seen.depth > 0 ? "outside of the picture, this way" : "behind the camera";
    return {
      key: `lamp-${index}`,
      kind: "lamp",
      index,
      place,
      ...seen,
      off: !app.isLit(index),
      chosen: index === app.selectedLamp,
      color: hexOfLinear(color),
      ink: inkOn(color),
      text: String(index + 1),
      name,
      title: `${name}${seen.out ? `: ${where}. Drag to move it` : ""}`,
    };
  }

  handleMarker(handle, index, i) {
    if (!isFinite3(handle.to)) return null;
    const seen = this.seen(handle.to);
    if (seen.out) return null;
    return {
      key: `handle-${index}-${i}`,
      kind: "handle",
      index,
      handle: i,
      place: handle.to,
      ...seen,
      name: `Warp ${index + 1}, handle ${i + 1}`,
    };
  }

  select(marker) {
    if (marker.kind === "lamp") this.choose(marker.index);
  }

  // Highlights a lamp on picture, rig and panel, where it is opened if so wanted.
  choose(index, opens = true) {
    const { app } = this;
    if (app.selectedLamp === index) return;
    app.selectedLamp = index;
    if (opens) app.lamps.reveal(index, false);
    app.rig.draw();
    this.show();
  }

  // The disc keeps its distance from the pointer. Lamps far outside of the picture turn about the object instead.
  drag(marker, { from, to, grip }, event) {
    const { app } = this,
      model = app.model(),
      pose = app.scene.pose(),
      aspect = app.stage.aspect();
    if (!grip.offset) {
      const { x, y, depth } = this.seen(marker.place);
      if (depth > 0 && Math.max(Math.abs(x - 0.5), Math.abs(y - 0.5)) <= farthest)
        grip.offset = { x: from.x - x, y: from.y - y };
    }
    const x = to.x - (grip.offset?.x ?? 0),
      y = to.y - (grip.offset?.y ?? 0);
    if (marker.kind === "handle")
      return this.moveHandle(marker, onPlaneThrough(pose, aspect, x, y, marker.place), event.timeStamp);
    const angle = (before, after) => (after - before) * Math.PI;
    const place = grip.offset
      ? draggedOnSphere(marker.place, model, pose, aspect, x, y)
      : turned(marker.place, model, pose, angle(from.x, to.x) * aspect, angle(from.y, to.y));
    this.moveLamp(marker.index, place, event.timeStamp);
  }

  // Writes a vector at the present frame into tracks; formulas give way to numbers.
  putVector(path, value, options) {
    const { store } = this.app,
      tracks = getIn(store.doc, path) ?? [0, 0, 0];
    if (tracks.some((track) => kindOf(track) === "expression"))
      this.app.say("A formula gave way to a number; Undo brings it back.");
    const moved = tracks.map((track, i) => withValue(track, store.view.frame, tidy(value[i])));
    store.edit((doc) => setIn(doc, path, moved), options);
    this.show();
  }

  moveLamp(index, place, stamp) {
    const { key, value } = movedTo(this.app.scene.values().light[index], this.app.model(), place);
    this.putVector(["light", index, key], value, { gesture: `lamp-${index}`, stamp });
  }

  moveHandle({ index, handle, key }, place, stamp) {
    this.putVector(["warp", index, "handle", handle, "to"], place, { gesture: key, stamp });
  }

  // Changes the distance of a lamp from the middle, or of a handle from the camera.
  scale(marker, factor, event) {
    const { app } = this;
    if (marker.kind === "handle") {
      const fromCamera = { middle: app.scene.pose().position };
      return this.moveHandle(marker, atDistance(marker.place, fromCamera, factor), event.timeStamp);
    }
    if (app.store.doc.light[marker.index].type === "directional")
      return app.say("A directional lamp has no distance.");
    this.moveLamp(marker.index, atDistance(marker.place, app.model(), factor), event.timeStamp);
  }

  remove({ kind, index, handle }) {
    if (kind === "lamp") this.app.lamps.remove(index);
    else this.app.warps.removeHandle(index, handle);
    this.app.stage.canvas.focus();
  }
}
