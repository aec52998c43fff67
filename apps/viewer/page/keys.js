// The keys of the page, and the dialog that lists them.

import { byId, el } from "./dom.js";
import { finishOf, mostStops, setFinish } from "./finish.js";

const step = 1 / 36; // of the picture's height, as a drag: 5 degrees

// Rows of [keys, what they do, action]; keys are as KeyboardEvent.key, letters in lower case.
function table(app) {
  const { camera, timeline, film, compare, store } = app;
  const move = (dx, dy) => (event) =>
    app.moveCamera(event.shiftKey ? "pan" : "turn", dx, dy, event.timeStamp);
  const stepExposure = (stops) => {
    const most = mostStops(store);
    setFinish(store, "exposure", Math.max(-most, Math.min(most, finishOf(store, "exposure") + stops)));
  };
  return [
    [["arrowleft"], "turn the camera to the left (Shift shifts)", move(step, 0)],
    [["arrowright"], "turn to the right", move(-step, 0)],
    [["arrowup"], "turn up", move(0, step)],
    [["arrowdown"], "turn down", move(0, -step)],
    [["+", "="], "nearer", (event) => app.dolly(1 / 1.1, event.timeStamp)],
    [["-"], "farther", (event) => app.dolly(1.1, event.timeStamp)],
    [["home"], "show the whole object", () => camera.home()],
    [["c"], "next captured camera (Shift: previous)", (event) => camera.step(event.shiftKey ? -1 : 1)],
    [["t"], "look through the shot's camera", () => camera.shot()],
    [["k"], "key the shot's camera here", () => camera.keyShot()],
    [[" "], "play or pause", () => timeline.togglePlay()],
    [["["], "previous frame", () => timeline.step(-1)],
    [["]"], "next frame", () => timeline.step(1)],
    [["{"], "previous key", () => timeline.stepKey(-1)],
    [["}"], "next key", () => timeline.stepKey(1)],
    [["f"], "fly: W A S D move, Q E sink and rise, drag looks around", () => app.setMode("fly")],
    [["h"], "handle: a click on the object adds a handle", () => app.setMode("handle")],
    [["i"], "probe: a click shows the pixel's values", () => app.setMode("probe")],
    [["escape"], "back to orbit", () => app.setMode("turn")],
    [["b"], "show A, B, or both", () => compare.toggleSide()],
    [["x"], "show the error to the photograph", () => compare.showError()],
    [["r"], "enlarge the rig", () => app.rig.toggleSize()],
    [["p"], "show or hide the panel", () => app.togglePanel()],
    [["0"], "exposure 0", () => setFinish(store, "exposure", 0)],
    [[","], "half a stop darker", () => stepExposure(-0.5)],
    [
      ["."],
      "half a stop brighter",
      () => stepExposure(0.5),
    ],
    [["ctrl+z"], "undo", () => app.undo()],
    [["ctrl+y", "ctrl+shift+z"], "redo", () => app.redo()],
    [["ctrl+s"], "save the script", () => film.save()],
    [["?"], "list the keys", () => byId("help-dialog").showModal()],
  ];
}

const signs = {
  arrowleft: "←",
  arrowright: "→",
  arrowup: "↑",
  arrowdown: "↓",
  " ": "Space",
  "ctrl+z": "Ctrl+Z",
  "ctrl+y": "Ctrl+Y",
  "ctrl+s": "Ctrl+S",
  escape: "Esc",
  home: "Home",
};
const markerKeys = [
  ["← ↑ → ↓", "on a marker: move the lamp or handle"],
  ["+ −", "on a lamp's marker: change its distance"],
  ["Delete", "on a marker or a key: delete it"],
];

// Keys that a control takes for itself.
function typesHere(event) {
  const { target } = event;
  if (target.closest?.("dialog")) return true;
  if (target.matches?.("input[type=text], textarea, select")) return true;
  if (target.matches?.("input[type=range]")) return /^(Arrow|Home|End|Page)/.test(event.key);
  return target.matches?.("button, summary, input") && (event.key === " " || event.key === "Enter");
}

export class Keys {
  constructor(app) {
    this.app = app;
    this.rows = table(app);
    this.held = new Set(); // keys of flying
    const actions = new Map(this.rows.flatMap(([keys, , action]) => keys.map((key) => [key, action])));
    document.addEventListener("keydown", (event) => {
      const ctrl = event.ctrlKey || event.metaKey,
        key = event.key.toLowerCase();
      const name = ctrl ? `ctrl+${event.shiftKey ? "shift+" : ""}${key}` : key;
      if (typesHere(event) && !(ctrl && key === "s")) return;
      if (!ctrl && !event.altKey && app.mode === "fly" && "wasdqe".includes(key)) {
        event.preventDefault();
        return this.fly(key, event.timeStamp);
      }
      const action = event.altKey ? undefined : actions.get(name);
      if (!action) return;
      event.preventDefault();
      action(event);
    });
    document.addEventListener("keyup", (event) => this.held.delete(event.key.toLowerCase()));
    addEventListener("blur", () => this.held.clear());
    byId("help").addEventListener("click", () => byId("help-dialog").showModal());
    byId("help-close").addEventListener("click", () => byId("help-dialog").close());
    const listed = [
      ...this.rows.map(([keys, what]) => [signs[keys[0]] ?? keys[0].toUpperCase(), what]),
      ...markerKeys,
    ];
    byId("help-keys").append(
      el(
        "dl",
        {},
        ...listed.map(([keys, what]) =>
          el("div", {}, el("dt", {}, el("kbd", { text: keys })), el("dd", { text: what })),
        ),
      ),
    );
  }

  // Moves while keys are held, by the time that passes.
  fly(key, stamp) {
    const resting = !this.held.size;
    this.held.add(key);
    if (!resting) return;
    let last = performance.now();
    const tick = (now) => {
      if (!this.held.size || this.app.mode !== "fly") return this.held.clear();
      const seconds = Math.min(0.1, Math.max(0, now - last) / 1000),
        is = (k) => Number(this.held.has(k));
      last = now;
      this.app.fly([is("d") - is("a"), is("e") - is("q"), is("w") - is("s")], seconds, stamp);
      stamp = undefined;
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }
}
