// The sections "Lamps" and "Environment".

import { byId, fillSelect } from "./dom.js";
import { fieldsOf } from "./field.js";
import { Items } from "./items.js";
import { colorOf, directionsOfNew, hexOfLinear, lampOfCaptured, markerPlace, usualStrength } from "./lamps.js";
import { lightFields } from "./schema.js";
import { add, length, scale, sub, tidy, tidy3 } from "./vec.js";

export const lampName = (lamp, index) => `Lamp ${index + 1}, ${lamp.type}`;

export class LampsPanel {
  constructor(app) {
    this.app = app;
    const shared = {
      part: "light",
      solo: true,
      removed: (index) => this.removed(index),
      chosen: (index) => index === app.selectedLamp,
      choose: (index) => app.hands.choose(index, false),
      swatch: (index) => hexOfLinear(colorOf(app.scene.values().light[index])),
      body: (lamp, index) =>
        fieldsOf(app, ["light", index], lightFields[lamp.type] ?? [], `Lamp ${index + 1}`),
    };
    this.lamps = new Items(app, byId("lamp-list"), {
      ...shared,
      keep: (lamp) => lamp.type !== "environment",
      name: lampName,
    });
    this.maps = new Items(app, byId("environment-list"), {
      ...shared,
      keep: (lamp) => lamp.type === "environment",
      name: (lamp) =>
        app.start.environments.find((e) => e.image === lamp.image)?.name ?? lamp.image.replace(/^.*\//, ""),
    });
    byId("add-point").addEventListener("click", () => this.add(this.newLamp("point")));
    byId("add-directional").addEventListener("click", () => this.add(this.newLamp("directional")));
    byId("add-captured").addEventListener("change", (event) => {
      const light = app.model().lights.find((l) => l.name === event.target.value);
      event.target.value = "";
      if (light) this.add(lampOfCaptured(light));
    });
    byId("add-environment").addEventListener("change", (event) => {
      const { value } = event.target;
      event.target.value = "";
      if (value)
        this.add({
          type: "environment",
          image: value,
          up: tidy3(app.model().up),
          rotate_deg: 0,
          intensity: 1,
        });
    });
  }

  // A lamp on the camera's side of the object, whose disc is free to be grabbed on the picture.
  newLamp(type) {
    const { hands, scene } = this.app,
      model = this.app.model(),
      pose = scene.pose(),
      fromCamera = length(sub(pose.position, model.middle)),
      distance = Math.min(2.5 * model.radius, 0.7 * fromCamera || Infinity);
    const lampAlong = (direction) =>
      type === "point"
        ? { type, position: tidy3(add(model.middle, scale(direction, distance))) }
        : { type, direction: tidy3(direction) };
    const lamps = directionsOfNew(model, pose).map(lampAlong);
    return {
      ...(lamps.find((lamp) => hands.isFree(markerPlace(lamp, model))) ?? lamps[0]),
      color: [1, 1, 1],
      intensity: tidy(usualStrength(type, model, distance), 3),
    };
  }

  add(lamp) {
    const { store, limits } = this.app;
    if ((store.doc.light?.length ?? 0) >= limits.lights)
      return this.app.say(`A viewer's script has at most ${limits.lights} lights.`);
    store.edit((doc) => (doc.light ??= []).push(lamp));
    this.app.selectedLamp = store.doc.light.length - 1;
    this.reveal(this.app.selectedLamp);
    this.app.hands.show();
  }

  listOf(index) {
    return this.app.store.doc.light[index]?.type === "environment" ? this.maps : this.lamps;
  }
  reveal(index, focus) {
    this.listOf(index).reveal(index, focus);
  }
  remove(index) {
    this.listOf(index).remove(index);
  }

  // The selected lamp stays selected, under its new number, when another one is deleted.
  removed(index) {
    const { app } = this;
    if (app.selectedLamp === index) app.selectedLamp = -1;
    else if (app.selectedLamp > index) --app.selectedLamp;
  }

  refresh() {
    const model = this.app.model(),
      { environments } = this.app.start;
    for (const id of ["lamps", "environment"]) {
      byId(`${id}-controls`).disabled = !model.relights;
      byId(`${id}-why`).textContent = model.relights ? "" : `This model cannot be relit: ${model.why}.`;
    }
    fillSelect(
      byId("add-captured"),
      [["", "At a captured light…"], ...model.lights.map((l) => [l.name, l.name])],
      "",
    );
    fillSelect(
      byId("add-environment"),
      [
        ["", environments.length ? "Add an environment…" : "No environments"],
        ...environments.map((e) => [e.image, e.name]),
      ],
      "",
    );
    this.lamps.refresh();
    this.maps.refresh();
  }
}
