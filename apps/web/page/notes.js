// Annotations: a list in the panel, kept by the browser, saved to and read from files.
"use strict";
(() => {
  // A number for a known key, and text; anything else in a file is refused.
  function checked(read) {
    if (!Array.isArray(read?.annotations)) throw new Error("expected a list, annotations");
    return read.annotations.map((note, i) => {
      const isBox = note?.width !== undefined || note?.height !== undefined;
      for (const key of isBox ? ["x", "y", "width", "height"] : ["x", "y"])
        if (!Number.isFinite(note?.[key])) throw new Error(`annotations[${i}].${key}: expected a number`);
      if (typeof note.text !== "string") throw new Error(`annotations[${i}].text: expected text`);
      const { x, y, width, height, text } = note;
      return isBox ? { x, y, width, height, text } : { x, y, text };
    });
  }

  const hashOf = (text) => { // of strings, as Java's
    let hash = 0;
    for (let i = 0; i < text.length; ++i) hash = Math.imul(31, hash) + text.charCodeAt(i) | 0;
    return `${text.length} ${hash}`;
  };
  const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

  // The browser keeps, for each captured object, {annotations, published, earlier}: the list, the hash of the published list
  // that it was made from, and annotations that the visitor may take back.
  class Notes {
    constructor(page, published, changed) {
      Object.assign(this, { isFixed: page.readOnly ?? false, key: `surflect ${page.object}`, published: checked({ annotations: published }), changed, chosen: -1, earlier: [] });
      this.publishedHash = hashOf(JSON.stringify(this.published));
      this.list = structuredClone(this.published);
      if (!page.readOnly) try {
        const kept = JSON.parse(localStorage.getItem(this.key));
        if (kept) {
          const list = checked(kept);
          this.earlier = checked({ annotations: kept.earlier });
          if (kept.published === this.publishedHash) this.list = list;
          else if (this.putAside(hashOf(JSON.stringify(list)) === kept.published ? [] : list)) this.say("The folder has other annotations than when this browser kept its own.");
        }
      } catch { } // no storage, or of another program
      document.getElementById("save").onclick = () => this.save();
      document.getElementById("open").onclick = () => document.getElementById("file").click();
      document.getElementById("file").onchange = (event) => this.open(event.target.files[0]);
      document.getElementById("reset").onclick = () => {
        this.putAside(this.list);
        this.replace(structuredClone(this.published), "");
      };
      document.getElementById("earlier").onclick = () => {
        const earlier = this.earlier;
        this.earlier = [];
        this.putAside(this.list);
        this.replace(earlier, "");
      };
      this.show();
    }

    // Adds a list to the earlier annotations, and forgets them if all are published. Returns whether there are any.
    putAside(list) {
      this.earlier = [...this.earlier.filter((a) => !list.some((b) => same(a, b))), ...list];
      if (this.earlier.every((a) => this.published.some((b) => same(a, b)))) this.earlier = [];
      return this.earlier.length > 0;
    }

    get text() { return JSON.stringify({ annotations: this.list }, null, 2) + "\n"; }

    say(text) { document.getElementById("said").textContent = text; }

    keep() {
      const kept = { annotations: this.list, published: this.publishedHash, earlier: this.earlier };
      try { localStorage.setItem(this.key, JSON.stringify(kept)); } catch { this.say("This browser keeps nothing: save them as a file."); }
      this.changed();
    }

    add(note) {
      this.list.push(note);
      this.chosen = this.list.length - 1;
      this.show();
      this.keep();
      document.querySelector("#notes li:last-child input").focus();
    }

    replace(list, said) {
      this.list = list;
      this.chosen = -1;
      this.show();
      this.keep();
      this.say(said);
    }

    save() {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([this.text], { type: "application/json" }));
      link.download = "annotations.json";
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
      this.say("Saved. In the folder of this page, annotations.json is published by the next export.");
    }

    async open(file) {
      if (!file) return;
      try {
        this.replace(checked(JSON.parse(await file.text())), `${file.name}: read`);
      } catch (error) { this.say(`${file.name}: ${error.message}`); }
      document.getElementById("file").value = "";
    }

    show() {
      document.getElementById("none").hidden = this.list.length > 0;
      document.getElementById("earlier").hidden = this.earlier.length === 0;
      document.getElementById("notes").replaceChildren(...this.list.map((note, i) => {
        const item = document.createElement("li"), number = document.createElement("span");
        number.className = "number";
        number.textContent = `${i + 1}`;
        if (this.isFixed) {
          const choose = document.createElement("button");
          choose.type = "button";
          choose.textContent = note.text || "–";
          choose.onclick = () => { this.chosen = i; this.changed(); };
          item.append(number, choose);
          return item;
        }
        const text = document.createElement("input"), remove = document.createElement("button");
        text.type = "text";
        text.value = note.text;
        text.setAttribute("aria-label", `Text of annotation ${i + 1}`);
        text.onfocus = () => { this.chosen = i; this.changed(); };
        text.oninput = () => { note.text = text.value; this.keep(); };
        remove.type = "button";
        remove.textContent = "×";
        remove.setAttribute("aria-label", `Remove annotation ${i + 1}`);
        remove.onclick = () => { this.list.splice(i, 1); this.chosen = -1; this.show(); this.keep(); };
        item.append(number, text, remove);
        return item;
      }));
    }
  }

  surflect.Notes = Notes;
})();
