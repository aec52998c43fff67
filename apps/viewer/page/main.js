// The viewer's page: opens the server's script and model, and joins the picture, the panel and the timeline.

import { CameraPanel } from "./camera_panel.js";
import { dollied, flown, looked, orbited, panned, poseOfModel } from "./camera.js";
import { ComparePanel } from "./compare.js";
import { byId, fillSelect, openSection, setPressed } from "./dom.js";
import { Film } from "./film.js";
import { finishOf } from "./finish.js";
import { checksum, decode, difference, readFragment, writeFragment } from "./fragment.js";
import { Hands } from "./hands.js";
import { Keys } from "./keys.js";
import { LampsPanel } from "./lamps_panel.js";
import { Loop } from "./loop.js";
import { Pictures } from "./pictures.js";
import { looking, Probe } from "./probe.js";
import { QualityPanel } from "./quality.js";
import { cameraOfPose, isScore, layerOfA, pictureShape, sentPlaces } from "./request.js";
import { restored } from "./restored.js";
import { Rig } from "./rig.js";
import { Scene } from "./scene.js";
import { Server } from "./server.js";
import { Stage } from "./stage.js";
import { Store } from "./state.js";
import { Status, followEvents } from "./status.js";
import { Timeline } from "./timeline.js";
import { ViewPanel } from "./view_panel.js";
import { WarpsPanel } from "./warps_panel.js";

const bench = (window.surflect = { latencies: [], errors: [], inFlight: 0, mostInFlight: 0 });
addEventListener("error", (event) => bench.errors.push(String(event.message)));
addEventListener("unhandledrejection", (event) =>
  bench.errors.push(String(event.reason?.stack ?? event.reason)),
);

const panelMs = 100; // between refreshes of the panel at least

const wait = (ms) => new Promise((done) => setTimeout(done, ms));

// The view at first: the shot, or where there is none the whole object.
function firstView(start) {
  const model = start.models[0],
    { doc } = start;
  const camera =
    model.method === "capture"
      ? { kind: "captured", name: model.cameras[0]?.name }
      : doc.camera
        ? { kind: "shot" }
        : { kind: "free", pose: poseOfModel(model) };
  return {
    model: 0,
    frame: doc.frames?.first ?? 0,
    camera,
    show: model.method === "capture" ? "photograph" : "color",
    light: null,
    overlay: false,
    exposure: 0,
    white: null,
    photographWhite: null,
    tone: "none",
    background: [0.16, 0.16, 0.17],
    shape: start.isScript ? "film" : "window",
    preset: "full",
    options: {},
    loop: true,
    compare: { kind: "off", model: 0, options: {}, preset: "preview", match: true, split: 0.5, side: null },
  };
}

class App {
  // `state` is that of the address: undefined if there is none, null if it is damaged.
  constructor(server, start, status, state) {
    Object.assign(this, { server, start, status, limits: start.limits, models: start.models });
    this.store = new Store(start.doc, firstView(start));
    if (state !== undefined) this.restore(state);
    this.refreshed = -Infinity;
    this.mode = "turn";
    this.selectedLamp = -1;
    this.number = 0;
    this.lastFull = null; // request of the picture at rest of pane A, in the chosen preset; null until that is shown
    this.scene = new Scene(this.store, server, () => this.model());
    this.pictures = new Pictures(this);
    this.loop = new Loop({
      panes: () => this.compare.panes(),
      changedPanes: () => this.pictures.changedPanes(),
      playing: () => this.timeline.playing,
      hasPreview: (pane) =>
        pane === "b" || !isScore(layerOfA(this.store.view, this.model(), this.scene.captured())),
      prepare: async () => {
        if (await this.scene.prepare()) this.changed("page");
      },
      picture: (...request) => this.pictures.ask(...request),
      failed: (error, pane) => this.pictures.failed(error, pane),
    });
    this.camera = new CameraPanel(this);
    this.lamps = new LampsPanel(this);
    this.warps = new WarpsPanel(this);
    this.viewPanel = new ViewPanel(this);
    this.quality = new QualityPanel(this);
    this.compare = new ComparePanel(this);
    this.probe = new Probe(this);
    this.timeline = new Timeline(this);
    this.film = new Film(this);
    this.rig = new Rig(this, {
      snap: (name) => this.camera.snap(name),
      select: (lamp) => this.hands.select({ kind: "lamp", index: lamp }),
      move: (lamp, place, event) => this.hands.moveLamp(lamp, place, event.timeStamp),
      ended: () => this.store.endGesture(),
      resized: () => {
        this.hands.measure();
        this.hands.show();
      },
    });
    this.keys = new Keys(this);
    this.stage = new Stage({
      background: () => finishOf(this.store, "background"),
      shape: () => pictureShape(this.store, this.scene.lens(), this.stagePixels()),
      resized: () => {
        this.probe.unmark();
        this.hands.measure();
        this.hands.show();
        this.loop.changed();
      },
      drag: (kind, dx, dy, event) => this.moveCamera(kind, dx, dy, event.timeStamp),
      wheel: (factor, event) => this.dolly(factor, event.timeStamp),
      clicked: (x, y) => this.clicked(x, y),
    });
    this.hands = new Hands(this);
    this.store.listen((what, stamp) => this.changed(what, stamp));
    this.listenHeader();
    bench.latencies = this.loop.latencies;
    Object.defineProperties(bench, {
      inFlight: { get: () => server.inFlight },
      mostInFlight: { get: () => server.mostInFlight },
    });
    Object.assign(bench, { app: this });
    this.changed("view");
    this.loop.run();
    followEvents(server, (event) => this.film.heard(event));
  }

  model() {
    return this.models[this.store.view.model] ?? this.models[0];
  }
  say(text) {
    this.status.say(text);
  }
  stagePixels() {
    return { width: byId("stage").clientWidth, height: byId("stage").clientHeight };
  }

  // Something has changed: what the picture shows ("doc", "view", "camera", "frame") or only the page ("page").
  changed(what, stamp) {
    if (what === "camera" || what === "view") this.viewPanel.keepLight();
    if (what !== "page") {
      this.lastFull = null;
      this.probe.changed(what);
      this.pictures.clearProblem("page");
      this.loop.changed(stamp);
    }
    if (this.refreshing) return;
    this.refreshing = true;
    // Panel and rig follow a drag at leisure, as they take time from the pictures.
    const rest = panelMs - (performance.now() - this.refreshed);
    setTimeout(
      () =>
        requestAnimationFrame(() => {
          this.refreshing = false;
          this.refreshed = performance.now();
          this.refresh();
        }),
      Math.max(0, rest),
    );
    clearTimeout(this.writing);
    this.writing = setTimeout(() => this.remember(), 400);
  }

  refresh() {
    const { store, stage } = this;
    for (const part of [
      this.camera,
      this.lamps,
      this.warps,
      this.viewPanel,
      this.quality,
      this.compare,
      this.timeline,
    ])
      part.refresh();
    const split = this.compare.split(),
      moved = split !== stage.split;
    stage.split = split;
    if (split === null && (stage.pictures.b || this.status.problems.has("b"))) this.pictures.forgetB();
    stage.layout();
    if (moved) stage.draw();
    this.hands.measure();
    this.hands.show();
    this.rig.draw();
    byId("undo").disabled = !store.past.length;
    byId("redo").disabled = !store.future.length;
    const model = this.model();
    byId("title").textContent = this.models.length > 1 ? "Surflect" : model.name;
    byId("method").textContent = [model.title ?? model.method, model.title ? model.method : null]
      .filter(Boolean)
      .join(" · ");
    byId("method").title = model.paper ?? "";
    fillSelect(
      byId("model"),
      this.models.map((m, i) => [String(i), m.name]),
      String(store.view.model),
    );
    byId("model").hidden = this.models.length < 2;
    byId("timeline").hidden = model.method === "capture";
    byId("mode-handle").disabled = !model.deforms;
    byId("mode-fly").disabled = model.method === "capture";
    for (const id of ["save", "snapshot", "copy-command", "record"])
      byId(id).disabled = model.method === "capture";
    if (!this.start.canRecord) byId("record").disabled = true;
  }

  // ---- the camera on the picture

  moveCamera(kind, dx, dy, stamp) {
    const pose = this.scene.pose(),
      { up } = this.model(),
      k = Math.PI;
    if (kind === "pan") this.camera.free(panned(pose, dx, dy), stamp);
    else if (this.mode === "fly") this.camera.free(looked(pose, up, (-dx * k) / 3, (-dy * k) / 3), stamp);
    else this.camera.free(orbited(pose, up, -dx * k, dy * k), stamp);
  }

  dolly(factor, stamp) {
    this.camera.free(dollied(this.scene.pose(), factor), stamp);
  }

  fly(direction, seconds, stamp) {
    const speed = 0.8 * this.model().radius * seconds;
    this.camera.free(
      flown(
        this.scene.pose(),
        direction.map((x) => x * speed),
      ),
      stamp,
    );
  }

  // Turns a mode on; the same again turns it off.
  setMode(mode) {
    this.mode = mode === this.mode ? "turn" : mode;
    if (this.mode === "handle" && !this.model().deforms) {
      this.say(`This model cannot be bent: ${this.model().why}.`);
      this.mode = "turn";
    }
    for (const name of ["turn", "fly", "handle", "probe"])
      setPressed(byId(`mode-${name}`), name === this.mode);
    byId("picture").dataset.mode = this.mode;
    const hint = {
      fly: "W A S D moves, Q and E sink and rise, drag looks around.",
      probe: "Click the picture to see its values.",
      handle: "Click the object to add a handle; drag handles to bend it.",
    }[this.mode];
    if (hint) this.say(hint);
  }

  // A click on the picture, in the modes that have a use for it.
  clicked(x, y) {
    if (this.mode === "probe") this.look(() => this.probe.show(x, y));
    else if (this.mode === "handle") this.look(() => this.addHandle(x, y));
  }

  // Does what a click asks of the server; further clicks are ignored until that has answered.
  async look(work) {
    if (this.isLooking) return;
    this.isLooking = true;
    byId("picture").dataset.busy = "";
    try {
      await work();
    } catch (error) {
      this.pictures.showError(error);
    }
    this.isLooking = false;
    delete byId("picture").dataset.busy;
    if (this.status.message === looking) this.say("");
  }

  async addHandle(x, y) {
    if (!this.model().aovs.includes("rest"))
      return this.say('This model has no layer "rest", which handles need.');
    const answer = await this.probe.ask(x, y, () => ({ before: this.warps.handlesPlace().sent }));
    if (answer) this.warps.addHandle(answer);
  }

  // Whether a lamp is neither muted nor left out by the solo of another.
  isLit(index) {
    return sentPlaces(this.store.flags.light).includes(index);
  }

  // ---- header, panel, address

  listenHeader() {
    byId("undo").addEventListener("click", () => this.undo());
    byId("redo").addEventListener("click", () => this.redo());
    byId("panel-toggle").addEventListener("click", () => this.togglePanel());
    byId("model").addEventListener("change", (event) => this.chooseModel(Number(event.target.value)));
    for (const mode of ["turn", "fly", "handle", "probe"])
      byId(`mode-${mode}`).addEventListener("click", () => this.setMode(mode === "turn" ? "turn" : mode));
    for (const link of document.querySelectorAll("#panel-links button"))
      link.addEventListener("click", () => {
        openSection(link.dataset.section);
        byId(link.dataset.section).querySelector("summary").focus({ preventScroll: true });
      });
    // Opened sections catch up.
    for (const section of document.querySelectorAll("details.section"))
      section.addEventListener("toggle", () => {
        if (section.open) this.viewPanel.drawHistogram();
      });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.rig.draw());
  }

  chooseModel(index) {
    const changes = { model: index };
    if (
      !this.models[index].cameras.some((c) => c.name === this.store.view.camera.name) &&
      this.scene.captured()
    )
      changes.camera = { kind: "free", pose: cameraOfPose(this.scene.pose()) };
    this.store.setView(changes);
  }

  undo() {
    if (!this.store.undo()) this.say("There is nothing to undo.");
  }
  redo() {
    if (!this.store.redo()) this.say("There is nothing to redo.");
  }

  togglePanel() {
    const shown = !document.body.classList.toggle("no-panel");
    setPressed(byId("panel-toggle"), shown);
  }

  // Writes the state into the address, so that a reload brings it back.
  remember() {
    const { store, start } = this;
    writeFragment({
      c: checksum(start.doc),
      d: difference(start.doc, store.doc),
      f: store.flags,
      v: store.view,
    });
  }

  // Takes the state of the address, null where that is damaged.
  restore(state) {
    const { store } = this;
    try {
      const { isOutdated, ...own } = restored(state, this.start, store.view);
      Object.assign(store, own);
      store.matchFlags();
      if (isOutdated) this.say("The script has changed; edits in the address are left out.");
    } catch (error) {
      this.say(`The address holds a state that does not fit this page (${error.message}); it is left out.`);
    }
  }
}

// Lets the server forget the tab when the page goes away, and begins anew if it comes back from the browser's cache. An
// address put into the same tab is opened as in a fresh one.
function followTab(server, app) {
  addEventListener("pagehide", () => server.leave());
  addEventListener("pageshow", (event) => {
    if (!event.persisted) return;
    server.comeBack();
    app.changed("view");
  });
  addEventListener("hashchange", () => location.reload());
}

// Opens the script; tries again while the server does not answer.
async function open() {
  const fragment = readFragment(),
    server = new Server(fragment.get("token")),
    status = new Status();
  const state = fragment.has("s") ? decode(fragment.get("s")) : undefined;
  if (fragment.has("token")) writeFragment(state);
  for (;;) {
    try {
      const start = await server.start();
      status.banner("");
      document.title = `${start.models[0]?.name ?? "Surflect"} – Surflect`;
      const app = new App(server, start, status, state);
      followTab(server, app);
      return app;
    } catch (error) {
      if (!("status" in error)) throw error;
      status.banner(
        error.status === 403
          ? "The server does not know this page. Open the address that `surflect view` printed."
          : `${error.status === 0 ? "The server does not answer" : error.message}. Trying again every 2 seconds.`,
      );
      if (error.status === 403) return null;
      await wait(2000);
    }
  }
}

open();
