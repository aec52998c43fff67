// The section "Compare" and the divider on the picture: A is the scene; B another model, setting, or the photograph.

import { byId, checkBox, el, fillSelect, select } from "./dom.js";
import { OptionRows } from "./quality.js";
import { photographsOf } from "./view_panel.js";
import { nearestCaptured } from "./camera.js";

const kinds = [
  ["off", "nothing"],
  ["preset", "preview or full quality"],
  ["options", "other options"],
  ["model", "another model"],
  ["photograph", "the photograph"],
];

// What the server's decibels say, as a text.
export function decibelText(d) {
  if (!d) return "";
  const parts = [];
  if (Number.isFinite(d.srgb)) parts.push(`${d.srgb.toFixed(2)} dB sRGB`);
  if (Number.isFinite(d.linear)) parts.push(`${d.linear.toFixed(2)} dB linear`);
  if (Number.isFinite(d.ssim)) parts.push(`SSIM ${d.ssim.toFixed(4)}`);
  return parts.join(", ");
}

export class ComparePanel {
  constructor(app) {
    this.app = app;
    this.decibels = { a: "", b: "" };
    const set = (changes) => this.set(changes);
    this.kind = select(kinds, "off", (kind) => this.choose(kind), { id: "compare-kind" });
    this.model = select([], "", (value) => set({ model: Number(value) }), { id: "compare-model" });
    this.preset = select(
      [
        ["preview", "preview"],
        ["full", "full"],
      ],
      "preview",
      (preset) => set({ preset }),
      { id: "compare-preset" },
    );
    this.light = select([], "", (light) => app.store.setView({ light }), { id: "compare-light" });
    this.match = checkBox("A under the photograph's light, at rest", true, (match) => set({ match }), {
      id: "compare-match",
    });
    this.optionHost = el("div", { id: "compare-options" });
    this.options = new OptionRows(
      this.optionHost,
      "compare-option",
      () => this.state().options,
      (options) => set({ options }),
    );
    const label = (text, control) =>
      el("div", { class: "row" }, el("label", { class: "row-label", for: control.id, text }), control);
    this.rows = {
      model: label("model", this.model),
      preset: label("quality", this.preset),
      options: this.optionHost,
      photograph: el("div", {}, label("light", this.light), this.match.node),
    };
    this.error = el("button", {
      type: "button",
      id: "compare-error",
      text: "Show error",
      "aria-pressed": "false",
      title: "The picture's difference from the photograph",
      on: { click: () => this.showError() },
    });
    this.text = el("p", { class: "note", id: "decibels" });
    this.hint = el("p", { class: "note", text: "Choose a captured camera (C) to see its photograph." });
    byId("compare-body").append(
      label("B shows", this.kind),
      ...Object.values(this.rows),
      this.hint,
      el("div", { class: "buttons" }, this.error),
      this.text,
    );
    this.listenDivider();
  }

  state() {
    return this.app.store.view.compare;
  }
  set(changes) {
    this.app.store.setView({ compare: { ...this.state(), ...changes } });
  }

  choose(kind) {
    const { store, scene } = this.app,
      model = this.app.model();
    if (kind === "photograph" && !scene.captured()) {
      const nearest = nearestCaptured(scene.pose(), model);
      if (nearest) store.setView({ camera: { kind: "captured", name: nearest.name } }, undefined, "camera");
    }
    const other = this.app.start.models.findIndex((_, i) => i !== store.view.model);
    this.set({ kind, ...(kind === "model" && other >= 0 ? { model: other } : {}), side: null });
  }

  showError() {
    this.app.viewPanel.show(this.app.store.view.show === "error" ? "color" : "error");
  }

  // The panes on the stage; B is missing where there is nothing to compare with.
  panes() {
    const { kind } = this.state(),
      { store } = this.app;
    if (kind === "off" || this.app.model().method === "capture") return ["a"];
    if (kind === "photograph" && store.view.camera.kind !== "captured") return ["a"];
    return ["a", "b"];
  }

  // Shows all of A, then all of B, then both.
  toggleSide() {
    if (this.state().kind === "off")
      return this.app.say("Choose first what B shows, in the section Compare.");
    const next = { a: "b", b: null }[this.state().side] ?? (this.state().side === null ? "a" : null);
    this.set({ side: next });
  }

  nameOfB({ kind, model, preset }) {
    switch (kind) {
      case "model":
        return this.app.start.models[model]?.name;
      case "preset":
        return preset === "full" ? "full quality" : "preview";
      case "photograph":
        return `photograph ${[this.app.scene.captured()?.name, this.app.store.view.light].filter(Boolean).join(", ")}`;
      default:
        return (
          Object.entries(this.state().options)
            .map(([name, value]) => `${name} ${value}`)
            .join(", ") || "the model's options"
        );
    }
  }

  split() {
    if (this.panes().length < 2) return null;
    const { side, split } = this.state();
    return side === "a" ? 1 : side === "b" ? 0 : split;
  }

  listenDivider() {
    const divider = byId("divider"),
      { app } = this;
    const put = (split) =>
      app.store.setView(
        { compare: { ...this.state(), split: Math.max(0, Math.min(1, split)), side: null } },
        undefined,
        "page",
      );
    let down = false;
    divider.addEventListener("pointerdown", (event) => {
      down = true;
      divider.setPointerCapture(event.pointerId);
      event.stopPropagation();
    });
    divider.addEventListener("pointermove", (event) => {
      if (down) put(app.stage.place(event).x);
    });
    for (const type of ["pointerup", "pointercancel"])
      divider.addEventListener(type, () => {
        down = false;
      });
    divider.addEventListener("keydown", (event) => {
      const to = {
        ArrowLeft: this.state().split - 0.02,
        ArrowRight: this.state().split + 0.02,
        Home: 0,
        End: 1,
      }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      put(to);
    });
  }

  report(pane, said) {
    this.decibels[pane] = decibelText(said.decibels);
    const texts = Object.entries(this.decibels)
      .filter(([, text]) => text)
      .map(([, text]) => text);
    this.text.textContent = [...new Set(texts)].join("; ");
  }

  refresh() {
    const { store, scene } = this.app,
      model = this.app.model(),
      { start } = this.app,
      state = this.state();
    const captured = scene.captured(),
      photographs = model.hasPhotographs && model.cameras.length > 0;
    const possible = kinds.filter(
      ([kind]) => (kind !== "model" || start.models.length > 1) && (kind !== "photograph" || photographs),
    );
    fillSelect(this.kind, possible, state.kind);
    this.kind.disabled = model.method === "capture";
    fillSelect(
      this.model,
      start.models.map((m, i) => [String(i), `${m.name}, ${m.method}`]),
      String(state.model),
    );
    this.preset.value = state.preset;
    fillSelect(this.light, captured ? photographsOf(model, captured) : [], store.view.light ?? "");
    this.match.box.checked = state.match;
    for (const [kind, node] of Object.entries(this.rows)) node.hidden = kind !== state.kind;
    if (state.kind === "options") this.options.refresh(model.options ?? []);
    this.hint.hidden = state.kind !== "photograph" || captured !== null;
    this.error.hidden = !photographs;
    this.error.setAttribute("aria-pressed", String(store.view.show === "error"));
    const split = this.split(),
      shown = split !== null;
    if (!shown) this.report("b", {});
    if (store.view.show !== "error" && state.kind !== "photograph") this.report("a", {});
    const divider = byId("divider");
    divider.hidden = !shown || state.side !== null;
    divider.style.left = `${100 * (split ?? 0.5)}%`;
    divider.setAttribute("aria-valuenow", Math.round(100 * (split ?? 0.5)));
    byId("name-a").hidden = !shown || split === 0;
    byId("name-b").hidden = !shown || split === 1;
    byId("name-a").textContent = "A";
    byId("name-b").textContent = `B: ${this.nameOfB(state)}`;
  }
}
