// The section "Warps", and handles that are added by a click on the object.

import { button, byId, el, fillSelect } from "./dom.js";
import { fieldOf, fieldsOf } from "./field.js";
import { Items } from "./items.js";
import { sentPlaces } from "./request.js";
import { newWarp, warpFields } from "./schema.js";
import { isFinite3, tidy3 } from "./vec.js";

const warpTypes = ["rigid", "scale", "twist", "bend", "taper", "sine", "expression", "lattice", "handles"];
const move = { key: "move", kind: "vector", standard: [0, 0, 0], range: "small" };
const target = { key: "to", kind: "vector", standard: [0, 0, 0], range: "place" };

// Where a new handle goes: the last warp of handles that acts, by its place in the script as `sent` and as `edited`; if
// there is none, a new warp behind those sent, and `edited` is -1.
export function handlesPlace(warps, flags) {
  const places = sentPlaces(flags),
    sent = places.findLastIndex((i) => warps[i].type === "handles");
  return sent < 0 ? { sent: places.length, edited: -1 } : { sent, edited: places[sent] };
}

export class WarpsPanel {
  constructor(app) {
    this.app = app;
    this.list = new Items(app, byId("warp-list"), {
      part: "warp",
      keep: () => true,
      name: (warp, index) => `Warp ${index + 1}, ${warp.type}`,
      body: (warp, index) => this.body(warp, index),
      shape: (warp) => `${warp.handle?.length} ${warp.point?.map((p) => p.at)} ${warp.divisions}`,
    });
    byId("add-warp").addEventListener("change", (event) => {
      const type = event.target.value;
      event.target.value = "";
      if (type === "handles") app.setMode("handle");
      else if (type) this.add(newWarp(type, app.model()));
    });
  }

  add(warp) {
    this.app.store.edit((doc) => (doc.warp ??= []).push(warp));
    this.list.reveal(this.app.store.doc.warp.length - 1);
  }

  body(warp, index) {
    const { app } = this,
      name = `Warp ${index + 1}`;
    const fields = fieldsOf(app, ["warp", index], warpFields[warp.type] ?? [], name);
    const extra =
      warp.type === "handles"
        ? this.handles(warp, index, name)
        : warp.type === "lattice"
          ? this.points(warp, index, name)
          : [];
    return {
      nodes: [...fields.nodes, ...extra.map((e) => e.node)],
      refresh: () => {
        fields.refresh();
        for (const e of extra) e.refresh();
      },
    };
  }

  // A handle or control point: a closed row with the fields of its motion.
  part(path, title, spec, name, remove) {
    const field = fieldOf(this.app, [...path, spec.key], spec, name);
    const node = el(
      "details",
      { class: "sub", data: { path: path.join(".") } },
      el("summary", { text: title }),
      field.node,
      button("Delete", remove, { name: `Delete ${name}`, className: "small", data: { role: "delete-part" } }),
    );
    node.addEventListener("toggle", () => field.refresh());
    return {
      node,
      refresh: () => {
        if (node.open) field.refresh();
      },
    };
  }

  handles(warp, index, name) {
    const note = {
      node: el("p", { class: "note", text: "Handle mode (H): a click on the object adds a handle." }),
      refresh() {},
    };
    return [
      note,
      ...(warp.handle ?? []).map((handle, i) =>
        this.part(
          ["warp", index, "handle", i],
          `Handle ${i + 1}: rest ${handle.rest.join(", ")}`,
          target,
          `${name}, handle ${i + 1}`,
          () => this.removeHandle(index, i),
        ),
      ),
    ];
  }

  removeHandle(index, i) {
    const { warp } = this.app.store.doc;
    if (warp[index].handle.length === 1) this.list.remove(index);
    else this.app.store.edit((doc) => doc.warp[index].handle.splice(i, 1));
  }

  points(warp, index, name) {
    const counts = (Array.isArray(warp.divisions) ? warp.divisions : [1, 1, 1]).map((n) => n + 1);
    const at = [0, 1, 2].map((k) =>
      el(
        "select",
        { "aria-label": `${name}, new point, ${"xyz"[k]}` },
        ...Array.from({ length: counts[k] }, (_, i) => el("option", { value: i, text: String(i) })),
      ),
    );
    const add = button(
      "Add point",
      () => {
        const place = at.map((list) => Number(list.value));
        if ((warp.point ?? []).some((p) => String(p.at) === String(place)))
          return this.app.say("This control point is in the list.");
        this.app.store.edit((doc) => (doc.warp[index].point ??= []).push({ at: place, move: [0, 0, 0] }));
      },
      { data: { role: "add-point" } },
    );
    const adder = {
      node: el("div", { class: "buttons" }, el("span", { class: "note", text: "control point" }), ...at, add),
      refresh() {},
    };
    return [
      ...(warp.point ?? []).map((point, i) =>
        this.part(
          ["warp", index, "point", i],
          `Point ${point.at.join(", ")}`,
          move,
          `${name}, point ${i + 1}`,
          () => this.app.store.edit((doc) => doc.warp[index].point.splice(i, 1)),
        ),
      ),
      adder,
    ];
  }

  handlesPlace() {
    return handlesPlace(this.app.store.doc.warp ?? [], this.app.store.flags.warp);
  }

  // Adds a handle at a probed point: it rests where the warps before it move the point, and stands where the point is
  // after the handles that are there; says why if it cannot be.
  addHandle({ probed: { before, after }, version }) {
    const { store, limits } = this.app,
      { edited } = this.handlesPlace();
    if (version !== store.version) return this.app.say("The script has changed meanwhile; click again.");
    if (!isFinite3(before) || !isFinite3(after)) return this.app.say("There is no object at this place.");
    if (edited >= 0 && store.doc.warp[edited].handle.length >= limits.handles)
      return this.app.say(`A warp in the viewer has at most ${limits.handles} handles.`);
    const handle = { rest: tidy3(before), to: tidy3(after) };
    store.edit((doc) => {
      if (edited >= 0) doc.warp[edited].handle.push(handle);
      else (doc.warp ??= []).push({ type: "handles", handle: [handle] });
    });
    const at = edited >= 0 ? edited : store.doc.warp.length - 1;
    byId("section-warps").open = true;
    this.list.reveal(at, false);
    this.app.say(`Handle ${store.doc.warp[at].handle.length} is added; drag it to bend the object.`);
  }

  refresh() {
    const model = this.app.model();
    byId("warps-controls").disabled = !model.deforms;
    byId("warps-why").textContent = model.deforms ? "" : `This model cannot be bent: ${model.why}.`;
    fillSelect(byId("add-warp"), [["", "Add a warp…"], ...warpTypes.map((type) => [type, type])], "");
    this.list.refresh();
  }
}
