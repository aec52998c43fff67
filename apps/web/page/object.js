// The page of a whole object: its state, input by mouse, finger and keys, and when what is drawn.
"use strict";
(() => {
  const { page, orbit, overlay, picture, ObjectDrawing } = surflect;
  const { clamp } = picture;
  const by = (id) => document.getElementById(id);
  const canvas = by("canvas"), stage = by("stage");
  const gl = picture.contextOf(canvas, { alpha: false });
  if (!gl) return;

  const { up, radius, sector } = page.camera; // sector: azimuths that were photographed; none all around
  const home = { azimuth: page.camera.azimuth, elevation: page.camera.elevation, distance: page.camera.distance, target: [0, 0, 0], zoom: 1 };
  const state = { view: { ...home }, brighter: 0, mmPerUnit: page.mmPerUnit ?? 0 };
  const drawing = new ObjectDrawing(gl, page);
  const finest = 2, coarsest = 1 / 4; // samples along each side of a pixel: when nothing moves, and on slow machines
  const restAfter = 150, slowest = 40; // milliseconds: until a picture counts as resting; of a frame, before it is drawn coarser
  const fewTriangles = 20000; // so many are searched for the scale of each frame; more when the picture rests
  let coarse = 1, resting = 0, slowFrames = 0, timesHidden = 0, loading = page.counts.length > 0, depth = home.distance;

  // ---- The picture.

  const aspect = () => canvas.width / canvas.height;
  const tangents = () => orbit.tangentsOf(page.camera.fov, aspect(), state.view.zoom);

  function background() {
    const [r, g, b] = getComputedStyle(stage).backgroundColor.match(/[\d.]+/g).map((byte) => byte / 255);
    return [r, g, b].map((x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4));
  }

  // Draws the picture at once; perPixel: samples along each side of a pixel.
  function draw(perPixel = finest) {
    picture.fill(canvas, stage);
    const frame = orbit.frameOf(state.view, up), tan = tangents();
    drawing.draw({ clipFromObject: orbit.clipFromObject(frame, tan, radius), eye: frame.eye, stops: page.stops + state.brighter, background: background() },
      canvas.width, canvas.height, perPixel);
    if (state.mmPerUnit > 0 && (perPixel === finest || drawing.count <= fewTriangles))
      depth = orbit.depthOfMiddle(frame, drawing.positions, drawing.triangles) ?? state.view.distance;
    const pixelsPerUnit = stage.clientHeight / (2 * tan[1] * depth);
    by("overlay").replaceChildren(...overlay.scaleBar(state.mmPerUnit > 0 ? pixelsPerUnit / state.mmPerUnit : 0, stage.clientHeight));
  }

  // While the picture moves, frames are coarse enough to follow; once it rests, one is fine. Then what was slow may be fast
  // again. Frames are not judged while terms are decoded, nor where the page was hidden.
  const redrawFine = picture.onceAFrame(() => {
    draw();
    coarse = Math.min(1, 2 * coarse);
  });
  document.addEventListener("visibilitychange", () => ++timesHidden);
  const redrawMoving = picture.onceAFrame((time) => {
    const hidden = timesHidden;
    draw(coarse);
    requestAnimationFrame((next) => {
      clearTimeout(resting);
      resting = setTimeout(redrawFine, restAfter); // not while a slow frame is drawn
      if (loading || timesHidden !== hidden) return;
      slowFrames = next - time > slowest ? slowFrames + 1 : 0;
      if (slowFrames > 1) { coarse = Math.max(coarsest, coarse / 2); slowFrames = 0; }
    });
  });
  function redraw() {
    clearTimeout(resting);
    redrawMoving();
  }

  // ---- Input.

  // typed: the field that gives the view, which keeps what was typed until it changes.
  function setView(view, typed) {
    state.view = view;
    for (const name of ["azimuth", "elevation"])
      if (name !== typed) by(name).value = Math.round(view[name]);
    const isBeyond = sector && Math.abs(orbit.turned(view, -(sector[0] + sector[1]) / 2, 0).azimuth) > (sector[1] - sector[0]) / 2 + 0.5;
    by("beyond").textContent = isBeyond ? "No photograph was taken from there: the picture is a guess." : "";
    redraw();
  }
  const turn = (azimuth, elevation) => setView(orbit.turned(state.view, azimuth, elevation));
  // Enlarges the picture about a point of the page, or its middle.
  function zoom(factor, clientX, clientY) {
    const { left, top, width, height } = canvas.getBoundingClientRect(), isPoint = clientX !== undefined;
    const x = isPoint ? (clientX - left - width / 2) / height : 0, y = isPoint ? (clientY - top - height / 2) / height : 0;
    setView(orbit.enlarged(state.view, up, tangents(), factor, x, y, radius));
  }
  const move = (dx, dy) => setView(orbit.moved(state.view, up, tangents(), dx / stage.clientHeight, dy / stage.clientHeight, radius));
  const goHome = () => setView({ ...home });

  const degreesAcross = 240; // of a drag over the shorter side of the picture
  picture.trackPointers(canvas, {
    press() {},
    drag(event, dx, dy) {
      if (event.shiftKey) return move(dx, dy);
      const perPixel = degreesAcross / Math.min(stage.clientWidth, stage.clientHeight);
      turn(-dx * perPixel, dy * perPixel);
    },
    release() {},
    cancel() {},
    pinch(dx, dy, factor, x, y) { move(dx, dy); zoom(factor, x, y); },
    zoom,
  });
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (step && event.shiftKey) move(40 * step[0], 40 * step[1]);
    else if (step) turn(-5 * step[0], 5 * step[1]);
    else if (event.key === "+" || event.key === "=") zoom(1.25);
    else if (event.key === "-") zoom(0.8);
    else if (event.key === "0") goHome();
    else return;
    event.preventDefault();
  });
  by("home").onclick = goHome;
  by("in").onclick = () => zoom(1.5);
  by("out").onclick = () => zoom(1 / 1.5);
  for (const name of ["azimuth", "elevation"]) {
    by(name).oninput = (event) => {
      if (event.target.value !== "") setView(orbit.turned({ ...state.view, [name]: +event.target.value }, 0, 0), name);
    };
    by(name).onchange = () => setView(state.view); // shows what came of it, such as 89 for 100
  }
  for (const button of document.querySelectorAll("[data-turn]")) button.onclick = () => turn(+button.dataset.turn, 0);

  by("brightness").oninput = (event) => { state.brighter = +event.target.value; by("stops").textContent = event.target.value; redraw(); };
  by("scale").value = state.mmPerUnit || "";
  by("scale").oninput = (event) => { state.mmPerUnit = Math.max(0, +event.target.value || 0); redraw(); };

  by("save").onclick = () => {
    draw();
    canvas.toBlob((blob) => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob);
      link.download = `${document.title.replace(/[^\p{L}\p{N} ._-]+/gu, "_").trim() || "object"}.png`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    }, "image/png");
  };

  by("about").textContent = `${drawing.count} triangles, ${page.counts.length} terms of light field maps. White stands for a radiance of `
    + `${(2 ** -page.stops).toPrecision(3)}. The light is fixed, and turns with the object. Made with Surflect.`;

  // ---- The terms, one after another: each sharpens the picture.

  surflect.term = (number, read) => {
    if (number === drawing.terms) drawing.addTerm(read);
  };
  function load(number) {
    loading = number < page.counts.length;
    if (!loading) return;
    const script = document.createElement("script"), name = `term${number}.js`;
    script.dataset.part = name;
    const done = (problem) => {
      script.remove();
      if (drawing.terms <= number) { loading = false; surflect.fail(`A part of the object is missing: ${name} ${problem}`); return; }
      redraw();
      load(number + 1);
    };
    script.onload = () => done("is damaged");
    script.onerror = () => done("cannot be loaded");
    script.src = name;
    document.head.append(script);
  }

  new ResizeObserver(redraw).observe(stage);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  setView({ ...home });
  load(0);
  surflect.app = { state, drawing, draw, setView, canvas, get busy() { return loading; }, get coarse() { return coarse; } };
})();
