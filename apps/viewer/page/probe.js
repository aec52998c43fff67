// The section "Probe": values of a pixel of the picture at rest, and the photographs blended there.

import { byId, el } from "./dom.js";
import { whyNoScene } from "./request.js";

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
    byId("probe-body").append(
      el("p", {
        class: "note",
        id: "probe-note",
        text: "Probe mode (I): a click on the picture shows its values.",
      }),
      this.values,
      this.photographs,
    );
  }

  // Values at a place of the picture, x and y from 0 to 1: { request, probed, version of the script }. Null, and the page
  // says why, if no scene is shown. more() gives further keys of the request.
  async ask(x, y, more = () => ({})) {
    const { loop, server, timeline, store, scene } = this.app,
      why = whyNoScene(store.view, this.app.model(), scene.captured());
    if (why) {
      this.app.say(why);
      return null;
    }
    timeline.pause();
    this.app.pictures.clearProblem("page");
    return loop.job(
      async () => {
        const request = this.app.lastFull;
        if (!request) {
          this.app.say("There is no picture to probe.");
          return null;
        }
        const [width, height] = request.size,
          at = (part, n) => Math.max(0, Math.min(n - 1, Math.floor(part * n)));
        return {
          request,
          version: store.version,
          probed: await server.post("/probe", { ...request, x: at(x, width), y: at(y, height), ...more() }),
        };
      },
      { afterFull: true },
    );
  }

  async show(x, y) {
    const turn = ++this.turn,
      answer = await this.ask(x, y);
    if (turn !== this.turn || !answer) return;
    const { probed, request } = answer;
    byId("section-probe").open = true;
    const rows = [["colour", probed.color], ...Object.entries(probed.aovs ?? {})];
    this.values.replaceChildren(
      ...rows.flatMap(([name, value]) => [
        el("dt", { text: name.replaceAll("_", " ") }),
        el("dd", { text: text(value), data: { probe: name } }),
      ]),
    );
    this.forget();
    const photographs = [...(probed.photographs ?? [])].sort((a, b) => b.weight - a.weight);
    const items = photographs.map((p) => {
      const image = el("span", { class: "thumbnail" });
      return {
        p,
        image,
        node: el(
          "li",
          {},
          image,
          el("span", { text: `${p.camera} ${p.light ?? ""}` }),
          el("meter", { min: 0, max: 1, value: Math.min(1, p.weight), "aria-label": "weight" }),
          el("span", { class: "note", text: p.weight.toFixed(3) }),
        ),
      };
    });
    this.photographs.replaceChildren(...items.map((item) => item.node));
    if (!this.app.models[request.model].hasPhotographs) return;
    for (const { p, image } of items) await this.thumbnail(turn, request, p, image);
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
