// Lamps and handles on the picture: their markers, and what dragging, scaling and deleting these does to the script.

import { onPlaneThrough, project } from "./camera.js";
import {
  atDistance,
  colorOf,
  draggedOnSphere,
  hexOfLinear,
  markerPlace,
  movedTo,
  shownAt,
  turned,
} from "./lamps.js";
import { lampName } from "./lamps_panel.js";
import { Markers } from "./markers.js";
import { getIn, kindOf, setIn, withValue } from "./tracks.js";
import { isFinite3, tidy } from "./vec.js";

export class Hands {
  constructor(app) {
    this.app = app;
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

  show() {
    const { app } = this,
      model = app.model(),
      values = app.scene.values();
    const shown = [];
    if (model.relights) values.light.forEach((lamp, index) => shown.push(this.lampMarker(lamp, index)));
    if (model.deforms)
      values.warp.forEach((warp, index) => {
        if (warp.type !== "handles" || app.store.flags.warp[index]?.mute) return;
        (warp.handle ?? []).forEach((handle, i) => shown.push(this.handleMarker(handle, index, i)));
      });
    this.markers.show(shown.filter((marker) => marker !== null));
  }

  lampMarker(lamp, index) {
    const { app } = this,
      place = markerPlace(lamp, app.model());
    if (!isFinite3(place)) return null;
    return {
      key: `lamp-${index}`,
      kind: "lamp",
      index,
      place,
      ...shownAt(place, app.scene.pose(), app.stage.aspect()),
      off: !app.isLit(index),
      color: hexOfLinear(colorOf(lamp)),
      name: lampName(lamp, index),
    };
  }

  handleMarker(handle, index, i) {
    if (!isFinite3(handle.to)) return null;
    const p = project(this.app.scene.pose(), this.app.stage.aspect(), handle.to);
    if (p.depth <= 0 || p.x < 0 || p.x > 1 || p.y < 0 || p.y > 1) return null;
    const name = `Warp ${index + 1}, handle ${i + 1}`;
    return {
      key: `handle-${index}-${i}`,
      kind: "handle",
      index,
      handle: i,
      place: handle.to,
      x: p.x,
      y: p.y,
      name,
    };
  }

  select(marker) {
    const { app } = this;
    if (marker.kind !== "lamp" || app.selectedLamp === marker.index) return;
    app.selectedLamp = marker.index;
    app.lamps.reveal(marker.index, false);
    app.rig.draw();
  }

  drag(marker, x, y, dx, dy, event) {
    const { app } = this,
      model = app.model(),
      pose = app.scene.pose(),
      aspect = app.stage.aspect();
    if (marker.kind === "handle")
      return this.moveHandle(marker, onPlaneThrough(pose, aspect, x, y, marker.place), event.timeStamp);
    const place =
      (marker.out ? null : draggedOnSphere(marker.place, model, pose, aspect, x, y)) ??
      turned(marker.place, model, pose, dx * Math.PI, dy * Math.PI);
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
