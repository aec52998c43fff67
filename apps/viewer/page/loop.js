// The render loop: one request in flight. While the state changes, previews of the newest state; at rest, a full picture.

import { Pace } from "./pace.js";

const restMs = 150;
const retryMs = 2000;
const wait = (ms) => new Promise((done) => setTimeout(done, ms));

export class Loop {
  // hooks: panes() lists the panes shown; changedPanes() those whose pictures the state has outdated; hasPreview(pane);
  // playing() is whether frames follow each other; prepare() awaits what a picture needs; picture(pane, quality, scale,
  // signal) asks for one and draws it; failed(error, pane) is whether to try again.
  constructor(hooks) {
    this.hooks = hooks;
    this.stale = new Set(); // panes that need a preview
    this.owed = new Set(); // panes that need a full picture
    this.jobs = [];
    this.pace = { a: new Pace(), b: new Pace() };
    this.latencies = []; // ms from an input's event to the picture that shows it, of the last 512 pictures
    this.oldestInput = null;
    this.changedAt = 0;
    this.lastPane = "b";
    this.full = null; // AbortController of the full picture in flight
    this.wake = () => {};
  }

  // The state has changed, by an event of this time stamp if any.
  changed(stamp) {
    for (const pane of this.hooks.changedPanes()) {
      this.stale.add(pane);
      this.owed.add(pane);
    }
    if (stamp !== undefined && this.oldestInput === null) this.oldestInput = stamp;
    this.changedAt = performance.now();
    this.full?.abort();
    this.wake();
  }

  // Does work that needs the server between pictures. `afterFull`: once the full picture is shown; `urgent`: at once, and
  // the full picture in flight begins anew after it.
  job(work, { afterFull = false, urgent = false } = {}) {
    return new Promise((done, fail) => {
      const job = { afterFull, work: () => work().then(done, fail) };
      if (urgent) {
        this.jobs.unshift(job);
        this.full?.abort();
      } else this.jobs.push(job);
      this.wake();
    });
  }

  // What to do now: { work, pane }, or the milliseconds to wait for.
  next() {
    const panes = this.hooks.panes();
    for (const set of [this.stale, this.owed])
      for (const pane of set) if (!panes.includes(pane)) set.delete(pane);
    for (const pane of this.stale)
      if (!this.hooks.hasPreview(pane)) {
        this.stale.delete(pane);
        if (pane === "a") this.oldestInput = null;
      }
    const job = this.jobs.findIndex((j) => !j.afterFull || (!this.stale.size && !this.owed.size));
    if (job >= 0) return this.jobs.splice(job, 1)[0];
    // Panes take turns.
    const pick = (set) =>
      panes.find((pane) => set.has(pane) && pane !== this.lastPane) ?? panes.find((pane) => set.has(pane));
    if (this.stale.size) {
      const pane = pick(this.stale);
      return { pane, work: () => this.preview(pane) };
    }
    if (this.owed.size && !this.hooks.playing()) {
      const rest = this.changedAt + restMs - performance.now();
      if (rest > 0) return rest;
      const pane = pick(this.owed);
      return { pane, work: () => this.still(pane) };
    }
    return Infinity;
  }

  async preview(pane) {
    this.stale.delete(pane);
    this.lastPane = pane;
    const stamp = pane === "a" ? this.oldestInput : null;
    if (pane === "a") this.oldestInput = null;
    const pace = this.pace[pane],
      scale = pace.scale;
    await this.hooks.prepare();
    const begun = performance.now();
    await this.hooks.picture(pane, "preview", scale);
    pace.measured(performance.now() - begun, scale);
    if (stamp === null) return;
    this.latencies.push(performance.now() - stamp);
    if (this.latencies.length > 512) this.latencies.shift();
  }

  async still(pane) {
    this.lastPane = pane;
    this.full = new AbortController();
    try {
      await this.hooks.picture(pane, "full", 1, this.full.signal);
      this.owed.delete(pane);
    } finally {
      this.full = null;
    }
  }

  async run() {
    for (;;) {
      const next = this.next();
      if (typeof next === "number") await this.sleep(next);
      else await this.perform(next);
    }
  }

  async sleep(ms) {
    let timer = 0;
    await new Promise((done) => {
      this.wake = done;
      if (ms < Infinity) timer = setTimeout(done, ms);
    });
    clearTimeout(timer);
  }

  async perform({ work, pane }) {
    try {
      await work();
    } catch (error) {
      if (error.name === "AbortError") return;
      if (await this.hooks.failed(error, pane)) {
        this.stale.add(pane);
        this.owed.add(pane);
        await wait(retryMs);
      } else {
        this.owed.delete(pane);
      }
    }
  }
}
