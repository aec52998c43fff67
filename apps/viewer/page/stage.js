// The stage: the canvas that pictures are drawn to, its size, and gestures of mouse, touch and wheel on it.

import { byId } from "./dom.js";
import { fitted } from "./request.js";

const clickReach = 4; // pixels that a click may move

export class Stage {
  // hooks: shape() of the picture; background(), its colour before the first one, red, green and blue up to 1; resized(); drag(kind, dx, dy, event), wheel(factor, event) in parts of the
  // picture's height; clicked(x, y) at a place of the picture.
  constructor(hooks) {
    this.hooks = hooks;
    this.node = byId("stage");
    this.frame = byId("picture");
    this.canvas = byId("canvas");
    this.context = this.canvas.getContext("2d", { alpha: false });
    this.pictures = { a: null, b: null };
    this.errors = { a: byId("error-a"), b: byId("error-b") };
    this.split = null; // part of the width at which pane B begins; null without B
    this.pointers = new Map();
    this.listen();
    new ResizeObserver(() => this.layout()).observe(this.node);
  }

  // Size of the stage in device pixels.
  pixels() {
    const ratio = devicePixelRatio || 1;
    return {
      width: Math.max(16, this.node.clientWidth * ratio),
      height: Math.max(16, this.node.clientHeight * ratio),
    };
  }

  layout() {
    const { width, height } = fitted(this.hooks.shape(), {
      width: this.node.clientWidth,
      height: this.node.clientHeight,
    });
    const key = `${width} ${height} ${devicePixelRatio}`;
    if (key === this.laidOut) return;
    this.laidOut = key;
    Object.assign(this.frame.style, { width: `${width}px`, height: `${height}px` });
    this.canvas.width = Math.round(width * devicePixelRatio);
    this.canvas.height = Math.round(height * devicePixelRatio);
    this.draw();
    this.hooks.resized();
  }

  aspect() {
    return this.frame.clientWidth / Math.max(1, this.frame.clientHeight);
  }

  show(pane, bitmap) {
    this.pictures[pane]?.close();
    this.pictures[pane] = bitmap;
    this.draw();
  }

  forget(pane) {
    this.pictures[pane]?.close();
    this.pictures[pane] = null;
    this.draw();
  }

  // Dims a pane under an error's text; "" ends that.
  showError(pane, text) {
    this.errors[pane].firstElementChild.textContent = text;
    this.draw();
  }

  // Puts the errors over their panes.
  layoutErrors() {
    const split = this.split ?? 1;
    for (const [pane, begin, end] of [
      ["a", 0, split],
      ["b", split, 1],
    ]) {
      const node = this.errors[pane];
      node.hidden = begin === end || !node.textContent;
      node.classList.toggle("empty", !this.pictures[pane]);
      Object.assign(node.style, { left: `${100 * begin}%`, width: `${100 * (end - begin)}%` });
    }
  }

  draw() {
    this.layoutErrors();
    const { canvas, context, pictures, split } = this,
      { width, height } = canvas;
    // Previews are enlarged at once rather than well.
    context.imageSmoothingQuality = pictures.a?.width < 0.9 * width ? "low" : "high";
    if (pictures.a) context.drawImage(pictures.a, 0, 0, width, height);
    else {
      context.fillStyle = `rgb(${this.hooks.background().map((c) => 255 * c)})`;
      context.fillRect(0, 0, width, height);
    }
    if (pictures.b && split !== null) {
      context.save();
      context.beginPath();
      context.rect(split * width, 0, width, height);
      context.clip();
      context.drawImage(pictures.b, 0, 0, width, height);
      context.restore();
    }
  }

  // Place of an event on the picture, x and y from 0 to 1.
  place(event) {
    const box = this.frame.getBoundingClientRect();
    return { x: (event.clientX - box.left) / box.width, y: (event.clientY - box.top) / box.height };
  }

  listen() {
    const { frame, pointers, hooks } = this;
    frame.addEventListener("pointerdown", (event) => {
      if (event.target.closest("button, [role=slider]")) return;
      this.canvas.focus({ preventScroll: true });
      this.click = event.button === 0 && !pointers.size ? { x: event.clientX, y: event.clientY } : null;
      pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      frame.setPointerCapture(event.pointerId);
      this.pan = event.button === 1 || event.button === 2 || event.shiftKey;
      event.preventDefault();
    });
    frame.addEventListener("pointermove", (event) => {
      const last = pointers.get(event.pointerId);
      if (!last) return;
      if (this.click) {
        if (Math.hypot(event.clientX - this.click.x, event.clientY - this.click.y) < clickReach) return;
        this.click = null;
      }
      const height = frame.clientHeight || 1,
        before = this.spread();
      const dx = (event.clientX - last.x) / height,
        dy = (event.clientY - last.y) / height;
      pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      if (pointers.size === 1) hooks.drag(this.pan ? "pan" : "turn", dx, dy, event);
      else if (pointers.size === 2) {
        hooks.drag("pan", dx / 2, dy / 2, event);
        const after = this.spread();
        if (before > 10 && after > 10) hooks.wheel(before / after, event);
      }
    });
    frame.addEventListener("pointerup", (event) => {
      pointers.delete(event.pointerId);
      if (!this.click || pointers.size) return;
      this.click = null;
      const { x, y } = this.place(event);
      hooks.clicked(x, y);
    });
    frame.addEventListener("pointercancel", (event) => pointers.delete(event.pointerId));
    frame.addEventListener("contextmenu", (event) => event.preventDefault());
    frame.addEventListener(
      "wheel",
      (event) => {
        if (event.ctrlKey && !event.deltaY) return;
        event.preventDefault();
        const step = event.deltaMode === 1 ? event.deltaY * 30 : event.deltaY;
        hooks.wheel(Math.exp(Math.max(-300, Math.min(300, step)) * 0.0012), event);
      },
      { passive: false },
    );
  }

  // Distance between two fingers.
  spread() {
    const [a, b] = [...this.pointers.values()];
    return a && b ? Math.hypot(a.x - b.x, a.y - b.y) : 0;
  }
}
