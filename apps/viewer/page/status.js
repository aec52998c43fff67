// What the page tells: remarks in a live line, the server's errors beside their controls, and a banner when it is gone.

import { byId, el } from "./dom.js";

// Place in the doc that an error names, as "light.0.intensity"; null if it names none. `places` maps the numbers of
// the lights and warps that were sent to those of the doc; without, these are the same.
export function pathOfError(message, places) {
  const match = /\b(camera|light|warp)(?:\[(\d+)\])?((?:\.[a-z_]+(?:\[\d+\])?)*)/.exec(message);
  if (!match) return null;
  const [, part, index, rest] = match;
  const keys = rest.split(/[.[\]]+/).filter(Boolean);
  return [
    part,
    ...(index === undefined ? [] : [String(places[part]?.[Number(index)] ?? index)]),
    ...keys,
  ].join(".");
}

const shownMs = 8000; // that a message stands at most
const progressMs = 3000;

// Where an action takes place: the section, the row of buttons with its button, the picture, the timeline.
function areaOf(target) {
  const area = target.closest?.("#header button, .section, #modes button, #rig-box, #picture, #timeline, dialog");
  return area?.id || area?.className || "";
}

// Keys that do nothing on the page.
const isIdle = ({ type, key, ctrlKey, metaKey }) =>
  type === "keydown" &&
  (["Control", "Shift", "Alt", "Meta", "Tab"].includes(key) || ((ctrlKey || metaKey) && !/^[syz]$/i.test(key)));

// The status line shows the newest message; else the error that stands; else progress.
export class Status {
  constructor() {
    this.problems = new Map(); // of "a" and "b", the panes, and of "page", all other requests: { text, node }
    this.message = "";
    this.progressText = "";
    this.messageArea = this.area = ""; // of the action before the message, and of the last one
    this.timers = {};
    for (const type of ["pointerdown", "keydown", "change"])
      addEventListener(type, (event) => this.acted(event), { capture: true });
  }

  // A message goes when something else is done.
  acted(event) {
    if (isIdle(event) || event.target.closest?.("#status")) return;
    this.area = areaOf(event.target);
    if (this.area !== this.messageArea) this.say("");
  }

  say(text) {
    this.message = text;
    this.messageArea = this.area;
    clearTimeout(this.timers.message);
    const forget = () => {
      // Not while it is read.
      if (byId("remark").matches(":hover, :focus")) this.timers.message = setTimeout(forget, 1000);
      else this.say("");
    };
    if (text) this.timers.message = setTimeout(forget, shownMs);
    this.show();
  }

  // Whether a hint would cover nothing.
  isFree() {
    return !this.message && !this.problems.size;
  }

  // Shows how far the server is, for a while.
  progress(text) {
    this.progressText = text;
    clearTimeout(this.timers.progress);
    if (text) this.timers.progress = setTimeout(() => this.progress(""), progressMs);
    this.show();
  }

  show() {
    const node = byId("remark"),
      problem = [...this.problems.values()].at(-1)?.text,
      text = this.message || problem || this.progressText;
    if (node.textContent !== text) node.textContent = text;
    node.classList.toggle("bad", !this.message && problem !== undefined);
  }

  // Shows an error in the status line and beside the most exact control that it names, until its source clears it.
  showProblem(source, text, path) {
    this.clearProblem(source);
    const problem = { text, node: null };
    this.problems.set(source, problem);
    this.say("");
    const isBeside = [...this.problems.values()].some((other) => other.node && other.text === text);
    for (let keys = isBeside ? [] : (path?.split(".") ?? []); keys.length; keys = keys.slice(0, -1)) {
      const host = document.querySelector(`#panel [data-path="${CSS.escape(keys.join("."))}"]`);
      if (!host) continue;
      problem.node = el("p", { class: "problem", text });
      host.append(problem.node);
      break;
    }
  }

  clearProblem(source) {
    const problem = this.problems.get(source);
    if (!problem) return;
    problem.node?.remove();
    this.problems.delete(source);
    this.show();
  }

  banner(text) {
    const node = byId("banner");
    node.hidden = !text;
    if (node.textContent !== text) node.textContent = text;
  }
}

// Follows /events while the tab is seen; a hidden tab would take one of the browser's few connections to the server.
export async function followEvents(server, heard) {
  let after = 0;
  for (;;) {
    if (document.hidden) {
      await new Promise((seen) => document.addEventListener("visibilitychange", seen, { once: true }));
      continue;
    }
    const controller = new AbortController(),
      hide = () => controller.abort();
    document.addEventListener("visibilitychange", hide, { once: true });
    try {
      const asked = performance.now(),
        { next, events } = await server.events(after, controller.signal);
      // What came at once with the first answer happened before this page was opened.
      if (after > 0 || performance.now() - asked > 200) events.forEach(heard);
      after = next;
      // An answer at once with nothing in it must not become a storm of requests.
      if (!events.length && performance.now() - asked < 500)
        await new Promise((done) => setTimeout(done, 500));
    } catch (error) {
      if (error.name !== "AbortError") await new Promise((done) => setTimeout(done, 2000));
    }
    document.removeEventListener("visibilitychange", hide);
  }
}
