// What leaves the page: saving the script, snapshots, films, and the script's text and command.

import { byId } from "./dom.js";
import { sentPlaces, whyNoScene } from "./request.js";
import { parseTyped } from "./tracks.js";
import { tidy } from "./vec.js";

async function copied(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}

export function timeLeft(seconds) {
  if (!Number.isFinite(seconds)) return "";
  return seconds < 90 ? `${Math.ceil(seconds)} s left` : `${Math.ceil(seconds / 60)} min left`;
}

// What is left out of the picture, as "the 3 lamps and the warp that are muted here"; "" if nothing is. `model` is that of
// a picture, null for the script itself.
export function mutedText({ flags }, model) {
  const words = { light: ["lamp", "lamps"], warp: ["warp", "warps"] };
  const counts = ["light", "warp"]
    .filter((part) => model === null || (part === "light" ? model.relights : model.deforms))
    .map((part) => [words[part], flags[part].length - sentPlaces(flags[part]).length])
    .filter(([, n]) => n > 0);
  const all = counts.reduce((sum, [, n]) => sum + n, 0);
  if (!all) return "";
  const list = counts.map(([[one, many], n]) => (n === 1 ? `the ${one}` : `the ${n} ${many}`)).join(" and ");
  return `${list} that ${all === 1 ? "is" : "are"} muted here`;
}

const plural = (n, word) => `${n} ${word}${n === 1 ? "" : "s"}`;

export class Film {
  constructor(app) {
    this.app = app;
    this.recording = false;
    this.frames = 0; // of the film that is recorded
    const on = (id, action) => byId(id).addEventListener("click", () => action.call(this));
    on("save", this.save);
    on("snapshot", this.snapshot);
    on("record", this.openRecord);
    on("record-start", this.record);
    on("record-stop", this.stop);
    on("record-close", () => byId("record-dialog").close());
    on("copy-command", this.copyCommand);
    on("show-script", this.showText);
    on("text-close", () => byId("text-dialog").close());
    on("text-copy", async () =>
      this.app.say(
        (await copied(byId("text-body").textContent))
          ? "The script is copied."
          : "The browser does not let the page copy; select the text instead.",
      ),
    );
  }

  // Asks the server between pictures; errors go to the status line.
  async ask(work, options) {
    this.app.pictures.clearProblem("page");
    try {
      return await this.app.loop.job(work, options);
    } catch (error) {
      this.app.pictures.showError(error);
      return null;
    }
  }

  async save() {
    const { server, start } = this.app,
      doc = structuredClone(this.app.store.doc),
      muted = mutedText(this.app.store, null);
    const saved = await this.ask(() =>
      server.post("/save", { doc, saves: start.saves }).catch((error) => {
        throw this.explained(error);
      }),
    );
    if (!saved) return;
    // A reload starts from what was saved, whatever has been edited since.
    start.doc = doc;
    start.saves = saved.saves;
    this.app.remember();
    const all = muted && `, with ${muted}`;
    this.app.say(
      saved.changed
        ? `Saved ${saved.path}${all}: ${plural(saved.changed, "line")} changed.`
        : `${saved.path} was up to date${all}.`,
    );
  }

  // An error of Save. Where another page has saved since, the next Save overwrites that.
  explained(error) {
    const { start } = this.app,
      saves = error.said?.saves;
    if (error.status === 422 && saves !== undefined && saves !== start.saves) {
      start.saves = saves;
      error.message =
        "Another page has saved the script since. Press Save again to overwrite that page's edits with those here.";
    }
    return error;
  }

  // Says why there is no scene to write, if there is none.
  lacksScene() {
    const { store, scene } = this.app,
      why = whyNoScene(store.view, this.app.model(), scene.captured());
    if (why) this.app.say(why);
    return why !== null;
  }

  // ", without the lamp that is muted here", of pictures that are written; or "".
  lacking() {
    const muted = mutedText(this.app.store, this.app.model());
    return muted && `, without ${muted}`;
  }

  async snapshot() {
    if (this.lacksScene()) return null;
    const lacking = this.lacking();
    this.app.timeline.pause();
    const answer = await this.ask(
      () =>
        this.app.lastFull
          ? this.app.server.post("/snapshot", { ...this.app.lastFull, quality: "full" })
          : Promise.resolve(null),
      { afterFull: true },
    );
    if (!answer) return null;
    this.app.say(`Wrote ${answer.files.join(", ")}${lacking}.`);
    return { ...answer, lacking };
  }

  // A snapshot's command renders this view again.
  async copyCommand() {
    const answer = await this.snapshot();
    if (!answer) return;
    const done = await copied(answer.command);
    this.showDialog("Command", answer.command);
    this.app.say(
      `${done ? "The command is copied" : "The command is shown to be selected and copied"}${answer.lacking}.`,
    );
  }

  async showText() {
    const answer = await this.ask(() => this.app.server.post("/text", { doc: this.app.store.doc }));
    if (answer) this.showDialog("Script", answer.text);
  }

  showDialog(title, text) {
    byId("text-title").textContent = title;
    byId("text-body").textContent = text;
    if (!byId("text-dialog").open) byId("text-dialog").showModal();
  }

  openRecord() {
    if (!this.recording && this.lacksScene()) return;
    const { first, last, fps } = this.app.timeline.frames();
    if (!this.recording) {
      byId("record-first").value = first;
      byId("record-last").value = last;
      const [width, height] = this.app.store.doc.output?.size ?? ["?", "?"];
      byId("record-note").textContent =
        `${fps} frames per second of ${width} × ${height} pixels${this.lacking()}. ` +
        "The picture waits while the film is rendered.";
    }
    byId("record-dialog").showModal();
  }

  async record() {
    const [first, last] = ["first", "last"].map((name) =>
      parseTyped(byId(`record-${name}`).value, false, { whole: true, least: 0 }),
    );
    if (first.error || last.error || first.value > last.value) {
      byId("record-note").textContent = "Expected two whole numbers, the first not after the last.";
      return;
    }
    const lacking = this.lacking(),
      { fps } = this.app.timeline.frames();
    this.frames = last.value - first.value + 1;
    this.app.timeline.pause();
    this.setRecording(true);
    const answer = await this.ask(
      () =>
        this.app.lastFull
          ? this.app.server.post("/record", {
              ...this.app.lastFull,
              quality: "full",
              first: first.value,
              last: last.value,
            })
          : Promise.resolve(null),
      { afterFull: true },
    );
    this.setRecording(false);
    const frames = answer?.frames ?? this.frames,
      wrote = `Wrote ${answer?.file}: ${plural(frames, "frame")}, ${tidy(frames / fps, 3)} s${lacking}.`;
    byId("record-note").textContent = answer?.file ? wrote : "No film was written.";
    if (answer?.file) this.app.say(wrote);
  }

  async stop() {
    try {
      await this.app.server.stop();
    } catch (error) {
      this.app.pictures.showError(error);
    }
  }

  setRecording(recording) {
    this.recording = recording;
    byId("record-start").disabled = recording;
    byId("record-stop").disabled = !recording;
    byId("record-progress").hidden = !recording;
    if (recording) {
      byId("record-bar").max = this.frames;
      byId("record-bar").removeAttribute("value");
      byId("record-left").textContent = "";
    }
    byId("record").classList.toggle("busy", recording);
    byId("record").textContent = recording ? "Recording…" : "Record";
  }

  // An event of the server.
  heard(event) {
    if (event.kind !== "progress") return;
    if (!this.recording)
      return this.app.status.progress(`${event.stage}, ${Math.round(100 * event.fraction)} %`);
    if (event.stage !== "film") return;
    const done = Math.round(event.fraction * this.frames);
    byId("record-bar").value = done;
    byId("record-left").textContent = [`${done} of ${plural(this.frames, "frame")}`, timeLeft(event.secondsLeft)]
      .filter(Boolean)
      .join(", ");
  }
}
