// Pictures: asks for one, draws it, and tells of requests that fail.

import { frameRequest, photographKey, sentPlaces, whiteOf } from "./request.js";
import { pathOfError } from "./status.js";

const wholeDoc = ["/save", "/text", "/values"]; // requests whose doc has what is muted, too

export class Pictures {
  constructor(app) {
    this.app = app;
    this.remarks = {}; // of the server, by pane: each is told once
    this.keyOfB = null; // photographKey() of the picture of pane B; null if that is no photograph
  }

  // The body of a request for a pane's picture of the present state.
  composed(pane, quality, scale) {
    const { app } = this;
    return frameRequest({
      store: app.store,
      models: app.models,
      captured: app.scene.captured(),
      lens: app.scene.lens(),
      pose: app.scene.pose(),
      stage: app.stage.pixels(),
      limits: app.limits,
      number: app.number,
      pane,
      quality,
      scale,
    });
  }

  // The request of the picture at rest of pane A, whether or not that has come.
  atRest() {
    return this.app.lastFull ?? this.composed("a", "full", 1);
  }

  // The panes whose pictures a change of the state makes stale: a photograph beside the scene stays through its edits.
  changedPanes() {
    const panes = this.app.compare.panes();
    if (!panes.includes("b") || this.keyOfB === null) return panes;
    return photographKey(this.composed("b", "full", 1)) === this.keyOfB ? ["a"] : panes;
  }

  // Asks for a pane's picture of the present state and draws it.
  async ask(pane, quality, scale, signal) {
    const { app } = this;
    ++app.number;
    const request = this.composed(pane, quality, scale),
      atRest = this.composed(pane, "full", 1);
    const model = app.models[request.model],
      begun = performance.now(),
      { blob, said } = await app.server.picture("/frame", request, signal);
    const bitmap = await createImageBitmap(blob);
    if (signal?.aborted) {
      bitmap.close();
      throw new DOMException("superseded", "AbortError");
    }
    // The first full picture's white level is kept, so that the next ones do not pump. A preview may show too
    // little of the object to choose it.
    const white = whiteOf(app.store.view, request.show),
      { view } = app.store;
    const chooses = quality === "full" && view[white] === null && !model.aovs.includes(request.show);
    if (chooses && Number.isFinite(said.white)) view[white] = said.white;
    app.stage.show(pane, bitmap);
    if (pane === "b") this.keyOfB = photographKey({ ...atRest, white: atRest.white ?? said.white });
    if (quality === "full" && pane === "a") app.lastFull = { ...request, white: view[white] };
    app.status.banner("");
    this.clearProblem(pane);
    app.compare.report(pane, said);
    if (said.remark && said.remark !== this.remarks[pane]) app.say(said.remark);
    this.remarks[pane] = said.remark;
    if (pane !== "a") return;
    app.quality.report({ said, size: request.size, ms: performance.now() - begun });
    app.viewPanel.update(bitmap, request, quality === "full");
    app.hands.show();
  }

  // Takes pane B away.
  forgetB() {
    this.keyOfB = null;
    this.clearProblem("b");
    this.app.stage.forget("b");
  }

  // Shows the error of a pane, or of "page".
  showProblem(source, text, path) {
    this.app.status.showProblem(source, text, path);
    if (source === "b") this.keyOfB = null;
    if (source !== "page") this.app.stage.showError(source, text);
  }

  clearProblem(source) {
    this.app.status.clearProblem(source);
    if (source !== "page") this.app.stage.showError(source, "");
  }

  // Tells of a failed request of a pane, or of "page"; true if it is to be tried again.
  failed(error, source) {
    const { app } = this;
    const { status } = error;
    if (status === 409) return false;
    if (status === 0) app.status.banner("The server does not answer. Trying again every 2 seconds.");
    else if (status === 429)
      app.status.banner("Too many tabs show this model. Close some; this one tries again every 2 seconds.");
    else if (status === 403)
      app.status.banner("The server does not know this page. Open the address that `surflect view` printed.");
    else if (status !== undefined) {
      const { flags } = app.store,
        places = wholeDoc.includes(error.path)
          ? {}
          : { light: sentPlaces(flags.light), warp: sentPlaces(flags.warp) };
      app.status.banner("");
      this.showProblem(source, error.message, pathOfError(error.message, places));
    } else {
      window.surflect.errors.push(String(error.stack ?? error));
      this.showProblem(source, `The page failed: ${error.message}`);
    }
    return status === 0 || status === 429;
  }

  // Tells of a request that is not for a pane's picture.
  showError(error) {
    if (error.name !== "AbortError" && this.failed(error, "page")) this.app.loop.changed();
  }
}
