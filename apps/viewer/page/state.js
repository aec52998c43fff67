// The page's state: the script as `doc`, which of its lamps and warps are muted, and the view; with undo and redo of edits.

import { eachTrack, getIn, isKeys, setIn } from "./tracks.js";

const kept = 200; // edits that can be undone

const copy = (value) => structuredClone(value);

export class Store {
  constructor(doc, view) {
    this.doc = copy(doc);
    this.view = view;
    this.flags = { light: [], warp: [] }; // { mute, solo } beside each lamp and warp
    this.matchFlags();
    this.past = [];
    this.future = [];
    this.gesture = null;
    this.version = 0; // of doc
    this.listeners = [];
  }

  // listener(what, stamp): what is "doc", "view", "camera" or "frame"; stamp is the time of the event that caused it.
  listen(listener) {
    this.listeners.push(listener);
  }
  tell(what, stamp) {
    for (const listener of this.listeners) listener(what, stamp);
  }

  // Changes the doc. Edits with the same gesture, one after another, are undone together.
  edit(change, { gesture = null, stamp } = {}) {
    if (gesture === null || gesture !== this.gesture) {
      this.past.push(this.snapshot());
      if (this.past.length > kept) this.past.shift();
    }
    this.gesture = gesture;
    this.future = [];
    change(this.doc, this.flags);
    this.matchFlags();
    ++this.version;
    this.tell("doc", stamp);
  }

  // Ends a gesture, so that the next edit is undone on its own.
  endGesture() {
    this.gesture = null;
  }

  setView(changes, stamp, what = "view") {
    Object.assign(this.view, changes);
    this.tell(what, stamp);
  }

  setFlags(part, index, changes, stamp) {
    Object.assign(this.flags[part][index], changes);
    ++this.version;
    this.tell("doc", stamp);
  }

  snapshot() {
    return JSON.stringify({ doc: this.doc, flags: this.flags });
  }

  restore(from, to) {
    if (!from.length) return false;
    to.push(this.snapshot());
    const { doc, flags } = JSON.parse(from.pop());
    // Muting is no edit: it stays where the same lamps or warps are there.
    for (const part of ["light", "warp"])
      if (flags[part].length !== this.flags[part].length) this.flags[part] = flags[part];
    this.doc = doc;
    this.gesture = null;
    ++this.version;
    this.tell("doc");
    return true;
  }

  undo() {
    return this.restore(this.past, this.future);
  }
  redo() {
    return this.restore(this.future, this.past);
  }

  matchFlags() {
    for (const part of ["light", "warp"]) {
      const n = this.doc[part]?.length ?? 0,
        flags = this.flags[part];
      flags.length = Math.min(flags.length, n);
      while (flags.length < n) flags.push({ mute: false, solo: false });
    }
  }
}

// Changes the keys of all tracks of a doc by change(track); used to move and delete keys of a frame.
export function changeKeys(doc, change) {
  const found = [];
  eachTrack(doc, (track, path) => {
    if (isKeys(track)) found.push(path);
  });
  for (const path of found) setIn(doc, path, change(getIn(doc, path)));
}
