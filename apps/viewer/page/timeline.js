// The timeline: scrubbing, playing, and the keyframes of all tracks as diamonds.

import { byId, el, setPressed } from "./dom.js";
import { changeKeys } from "./state.js";
import {
  isSmoothAt,
  getIn,
  keyFrames,
  parseTyped,
  withKeyMoved,
  withoutKey,
  withSmoothSwitched,
} from "./tracks.js";

// The frame to show after playing for some seconds from `start`: frames are dropped, never queued.
export function playedFrame(start, seconds, { first, last, fps }, loops) {
  const passed = start - first + Math.floor(seconds * fps),
    n = last - first + 1;
  if (passed < n) return { frame: first + passed, ended: false };
  return loops ? { frame: first + (passed % n), ended: false } : { frame: last, ended: true };
}

const part = { light: "lamp", warp: "warp", camera: "camera" };
const pathName = ([kind, index, ...rest]) =>
  kind === "camera"
    ? `camera ${index}`
    : `${part[kind]} ${index + 1} ${rest.filter((k) => typeof k === "string").join(" ")}`;

export class Timeline {
  constructor(app) {
    this.app = app;
    this.playing = false;
    this.builtKeys = "";
    byId("play").addEventListener("click", () => this.togglePlay());
    byId("previous-frame").addEventListener("click", () => this.step(-1));
    byId("next-frame").addEventListener("click", () => this.step(1));
    byId("loop").addEventListener("click", () =>
      app.store.setView({ loop: !app.store.view.loop }, undefined, "page"),
    );
    byId("delete-key").addEventListener("click", () => this.deleteKeys(app.store.view.frame));
    byId("smooth-key").addEventListener("click", () => this.switchSmooth());
    this.numberField(
      "frame",
      () => app.store.view.frame,
      (n) => this.go(n),
      { least: 0, whole: true },
    );
    this.numberField(
      "first",
      () => this.frames().first,
      (n) => this.setFrames({ first: n }),
      { least: 0, whole: true },
    );
    this.numberField(
      "last",
      () => this.frames().last,
      (n) => this.setFrames({ last: n }),
      { least: 0, whole: true },
    );
    this.numberField(
      "fps",
      () => this.frames().fps,
      (n) => this.setFrames({ fps: n }),
      { least: 0.1, most: 240 },
    );
    this.listenScrub();
  }

  frames() {
    return { first: 1, last: 1, fps: 24, ...this.app.store.doc.frames };
  }

  numberField(id, value, put, limits) {
    const field = byId(id);
    this.fields = { ...this.fields, [id]: value };
    field.addEventListener("change", () => {
      const typed = parseTyped(field.value, false, limits);
      if (typed.error) {
        field.setAttribute("aria-invalid", "true");
        return this.app.say(`${id}: ${typed.error}.`);
      }
      field.removeAttribute("aria-invalid");
      put(typed.value);
    });
  }

  setFrames(changes) {
    const frames = { ...this.frames(), ...changes };
    if (frames.first > frames.last) {
      this.app.say("The first frame must not come after the last one.");
      return this.refresh();
    }
    this.app.store.edit((doc) => {
      doc.frames = frames;
    });
    this.go(this.app.store.view.frame);
  }

  // Shows a frame, kept inside of the film.
  go(frame, stamp) {
    const { first, last } = this.frames(),
      { store } = this.app;
    const kept = Math.max(first, Math.min(last, Math.round(frame)));
    if (kept !== store.view.frame) store.setView({ frame: kept }, stamp, "frame");
  }

  step(by) {
    this.pause();
    this.go(this.app.store.view.frame + by);
  }

  // The next or previous frame with a key.
  stepKey(by) {
    const now = this.app.store.view.frame,
      frames = [...keyFrames(this.app.store.doc).keys()];
    const to = by > 0 ? frames.find((f) => f > now) : frames.filter((f) => f < now).pop();
    if (to !== undefined) this.go(to);
  }

  togglePlay() {
    return this.playing ? this.pause() : this.play();
  }

  play() {
    const { store } = this.app,
      { first, last } = this.frames();
    if (first === last) return this.app.say("The film has only one frame.");
    const start = store.view.frame >= last && !store.view.loop ? first : store.view.frame,
      begun = performance.now();
    this.playing = true;
    const tick = () => {
      if (!this.playing) return;
      const { frame, ended } = playedFrame(
        start,
        (performance.now() - begun) / 1000,
        this.frames(),
        store.view.loop,
      );
      this.go(frame);
      if (ended) this.pause();
      else requestAnimationFrame(tick);
    };
    tick();
    this.refresh();
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.refresh();
    this.app.loop.changed();
  }

  deleteKeys(frame) {
    if (!keyFrames(this.app.store.doc).has(frame)) return this.app.say(`Frame ${frame} has no keys.`);
    this.app.store.edit((doc) => changeKeys(doc, (track) => withoutKey(track, frame)));
  }

  moveKeys(from, to) {
    this.app.store.edit((doc) => changeKeys(doc, (track) => withKeyMoved(track, from, to)), {
      gesture: "move-key",
    });
  }

  switchSmooth() {
    const { frame } = this.app.store.view,
      paths = keyFrames(this.app.store.doc).get(frame) ?? [];
    if (!paths.length) return this.app.say(`Frame ${frame} has no keys.`);
    const smooth = !paths.every((path) => isSmoothAt(getIn(this.app.store.doc, path), frame));
    this.app.store.edit((doc) =>
      changeKeys(doc, (track) =>
        isSmoothAt(track, frame) === smooth ? track : withSmoothSwitched(track, frame),
      ),
    );
  }

  // The frame under a place of the track.
  frameAt(clientX) {
    const box = byId("diamonds").getBoundingClientRect(),
      { first, last } = this.frames();
    return Math.max(
      first,
      Math.min(last, Math.round(first + ((clientX - box.left) / box.width) * (last - first))),
    );
  }

  listenScrub() {
    const scrub = byId("scrub");
    let down = false;
    scrub.addEventListener("pointerdown", (event) => {
      down = true;
      scrub.setPointerCapture(event.pointerId);
      this.pause();
      this.go(this.frameAt(event.clientX), event.timeStamp);
    });
    scrub.addEventListener("pointermove", (event) => {
      if (down) this.go(this.frameAt(event.clientX), event.timeStamp);
    });
    for (const type of ["pointerup", "pointercancel"])
      scrub.addEventListener(type, () => {
        down = false;
      });
    scrub.addEventListener("keydown", (event) => {
      const { first, last } = this.frames(),
        now = this.app.store.view.frame;
      const to = {
        ArrowLeft: now - 1,
        ArrowRight: now + 1,
        ArrowDown: now - 1,
        ArrowUp: now + 1,
        Home: first,
        End: last,
        PageUp: now + 10,
        PageDown: now - 10,
      }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      this.pause();
      this.go(to, event.timeStamp);
    });
  }

  diamond(frame, paths, at) {
    let from = null,
      moved = false;
    const names = [...new Set(paths.map(pathName))].join(", ");
    const node = el("button", {
      type: "button",
      class: "diamond",
      "aria-label": `Keys at frame ${frame}: ${names}`,
      title: `Frame ${frame}: ${names}. Drag to move, Delete to delete.`,
      data: { keyFrame: frame },
      on: {
        click: () => {
          if (!moved) this.go(frame);
        },
        pointerdown: (event) => {
          [from, moved] = [frame, false];
          node.setPointerCapture(event.pointerId);
        },
        pointermove: (event) => {
          if (from === null) return;
          const to = this.frameAt(event.clientX);
          if (to !== frame) moved = true;
          node.style.left = this.percent(to);
        },
        pointerup: (event) => {
          const to = this.frameAt(event.clientX);
          if (moved && to !== from) this.moveKeys(from, to);
          from = null;
          this.app.store.endGesture();
        },
        keydown: (event) => {
          if (event.key === "Delete" || event.key === "Backspace") this.deleteKeys(frame);
        },
      },
    });
    node.style.left = at;
    return node;
  }

  percent(frame) {
    const { first, last } = this.frames();
    return `${(100 * (frame - first)) / Math.max(1, last - first)}%`;
  }

  refresh() {
    const { store } = this.app,
      { first, last } = this.frames(),
      { frame } = store.view;
    for (const [id, value] of Object.entries(this.fields))
      if (document.activeElement !== byId(id) || !byId(id).hasAttribute("aria-invalid"))
        byId(id).value = value();
    setPressed(byId("play"), this.playing);
    byId("play").textContent = this.playing ? "Pause" : "Play";
    setPressed(byId("loop"), store.view.loop);
    const scrub = byId("scrub");
    scrub.setAttribute("aria-valuemin", first);
    scrub.setAttribute("aria-valuemax", last);
    scrub.setAttribute("aria-valuenow", frame);
    byId("playhead").style.left = this.percent(frame);
    const keys = keyFrames(store.doc),
      here = keys.get(frame) ?? [];
    byId("delete-key").disabled = byId("smooth-key").disabled = !here.length;
    setPressed(
      byId("smooth-key"),
      here.length && here.every((path) => isSmoothAt(getIn(store.doc, path), frame)),
    );
    const built = JSON.stringify([first, last, ...keys]);
    if (built === this.builtKeys) return;
    this.builtKeys = built;
    byId("diamonds").replaceChildren(
      ...[...keys]
        .filter(([f]) => f >= first && f <= last)
        .map(([f, paths]) => this.diamond(f, paths, this.percent(f))),
    );
  }
}
