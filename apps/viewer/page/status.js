// What the page tells: remarks in a live line, the server's errors beside their controls, and a banner when it is gone.

import { byId, el } from "./dom.js";

// Place in the doc that an error names, as "light.0.intensity"; null if it names none. `places` maps the numbers of
// the lights and warps that were sent to those of the doc.
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

export class Status {
  constructor() {
    this.problems = new Map(); // of "a" and "b", the panes, and of "page", all other requests: { text, node }
  }

  say(text) {
    if (byId("remark").textContent !== text) byId("remark").textContent = text;
    byId("remark").classList.remove("bad");
  }

  // Shows an error in the status line and beside the most exact control that it names, until its source clears it.
  showProblem(source, text, path) {
    this.clearProblem(source);
    this.sayBad(text);
    const problem = { text, node: null };
    this.problems.set(source, problem);
    const isBeside = [...this.problems.values()].some((other) => other.node && other.text === text);
    for (let keys = isBeside ? [] : (path?.split(".") ?? []); keys.length; keys = keys.slice(0, -1)) {
      const host = document.querySelector(`#panel [data-path="${CSS.escape(keys.join("."))}"]`);
      if (!host) continue;
      problem.node = el("p", { class: "problem", text });
      host.append(problem.node);
      break;
    }
  }

  sayBad(text) {
    this.say(text);
    byId("remark").classList.add("bad");
  }

  // The status line goes on with an error of another source, if there is one.
  clearProblem(source) {
    const problem = this.problems.get(source);
    if (!problem) return;
    problem.node?.remove();
    this.problems.delete(source);
    if (byId("remark").textContent !== problem.text) return;
    const [other] = this.problems.values();
    if (other) this.sayBad(other.text);
    else this.say("");
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
