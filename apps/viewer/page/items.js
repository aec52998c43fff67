// A list of lamps, environments or warps in the side panel: each can be opened, muted, put on solo and deleted.

import { button, el, scrollInPanel, setPressed } from "./dom.js";

export class Items {
  // part: "light" or "warp"; keep(item) chooses the items of this list; name(item, index); body(item, index) gives
  // { nodes, refresh } of an opened item; shape(item) is a text that changes when the body must be made anew;
  // swatch(index) is the item's colour; solo is whether items can be shown alone; chosen(index) whether one is highlighted;
  // choose(index) and removed(index) tell of these.
  constructor(app, host, { part, keep, name, body, shape, solo, swatch, chosen, choose, removed }) {
    Object.assign(this, { app, host, part, keep, name, body, shape, solo, swatch, chosen, choose, removed });
    this.built = "";
    this.open = new Set();
    this.rows = [];
  }

  all() {
    return this.app.store.doc[this.part] ?? [];
  }

  remove(index) {
    this.open = new Set([...this.open].filter((i) => i !== index).map((i) => (i > index ? i - 1 : i)));
    const { part } = this;
    this.removed?.(index);
    this.app.store.edit((doc, flags) => {
      doc[part].splice(index, 1);
      flags[part].splice(index, 1);
    });
    this.refresh();
    (this.rows.find((r) => r.index >= index) ?? this.rows.at(-1))?.toggle.focus();
  }

  // Opens an item and puts the focus on it.
  reveal(index, focus = true) {
    this.open.add(index);
    this.refresh();
    const row = this.rows.find((r) => r.index === index);
    if (!row) return;
    scrollInPanel(row.node);
    if (focus) row.toggle.focus({ preventScroll: true });
  }

  refresh() {
    const places = this.all().flatMap((item, index) => (this.keep(item) ? [index] : []));
    const key = JSON.stringify(
      places.map((i) => [i, this.all()[i].type, this.shape?.(this.all()[i]), this.open.has(i)]),
    );
    if (key !== this.built) {
      this.rows = places.map((index) => this.made(index));
      this.host.replaceChildren(...this.rows.map((r) => r.node));
      this.built = key;
    }
    for (const r of this.rows) {
      const flags = this.app.store.flags[this.part][r.index];
      r.toggle.textContent = this.name(this.all()[r.index], r.index);
      if (this.swatch) r.node.style.setProperty("--swatch", this.swatch(r.index));
      setPressed(r.mute, flags.mute);
      if (r.solo) setPressed(r.solo, flags.solo);
      r.node.classList.toggle("muted", flags.mute);
      r.node.classList.toggle("chosen", Boolean(this.chosen?.(r.index)));
      r.body?.refresh();
    }
  }

  made(index) {
    const { app, part } = this,
      item = this.all()[index],
      name = this.name(item, index),
      open = this.open.has(index);
    const toggle = el("button", {
      type: "button",
      class: this.swatch ? "item-name swatch" : "item-name",
      "aria-expanded": String(open),
      data: { role: "open" },
      on: {
        click: () => {
          if (open) this.open.delete(index);
          else this.open.add(index);
          this.choose?.(index);
          this.refresh();
          this.rows.find((r) => r.index === index)?.toggle.focus();
        },
      },
    });
    const flag = (kind, text, title) =>
      button(
        text,
        (event) =>
          app.store.setFlags(part, index, { [kind]: !app.store.flags[part][index][kind] }, event.timeStamp),
        {
          name: `${title} ${name}`,
          title: `${title} (in the viewer only)`,
          pressed: false,
          data: { role: kind },
          className: "small",
        },
      );
    const mute = flag("mute", "M", "Mute"),
      solo = this.solo ? flag("solo", "S", "Solo") : null;
    const remove = button("×", () => this.remove(index), {
      name: `Delete ${name}`,
      data: { role: "delete" },
      className: "small",
    });
    const body = open ? this.body(item, index) : null;
    const node = el(
      "div",
      { class: "item", data: { path: `${part}.${index}`, [part]: index } },
      el("div", { class: "item-head" }, toggle, solo, mute, remove),
      body ? el("div", { class: "item-body" }, ...body.nodes) : null,
    );
    return { index, node, toggle, mute, solo, body };
  }
}
