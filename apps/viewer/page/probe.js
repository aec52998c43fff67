// The section "Probe": values of a pixel of the picture at rest, and the photographs blended there.

import { byId, el, openSection } from "./dom.js";
import { whyNoScene } from "./request.js";

export const looking = "Looking at this point…";
const leastWeight = 0.005; // of a photograph in the list

const number = (x) => (typeof x === "number" ? Number(x.toPrecision(5)).toString() : "–");
const text = (value) =>
  value === null || value === undefined
    ? "–"
    : Array.isArray(value)
      ? value.map(number).join("  ")
      : number(value);

export class Probe {
  constructor(app) {
    this.app = app;
    this.turn = 0; // of the newest probe; thumbnails of older ones are dropped
    this.urls = [];
    this.values = el("dl", { id: "probe-values", class: "values" });
    this.photographs = el("ol", { id: "probe-photographs", class: "photographs" });
    this.more = el("p", { class: "note", id: "probe-more" });
    this.cross = byId("probe-cross");
    this.marked = null; // { model, frame } of the cross
    byId("probe-body").append(
      el("p", {
        class: "note",
        id: "probe-note",
        text: "Probe mode (I): a click on the picture shows its values.",
      }),
      this.values,
      this.photographs,
      this.more,
    );
  }

  // Values at a place of the picture, x and y from 0 to 1: { request, probed, version of the script }. Null, and the page
  // says why, if no scene is shown. more() gives further keys of the request.
  async ask(x, y, more = () => ({})) {
    const { loop, server, timeline, store, scene, pictures } = this.app,
      why = whyNoScene(store.view, this.app.model(), scene.captured());
    if (why) {
      this.app.say(why);
      return null;
    }
    timeline.pause();
    pictures.clearProblem("page");
    this.app.say(looking);
    return loop.job(
      async () => {
        const request = pictures.atRest(),
          [width, height] = request.size,
          at = (part, n) => Math.max(0, Math.min(n - 1, Math.floor(part * n))),
          pixel = { x: at(x, width), y: at(y, height) };
        const post = () => server.post("/probe", { ...request, ...pixel, ...more() });
        // A picture that was given up can reach the server late and supersede the probe once.
        const probed = await post().catch((error) => {
          if (error.status === 409) return post();
          throw error;
        });
        return { request, pixel, version: store.version, probed };
      },
      { urgent: true },
    );
  }

  // Shows a place's values; its photographs follow.
  async show(x, y) {
    const turn = ++this.turn;
    this.unmark();
    const answer = await this.ask(x, y);
    if (turn !== this.turn || !answer) return;
    const { probed, request, pixel } = answer;
    this.mark(request, pixel);
    const rows = [["colour", probed.color], ...Object.entries(probed.aovs ?? {})];
    this.values.replaceChildren(
      ...rows.flatMap(([name, value]) => [
        el("dt", { text: name.replaceAll("_", " ") }),
        el("dd", { text: text(value), data: { probe: name } }),
      ]),
    );
    this.forget();
    const photographs = [...(probed.photographs ?? [])].sort((a, b) => b.weight - a.weight),
      heavy = photographs.filter((p) => p.weight >= leastWeight),
      rest = photographs.length - heavy.length;
    const items = heavy.map((p) => this.photograph(p));
    this.photographs.replaceChildren(...items.map((item) => item.node));
    this.more.textContent = rest
      ? `${rest} more ${rest === 1 ? "photograph has" : "photographs have"} a weight under ${leastWeight}.`
      : "";
    openSection("section-probe");
    const [red, green, blue] = probed.color ?? [];
    this.app.say(`Pixel ${pixel.x}, ${pixel.y}: linear ${[red, green, blue].map(number).join("  ")}.`);
    if (this.app.models[request.model].hasPhotographs)
      this.thumbnails(turn, request, items).catch((error) => this.app.pictures.showError(error));
  }

  photograph(p) {
    const image = el("span", { class: "thumbnail" });
    const node = el(
      "li",
      {},
      image,
      el("span", { text: `${p.camera} ${p.light ?? ""}` }),
      el("meter", { min: 0, max: 1, value: Math.min(1, p.weight), "aria-label": "weight" }),
      el("span", { class: "note", text: p.weight.toFixed(3) }),
    );
    return { p, image, node };
  }

  async thumbnails(turn, request, items) {
    for (const { p, image } of items) await this.thumbnail(turn, request, p, image);
  }

  // Puts a cross on the probed pixel, until the picture shows something else there.
  mark({ size: [width, height], model, frame }, { x, y }) {
    this.marked = { model, frame };
    Object.assign(this.cross.style, {
      left: `${(100 * (x + 0.5)) / width}%`,
      top: `${(100 * (y + 0.5)) / height}%`,
    });
    this.cross.hidden = false;
  }

  unmark() {
    this.cross.hidden = true;
  }

  // The state has changed; what changes only how the picture is shown leaves the cross there.
  changed(what) {
    const { model, frame } = this.app.store.view;
    if (what !== "view" || model !== this.marked?.model || frame !== this.marked.frame) this.unmark();
  }

  // Thumbnails come one after another, between pictures.
  async thumbnail(turn, request, { camera, light, x, y }, place) {
    await this.app.loop.job(
      async () => {
        if (turn !== this.turn) return;
        const { blob } = await this.app.server.picture("/thumbnail", {
          model: request.model,
          camera,
          light,
          x,
          y,
          ...(Number.isFinite(request.white) ? { white: request.white } : {}),
        });
        const src = URL.createObjectURL(blob);
        this.urls.push(src);
        const alt = `Photograph of ${camera} under ${light || "fixed light"}`;
        place.append(el("img", { width: 48, height: 48, alt, src }));
      },
      { afterFull: true },
    );
  }

  forget() {
    for (const url of this.urls) URL.revokeObjectURL(url);
    this.urls = [];
  }
}
