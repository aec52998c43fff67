// The page of a whole object: its state, hands of mouse, finger and keys, and when what is drawn.
"use strict";
(() => {
  const { page, orbit, overlay, picture, ObjectDrawing } = surflect;
  const { clamp } = picture;
  const by = (id) => document.getElementById(id);
  const canvas = by("canvas"), stage = by("stage");
  const gl = picture.contextOf(canvas, { alpha: false });
  if (!gl) return;

  const home = { azimuth: page.camera.azimuth, elevation: page.camera.elevation, distance: page.camera.distance, target: page.camera.center };
  const ball = { center: page.camera.center, radius: page.camera.radius };
  const state = { view: { ...home }, brighter: 0, mmPerUnit: page.mmPerUnit ?? 0 };
  const drawing = new ObjectDrawing(gl, page);
  const finest = 2, coarsest = 1 / 4; // samples along each side of a pixel: when nothing moves, and on slow machines
  const restAfter = 150, slowest = 40; // milliseconds: until a picture counts as resting; of a frame, before it is drawn coarser
  let coarse = 1, resting = 0, slowFrames = 0;

  // ---- The picture.

  const aspect = () => canvas.width / canvas.height;
  const tangents = () => orbit.tangentsOf(page.camera.fov, aspect());

  function background() {
    const [r, g, b] = getComputedStyle(stage).backgroundColor.match(/[\d.]+/g).map((byte) => byte / 255);
    return [r, g, b].map((x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4));
  }

  // Draws the picture at once; perPixel: samples along each side of a pixel.
  function draw(perPixel = finest) {
    picture.fill(canvas, stage);
    const frame = orbit.frameOf(state.view, page.camera.up), tan = tangents();
    drawing.draw({ clipFromObject: orbit.clipFromObject(frame, tan, ball), eye: frame.eye, stops: page.stops + state.brighter, background: background() },
      canvas.width, canvas.height, perPixel);
    const pixelsPerUnit = stage.clientHeight / (2 * tan[1] * state.view.distance);
    by("overlay").replaceChildren(...overlay.scaleBar(state.mmPerUnit > 0 ? pixelsPerUnit / state.mmPerUnit : 0, stage.clientHeight));
  }

  // While the picture moves, frames are coarse enough to follow; once it rests, one is fine.
  const redrawFine = picture.onceAFrame(() => draw(coarse < 1 ? 1 : finest));
  const redrawMoving = picture.onceAFrame((time) => {
    draw(coarse);
    requestAnimationFrame((next) => {
      slowFrames = next - time > slowest ? slowFrames + 1 : 0;
      if (slowFrames > 1) { coarse = Math.max(coarsest, coarse / 2); slowFrames = 0; }
    });
  });
  function redraw() {
    clearTimeout(resting);
    resting = setTimeout(redrawFine, restAfter);
    redrawMoving();
  }

  // ---- Hands.

  function setView(view) {
    state.view = view;
    for (const name of ["azimuth", "elevation"])
      if (document.activeElement !== by(name)) by(name).value = Math.round(view[name]);
    redraw();
  }
  const turn = (azimuth, elevation) => setView(orbit.turned(state.view, azimuth, elevation));
  const zoom = (factor) => setView(orbit.nearer(state.view, factor, home));
  const move = (dx, dy) => setView(orbit.moved(state.view, page.camera.up, tangents(), dx / stage.clientHeight, dy / stage.clientHeight, ball));
  const goHome = () => setView({ ...home });

  const degreesAcross = 240; // of a drag over the shorter side of the picture
  picture.takeHands(canvas, {
    press() { coarse = Math.min(1, 2 * coarse); }, // what was slow may be fast again
    drag(event, dx, dy) {
      if (event.shiftKey) return move(dx, dy);
      const perPixel = degreesAcross / Math.min(stage.clientWidth, stage.clientHeight);
      turn(-dx * perPixel, dy * perPixel);
    },
    release() {},
    takeBack() {},
    pinch(dx, dy, factor) { move(dx, dy); zoom(factor); },
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
  for (const name of ["azimuth", "elevation"])
    by(name).oninput = (event) => {
      if (event.target.value !== "") setView(orbit.turned({ ...state.view, [name]: +event.target.value }, 0, 0));
    };
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
    + `${(2 ** -page.stops).toPrecision(3)}. The light is that of the photographs, and turns with the object. Made with Surflect.`;

  // ---- The terms, one after another: each sharpens the picture.

  let loading = page.counts.length > 0;
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
  surflect.app = { state, drawing, draw, setView, canvas, get busy() { return loading; } };
})();
