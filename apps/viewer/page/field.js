// Rows of the side panel that show and edit one key of a camera, light or warp: sliders, typed numbers and key buttons.

import { el, fillSelect, freshId } from "./dom.js";
import { hexOfLinear, linearOfHex } from "./lamps.js";
import { numberRow, signs } from "./number_row.js";
import { getIn, hasKeyAt, isKeys, parseTyped, setIn, withKey, withoutKey, withValue } from "./tracks.js";
import { tidy } from "./vec.js";

function vectorRows(app, path, spec, label, name, moves) {
  const rows = ["x", "y", "z"].map((axis, i) =>
    numberRow(app, [...path, i], spec, axis, `${name} ${axis}`, { moves, parent: spec }),
  );
  const node = el(
    "fieldset",
    { class: "vector", data: { path: path.join(".") } },
    el("legend", { text: label }),
    ...rows.map((r) => r.node),
  );
  return { node, refresh: () => rows.forEach((r) => r.refresh()) };
}

// The colour of a lamp: linear light in the script, sRGB on the picker.
function colorRow(app, path, spec, label, name) {
  const { store } = app,
    id = freshId();
  const tracks = () => getIn(store.doc, path) ?? spec.standard;
  const put = (change, options) => store.edit((doc) => setIn(doc, path, tracks().map(change)), options);
  const picker = el("input", {
    type: "color",
    id,
    data: { role: "color" },
    on: {
      input: (event) => {
        const rgb = linearOfHex(picker.value);
        put((track, i) => withValue(track, store.view.frame, rgb[i]), {
          gesture: path.join("."),
          stamp: event.timeStamp,
        });
      },
      change: () => store.endGesture(),
    },
  });
  const numbers = el("span", { class: "note" });
  const key = el("button", {
    type: "button",
    class: "key",
    "aria-label": `Key of ${name}`,
    data: { role: "key" },
    on: {
      click: () => {
        const { frame } = store.view,
          now = current(),
          here = tracks().some((track) => hasKeyAt(track, frame));
        put((track, i) => (here ? withoutKey(track, frame) : withKey(track, frame, tidy(now[i]))));
      },
    },
  });
  const current = () => {
    const now = getIn(app.scene.values(), path);
    return spec.standard.map((c, i) => (Number.isFinite(now?.[i]) ? now[i] : c));
  };
  const node = el(
    "div",
    { class: "field", data: { path: path.join(".") } },
    el("label", { class: "row-label", for: id, text: label }),
    picker,
    numbers,
    key,
  );
  return {
    node,
    refresh: () => {
      const now = current(),
        hex = hexOfLinear(now),
        here = tracks().some((track) => hasKeyAt(track, store.view.frame));
      if (picker.value !== hex) picker.value = hex;
      numbers.textContent = now.map((c) => tidy(c, 3)).join(" ");
      key.textContent = here ? signs.keyHere : tracks().some(isKeys) ? signs.keys : signs.literal;
      key.setAttribute("aria-pressed", String(here));
      key.title = here ? "Remove this frame's key" : "Add a key at this frame";
    },
  };
}

function choiceRow(app, path, spec, label, name) {
  const { store } = app,
    id = freshId();
  const list = el("select", {
    id,
    "aria-label": name,
    on: {
      change: () => store.edit((doc) => setIn(doc, path, list.value || undefined)),
    },
  });
  fillSelect(
    list,
    spec.choices.map((choice) => [choice, spec.names?.[choice] ?? choice]),
    spec.standard,
  );
  const node = el(
    "div",
    { class: "row", data: { path: path.join(".") } },
    el("label", { class: "row-label", for: id, text: label }),
    list,
  );
  return {
    node,
    refresh: () => {
      list.value = getIn(store.doc, path) ?? spec.standard;
    },
  };
}

// A formula of the warp "expression", or the name of a file, which is only shown.
function textRow(app, path, spec, label, name) {
  const { store } = app,
    id = freshId();
  const field = el("input", {
    type: "text",
    id,
    "aria-label": name,
    readonly: spec.kind === "file",
    spellcheck: "false",
    data: { role: "text" },
    on: {
      change: () => {
        const typed = parseTyped(field.value, true);
        if (typed.error) field.setAttribute("aria-invalid", "true");
        else {
          field.removeAttribute("aria-invalid");
          store.edit((doc) => setIn(doc, path, typed.expression ?? String(typed.value)));
        }
      },
    },
  });
  const node = el(
    "div",
    { class: "row", data: { path: path.join(".") } },
    el("label", { class: "row-label", for: id, text: label }),
    field,
  );
  return {
    node,
    refresh: () => {
      if (document.activeElement !== field && !field.hasAttribute("aria-invalid"))
        field.value = getIn(store.doc, path) ?? spec.standard ?? "";
    },
  };
}

const labels = {
  color: "colour",
  center: "centre",
  look_at: "look at",
  fov_deg: "field of view",
  angle_deg: "angle",
  rotate_deg: "rotation",
  azimuth_deg: "azimuth",
  elevation_deg: "elevation",
  phase_deg: "phase",
};

// One key: { node, refresh }. `of` names its owner for screen readers.
export function fieldOf(app, path, spec, of) {
  const label = labels[spec.key] ?? spec.key,
    name = `${of} ${label}`;
  switch (spec.kind) {
    case "vector":
      return vectorRows(app, path, spec, label, name, true);
    case "fixed":
      return vectorRows(app, path, spec, label, name, false);
    case "color":
      return colorRow(app, path, spec, label, name);
    case "choice":
      return choiceRow(app, path, spec, label, name);
    case "text":
    case "file":
      return textRow(app, path, spec, label, name);
    default:
      return numberRow(app, path, spec, label, name, { moves: spec.kind === "number" });
  }
}

export function fieldsOf(app, path, specs, of) {
  const fields = specs.map((spec) => fieldOf(app, [...path, spec.key], spec, of));
  return {
    nodes: fields.map((field) => field.node),
    refresh: () => fields.forEach((field) => field.refresh()),
  };
}
