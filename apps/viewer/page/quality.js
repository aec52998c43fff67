// The section "Quality": the preset of still pictures and the model's options, made from the rows of /start.

import { byId, el, fillSelect } from "./dom.js";
import { parseTyped } from "./tracks.js";
import { tidy } from "./vec.js";

// Whether an option matters, as another one has one of the values that it needs.
export function applies(row, options, rows) {
  if (!row.needs) return true;
  const [name, values] = row.needs;
  const now = options[name] ?? rows.find((r) => r.name === name)?.standard;
  return now === null || now === undefined || values.includes(now);
}

// Controls for rows of options; `get()` gives the chosen ones, `put(options)` takes them.
export class OptionRows {
  constructor(host, prefix, get, put) {
    Object.assign(this, { host, prefix, get, put, built: "" });
  }

  set(name, value) {
    const options = { ...this.get() };
    if (value === undefined) delete options[name];
    else options[name] = value;
    this.put(options);
  }

  control(row, id) {
    const standard =
      row.standard === null || row.standard === undefined ? "the model's" : String(row.standard);
    if (row.choices) {
      const list = el("select", {
        id,
        data: { option: row.name },
        on: { change: () => this.set(row.name, list.value || undefined) },
      });
      fillSelect(list, [["", `${standard} (usual)`], ...row.choices.map((choice) => [choice, choice])], "");
      return list;
    }
    const field = el("input", {
      type: "text",
      id,
      inputmode: "decimal",
      placeholder: standard,
      data: { option: row.name },
      on: {
        change: () => {
          if (field.value.trim() === "") {
            field.removeAttribute("aria-invalid");
            return this.set(row.name, undefined);
          }
          const typed = parseTyped(field.value, false, row);
          field.toggleAttribute("aria-invalid", false);
          field.title = typed.error ?? row.help;
          if (typed.error) field.setAttribute("aria-invalid", "true");
          else this.set(row.name, typed.value);
        },
      },
    });
    return field;
  }

  refresh(rows) {
    const key = JSON.stringify(rows);
    if (key !== this.built) {
      this.built = key;
      this.rows = rows.map((row) => {
        const id = `${this.prefix}-${row.name}`,
          control = this.control(row, id);
        const node = el(
          "div",
          { class: "row", title: row.help, data: { path: `options.${row.name}` } },
          el("label", {
            class: "row-label",
            for: id,
            text: row.name.replaceAll("_", " ").replaceAll("-", " "),
          }),
          control,
        );
        return { row, control, node };
      });
      this.host.replaceChildren(...this.rows.map((r) => r.node));
      if (!rows.length) this.host.append(el("p", { class: "note", text: "This model has no options." }));
    }
    const options = this.get();
    for (const { row, control } of this.rows) {
      control.disabled = !applies(row, options, rows);
      if (document.activeElement !== control && !control.hasAttribute("aria-invalid"))
        control.value = options[row.name] ?? "";
    }
  }
}

export class QualityPanel {
  constructor(app) {
    this.app = app;
    const { store } = app;
    byId("preset").addEventListener("change", (event) => store.setView({ preset: event.target.value }));
    this.options = new OptionRows(
      byId("options"),
      "option",
      () => store.view.options,
      (options) => store.setView({ options }),
    );
  }

  // What the server said of the last picture.
  report({ said, size, ms }) {
    const parts = [`${size[0]} × ${size[1]}`, `${Math.round(ms)} ms`];
    if (Number.isFinite(said.level)) parts.push(`level ${tidy(said.level, 3)}`);
    if (Number.isFinite(said.imagesRead)) parts.push(`${said.imagesRead} images read`);
    if (said.imagesUploaded > 0) parts.push(`${said.imagesUploaded} uploaded`);
    if (Number.isFinite(said.decibels?.srgb)) parts.push(`${said.decibels.srgb.toFixed(2)} dB`);
    byId("quality-facts").textContent =
      [
        `Rendered in ${((said.renderSeconds ?? 0) * 1000).toFixed(1)} ms`,
        `encoded in ${((said.encodeSeconds ?? 0) * 1000).toFixed(1)} ms`,
        ...parts,
      ].join(", ") + ".";
    byId("picture-facts").textContent = [said.quality ?? "", ...parts].join(" · ");
  }

  refresh() {
    byId("preset").value = this.app.store.view.preset;
    this.options.refresh(this.app.model().options ?? []);
  }
}
