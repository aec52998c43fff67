// Rows of the side panel that show and edit one key of a camera, light or warp: sliders, typed numbers and key buttons.

import { checkBox, el, fillSelect, freshId } from "./dom.js";
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

// Three numbers of at least 0 in a text such as "1 0.7 0.4"; null if it is none.
function threeOf(text) {
  const numbers = text.trim().split(/[\s,;]+/).map(Number);
  return numbers.length === 3 && numbers.every((x) => Number.isFinite(x) && x >= 0) ? numbers : null;
}

// The colour of a lamp: linear light in the script and in the field, sRGB on the picker.
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
  const error = el("span", { class: "field-error", id: `${id}-error` });
  const showError = (text) => {
    error.textContent = text;
    if (text) linear.setAttribute("aria-describedby", error.id);
    else linear.removeAttribute("aria-describedby");
    linear.toggleAttribute("aria-invalid", false);
    if (text) linear.setAttribute("aria-invalid", "true");
  };
  const linear = el("input", {
    type: "text",
    autocomplete: "off",
    spellcheck: "false",
    "aria-label": `${name}, linear red, green and blue`,
    title: "Linear red, green and blue",
    data: { role: "linear" },
    on: {
      change: (event) => {
        const rgb = threeOf(linear.value);
        showError(rgb ? "" : "expected three numbers of at least 0: red, green, blue");
        if (rgb)
          put((track, i) => withValue(track, store.view.frame, rgb[i]), { stamp: event.timeStamp });
      },
      keydown: (event) => {
        if (event.key !== "Escape") return;
        showError("");
        linear.blur();
        refresh();
      },
    },
  });
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
    { class: "field color", data: { path: path.join(".") } },
    el("label", { class: "row-label", for: id, text: label }),
    picker,
    linear,
    key,
    error,
  );
  function refresh() {
    const now = current(),
      hex = hexOfLinear(now),
      here = tracks().some((track) => hasKeyAt(track, store.view.frame));
    if (picker.value !== hex) picker.value = hex;
    if (document.activeElement !== linear && !linear.hasAttribute("aria-invalid"))
      linear.value = now.map((c) => tidy(c, 4)).join(" ");
    key.textContent = here ? signs.keyHere : tracks().some(isKeys) ? signs.keys : signs.literal;
    key.setAttribute("aria-pressed", String(here));
    key.title = here ? "Remove this frame's key" : "Add a key at this frame";
  }
  return { node, refresh };
}

// A number that may be absent, for "everywhere".
function optionalRow(app, path, spec, label, name) {
  const { store } = app,
    number = numberRow(app, path, spec, "within", name, { moves: false });
  const everywhere = checkBox(
    "everywhere",
    true,
    (on) => store.edit((doc) => setIn(doc, path, on ? undefined : tidy(app.model().radius, 3))),
    { data: { role: "everywhere" } },
  );
  const node = el(
    "div",
    { class: "optional", role: "group", "aria-label": name, data: { path: path.join(".") } },
    el("div", { class: "row" }, el("span", { class: "row-label", text: label }), everywhere.node),
    number.node,
  );
  return {
    node,
    refresh: () => {
      everywhere.box.checked = getIn(store.doc, path) === undefined;
      number.node.hidden = everywhere.box.checked;
      number.refresh();
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
    case "optionalNumber":
      return optionalRow(app, path, spec, label, name);
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
