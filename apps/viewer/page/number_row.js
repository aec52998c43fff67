// The row of one number: a slider, a field that takes numbers and formulas, and a key button.

import { el, freshId } from "./dom.js";
import { sliderRange } from "./schema.js";
import {
  getIn,
  hasKeyAt,
  isSmoothAt,
  kindOf,
  parseTyped,
  setIn,
  withKey,
  withoutKey,
  withSmoothSwitched,
  withValue,
} from "./tracks.js";
import { tidy } from "./vec.js";

// Signs of a key button.
export const signs = { literal: "◇", keys: "◈", keyHere: "◆", expression: "ƒ" };

// A row with a slider, a field and, where the number may move, a key button. Without slider for optional numbers.
export function numberRow(app, path, spec, label, name, { moves = true, parent } = {}) {
  const id = freshId(),
    { store } = app,
    gesture = path.join(".");
  const raw = () => getIn(store.doc, path) ?? parent?.standard[path[path.length - 1]] ?? spec.standard;
  const value = () => {
    const track = getIn(store.doc, path);
    if (track === undefined) return typeof raw() === "number" ? raw() : NaN;
    const shown = getIn(app.scene.values(), path);
    return typeof shown === "number" ? shown : NaN;
  };
  const put = (change, options) =>
    store.edit((doc) => {
      if (parent && getIn(doc, path.slice(0, -1)) === undefined)
        setIn(doc, path.slice(0, -1), [...parent.standard]);
      setIn(doc, path, change(getIn(doc, path) ?? raw()));
    }, options);
  const setValue = (number, options) => {
    if (kindOf(raw()) === "expression")
      app.say(`${name} was a formula and is a number now; Undo brings it back.`);
    put((track) => withValue(track, store.view.frame, number), options);
  };

  const [least, most] = spec.range
    ? sliderRange(spec, app.model(), store.doc.frames ?? { first: 0, last: 1 })
    : [0, 1];
  const toSlider = (x) => (spec.log ? Math.log(Math.max(x, 1e-9)) : x);
  const slider = spec.range
    ? el("input", {
        type: "range",
        min: toSlider(least),
        max: toSlider(most),
        step: "any",
        "aria-label": `${name}, slider`,
        data: { role: "slider" },
        on: {
          input: (event) =>
            setValue(
              tidy(
                spec.log
                  ? Math.exp(slider.valueAsNumber)
                  : spec.whole
                    ? Math.round(slider.valueAsNumber)
                    : slider.valueAsNumber,
                4,
              ),
              { gesture, stamp: event.timeStamp },
            ),
          change: () => store.endGesture(),
        },
      })
    : null;
  const field = el("input", {
    type: "text",
    id,
    inputmode: "text",
    autocomplete: "off",
    spellcheck: "false",
    "aria-label": name,
    data: { role: "number" },
    on: {
      change: (event) => {
        if (field.value.trim() === "" && spec.kind === "optionalNumber") {
          clearError();
          store.edit((doc) => setIn(doc, path, undefined));
          return;
        }
        const typed = parseTyped(field.value, moves, spec);
        if (typed.error) return showError(typed.error);
        clearError();
        if (typed.expression !== undefined) put(() => typed.expression, { stamp: event.timeStamp });
        else if (kindOf(raw()) === "expression") put(() => typed.value, { stamp: event.timeStamp });
        else setValue(typed.value, { stamp: event.timeStamp });
      },
      keydown: (event) => {
        if (event.key === "Escape") {
          clearError();
          field.blur();
          refresh();
        }
      },
    },
  });
  const error = el("span", { class: "field-error", id: `${id}-error` });
  const showError = (text) => {
    field.setAttribute("aria-invalid", "true");
    field.setAttribute("aria-describedby", error.id);
    error.textContent = text;
  };
  const clearError = () => {
    field.removeAttribute("aria-invalid");
    field.removeAttribute("aria-describedby");
    error.textContent = "";
  };
  const key = moves
    ? el("button", {
        type: "button",
        class: "key",
        data: { role: "key" },
        on: {
          click: (event) => {
            const frame = store.view.frame,
              track = raw(),
              now = tidy(value());
            if (event.shiftKey && hasKeyAt(track, frame)) return put(() => withSmoothSwitched(track, frame));
            if (!Number.isFinite(now)) return;
            if (kindOf(track) === "expression")
              app.say(`${name} was a formula and has a key now; Undo brings it back.`);
            put(() => (hasKeyAt(track, frame) ? withoutKey(track, frame) : withKey(track, frame, now)));
          },
        },
      })
    : null;

  const node = el(
    "div",
    { class: "field", data: { path: gesture } },
    el("label", { class: "row-label", for: id, text: label }),
    slider ?? el("span"),
    field,
    key ?? el("span"),
    error,
  );
  function refresh() {
    const track = raw(),
      kind = kindOf(track),
      now = value(),
      frame = store.view.frame;
    if (document.activeElement !== field && !field.hasAttribute("aria-invalid")) {
      const text = kind === "expression" ? track : Number.isFinite(now) ? String(tidy(now)) : "";
      if (field.value !== text) field.value = text;
      field.title = kind === "expression" ? `${track} = ${tidy(now)}` : "";
    }
    if (slider && Number.isFinite(now)) {
      const x = toSlider(now);
      if (x < Number(slider.min)) slider.min = x;
      if (x > Number(slider.max)) slider.max = x;
      if (Math.abs(slider.valueAsNumber - x) > 1e-9) slider.value = x;
      slider.setAttribute("aria-valuetext", String(tidy(now)));
    } else if (slider) slider.value = slider.min;
    if (!key) return;
    const here = hasKeyAt(track, frame),
      state = here ? "keyHere" : kind;
    if (key.dataset.state === `${state} ${isSmoothAt(track, frame)}`) return;
    key.dataset.state = `${state} ${isSmoothAt(track, frame)}`;
    key.textContent = isSmoothAt(track, frame) ? "●" : signs[state];
    key.setAttribute("aria-pressed", String(here));
    key.setAttribute("aria-label", `Key of ${name}`);
    key.title = here
      ? "Remove this frame's key (Shift: switch easing)"
      : kind === "expression"
        ? "A formula; replace it by a key at this frame"
        : "Add a key at this frame";
  }
  return { node, refresh };
}
