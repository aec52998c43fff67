// Markers of lamps and handles on the picture: buttons that are dragged, or moved by the arrow keys.

import { byId, el } from "./dom.js";

const step = 0.03; // of the picture's height, per press of an arrow key

export class Markers {
  // hooks: drag(marker, { from, to, grip }, event) by the pointer's way between two places of the picture, { x, y };
  // `grip` is an object that lasts from press to release; scale(marker, factor, event); remove(marker); select(marker);
  // ended().
  constructor(hooks, place) {
    this.hooks = hooks;
    this.place = place; // of an event on the picture
    this.layer = byId("markers");
    this.nodes = new Map();
  }

  // Shows [{ key, kind, index, handle, x, y, out, direction, text, name, title, color, ink, off, chosen }]; x and y are
  // parts of the picture, direction the radians, clockwise from the right, at which a place outside of it lies.
  show(markers) {
    const keys = new Set(markers.map((marker) => marker.key));
    for (const [key, node] of this.nodes)
      if (!keys.has(key)) {
        node.remove();
        this.nodes.delete(key);
      }
    const { clientWidth: width, clientHeight: height } = this.layer;
    for (const marker of markers) {
      const node = this.nodes.get(marker.key) ?? this.made(marker);
      node.marker = marker;
      node.style.transform = `translate(${marker.x * width}px, ${marker.y * height}px) translate(-50%, -50%)`;
      node.classList.toggle("out", Boolean(marker.out));
      node.classList.toggle("off", Boolean(marker.off));
      node.classList.toggle("chosen", Boolean(marker.chosen));
      if (marker.out) node.style.setProperty("--direction", `${marker.direction.toFixed(3)}rad`);
      if (marker.color) {
        node.style.setProperty("--lamp", marker.color);
        node.style.setProperty("--ink", marker.ink);
      }
      const face = node.firstElementChild,
        title = marker.title ?? marker.name;
      if (face.textContent !== (marker.text ?? "")) face.textContent = marker.text ?? "";
      if (node.getAttribute("aria-label") !== marker.name) node.setAttribute("aria-label", marker.name);
      if (node.title !== title) node.title = title;
    }
  }

  made(marker) {
    const node = el(
      "button",
      { type: "button", class: `marker ${marker.kind}`, data: { marker: marker.key } },
      el("span", { class: "face" }),
    );
    this.nodes.set(marker.key, node);
    this.layer.append(node);
    let last = null,
      grip = {};
    node.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      last = this.place(event);
      grip = {};
      node.setPointerCapture(event.pointerId);
      this.hooks.select(node.marker);
      event.stopPropagation();
    });
    node.addEventListener("pointermove", (event) => {
      if (!last) return;
      const from = last;
      last = this.place(event);
      if (last.x !== from.x || last.y !== from.y)
        this.hooks.drag(node.marker, { from, to: last, grip }, event);
    });
    const end = () => {
      if (last) this.hooks.ended();
      last = null;
    };
    node.addEventListener("pointerup", end);
    node.addEventListener("pointercancel", end);
    node.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        event.stopPropagation();
        this.hooks.scale(node.marker, Math.exp(-event.deltaY * 0.001), event);
      },
      { passive: false },
    );
    node.addEventListener("focus", () => this.hooks.select(node.marker));
    node.addEventListener("keydown", (event) => this.keyed(node.marker, event));
    return node;
  }

  keyed(marker, event) {
    const moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
    const move = moves[event.key];
    if (move && !event.ctrlKey && !event.altKey) {
      const [dx, dy] = move,
        aspect = this.layer.clientWidth / Math.max(1, this.layer.clientHeight),
        { x, y } = marker;
      this.hooks.drag(marker, { from: { x, y }, to: { x: x + dx / aspect, y: y + dy }, grip: {} }, event);
    } else if (event.key === "+" || event.key === "=") this.hooks.scale(marker, 1.1, event);
    else if (event.key === "-") this.hooks.scale(marker, 1 / 1.1, event);
    else if (event.key === "Delete") this.hooks.remove(marker);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }
}
