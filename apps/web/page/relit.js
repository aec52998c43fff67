// The page of one view: its state, input by mouse, finger and keys, and when what is drawn.
"use strict";
(() => {
  const { page, Tiles, Drawing, Notes, decode, overlay, picture } = surflect;
  const { clamp } = picture;
  const by = (id) => document.getElementById(id);
  const canvas = by("canvas"), stage = by("stage"), disc = by("disc"), svg = by("overlay");
  const radians = Math.PI / 180;

  const gl = picture.contextOf(canvas, { alpha: true });
  if (!gl) return;

  document.body.classList.toggle("read-only", Boolean(page.readOnly));
  by("annotations").hidden = page.readOnly && !surflect.published?.length;

  // view: the point of the full picture in the middle of the canvas, and pixels of the canvas a pixel of the picture.
  const state = { x: 0, y: 0, stops: 0, show: 0, exponent: 60, diffuse: 0.4, tool: "lamp", line: null, box: null, isMeasuring: false, // by keys: the line ends in the middle of the canvas
    pixelsPerMm: page.pixelsPerMm ?? 0, view: { x: page.width / 2, y: page.height / 2, zoom: 1, fits: true } };
  const hull = decode.hullOf(page.lights.map(({ towards }) => [towards[0], towards[1]]));
  const tiles = new Tiles(gl, page, () => redraw());
  const drawing = new Drawing(gl, page);
  const notes = new Notes(page, surflect.published ?? [], () => redraw());

  // ---- The picture.

  const fitZoom = () => Math.min(canvas.width / page.width, canvas.height / page.height);
  const ratio = () => canvas.width / Math.max(1, canvas.clientWidth);

  function clampView() {
    const { view } = state;
    if (view.fits) Object.assign(view, { x: page.width / 2, y: page.height / 2, zoom: fitZoom() });
    view.zoom = clamp(view.zoom, Math.min(fitZoom(), 1) / 2, Math.max(16, fitZoom()));
    view.x = clamp(view.x, 0, page.width);
    view.y = clamp(view.y, 0, page.height);
  }

  // At 1:1 and whole multiples, pixels of the picture are those of the canvas.
  function origin() {
    const { view } = state, left = canvas.width / 2 - view.x * view.zoom, top = canvas.height / 2 - view.y * view.zoom;
    return view.zoom >= 1 ? [Math.round(left), Math.round(top)] : [left, top];
  }

  const toScreen = ({ x, y }) => {
    const [left, top] = origin();
    return { x: (left + x * state.view.zoom) / ratio(), y: (top + y * state.view.zoom) / ratio() };
  };
  const toPicture = (clientX, clientY) => {
    const box = canvas.getBoundingClientRect(), [left, top] = origin();
    return { x: ((clientX - box.left) * ratio() - left) / state.view.zoom, y: ((clientY - box.top) * ratio() - top) / state.view.zoom };
  };

  // Names of the tiles of a level that are seen, from the middle outwards.
  function seenTiles(level) {
    const size = Tiles.size(page, level), side = page.tile * 2 ** level, [left, top] = origin(), { zoom, x, y } = state.view;
    const first = (from) => Math.max(0, Math.floor(-from / zoom / side));
    const last = (from, extent, count) => Math.min(Math.ceil(count / page.tile) - 1, Math.floor((extent - from) / zoom / side));
    const found = [];
    for (let j = first(top); j <= last(top, canvas.height, size.height); ++j)
      for (let i = first(left); i <= last(left, canvas.width, size.width); ++i)
        found.push({ name: `${level}/${i}_${j}`, i, j, far: Math.hypot((i + 0.5) * side - x, (j + 0.5) * side - y) });
    return found.sort((a, b) => a.far - b.far);
  }

  function draw() {
    picture.fill(canvas, stage);
    const { width, height } = canvas;
    clampView();
    if (state.isMeasuring) { state.line = [state.line[0], { x: state.view.x, y: state.view.y }]; tellLength(); }
    const [x, y] = decode.nearestInHull(state.x, state.y, hull);
    const towards = [state.x, state.y, Math.sqrt(Math.max(0, 1 - state.x ** 2 - state.y ** 2))];
    drawing.begin({ ...state, towards, weights: decode.weightsOf(decode.featuresOf(x, y, page.lights), page) }, width, height);
    const { zoom } = state.view, level = clamp(Math.floor(Math.log2(1 / zoom) + 1e-6), 0, page.levels - 1), [left, top] = origin();
    for (let n = page.levels - 1; n >= level; --n)
      for (const { name, i, j } of seenTiles(n)) {
        const tile = tiles.get(name);
        if (!tile) continue;
        const step = zoom * 2 ** n, x0 = left + i * page.tile * step, y0 = top + j * page.tile * step;
        drawing.tile(tile, x0, y0, Math.min(x0 + tile.width * step, left + page.width * zoom),
          Math.min(y0 + tile.height * step, top + page.height * zoom), width, height, zoom >= 1 && n === 0);
      }
    tiles.want([`${page.levels - 1}/0_0`, ...seenTiles(level).map(({ name }) => name)]);
    overlay.drawOverlay(svg, { toScreen, scale: zoom / ratio(), height: stage.clientHeight, pixelsPerMm: state.pixelsPerMm,
      line: state.line, box: state.box, notes: notes.list, chosen: notes.chosen });
    by("beyond").textContent = Math.hypot(x - state.x, y - state.y) > 0.02 && state.show === 0
      ? "No lamp was captured there: the nearest light is shown." : "";
  }

  const redraw = picture.onceAFrame(draw);

  function zoomAt(factor, clientX, clientY) {
    const before = toPicture(clientX, clientY), { view } = state;
    view.fits = false;
    view.zoom *= factor;
    clampView();
    const after = toPicture(clientX, clientY);
    view.x += before.x - after.x;
    view.y += before.y - after.y;
    redraw();
  }

  function zoomInMiddle(factor) {
    const box = canvas.getBoundingClientRect();
    zoomAt(factor, box.left + box.width / 2, box.top + box.height / 2);
  }

  function fit() { state.view.fits = true; redraw(); }
  function one() { zoomInMiddle(1 / state.view.zoom); }

  function pan(dx, dy) { // pixels of the page
    const { view } = state;
    view.fits = false;
    view.x -= dx * ratio() / view.zoom;
    view.y -= dy * ratio() / view.zoom;
    redraw();
  }

  // ---- The lamp.

  function setLamp(x, y) {
    const r = Math.hypot(x, y), most = r > 1 ? 1 / r : 1;
    state.x = x * most;
    state.y = y * most;
    by("lamp").setAttribute("cx", state.x);
    by("lamp").setAttribute("cy", -state.y);
    if (document.activeElement !== by("azimuth")) by("azimuth").value = Math.round(Math.atan2(state.y, state.x) / radians);
    if (document.activeElement !== by("elevation")) by("elevation").value = Math.round(Math.acos(Math.min(1, r)) / radians);
    redraw();
  }

  function setAngles() {
    const azimuth = radians * by("azimuth").value, elevation = radians * by("elevation").value;
    setLamp(Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth));
  }

  page.lights.forEach(({ name, towards }) => {
    const dot = document.createElementNS("http://www.w3.org/2000/svg", "circle");
    for (const [key, value] of Object.entries({ cx: towards[0], cy: -towards[1], r: 0.022 })) dot.setAttribute(key, value);
    const title = document.createElementNS("http://www.w3.org/2000/svg", "title");
    title.textContent = name;
    dot.append(title);
    by("captured").append(dot);
  });
  by("hull").setAttribute("d", `M${hull.map(([x, y]) => `${x} ${-y}`).join("L")}Z`);

  const onDisc = (event) => {
    const box = disc.getBoundingClientRect(), half = box.width / 2.16;
    setLamp((event.clientX - box.left - box.width / 2) / half, -(event.clientY - box.top - box.height / 2) / half);
  };
  disc.addEventListener("pointerdown", (event) => { if (event.button) return; disc.setPointerCapture(event.pointerId); onDisc(event); });
  disc.addEventListener("pointermove", (event) => { if (disc.hasPointerCapture(event.pointerId)) onDisc(event); });
  disc.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!step) return;
    event.preventDefault();
    const far = event.shiftKey ? 0.15 : 0.03;
    setLamp(state.x + far * step[0], state.y + far * step[1]);
  });
  by("azimuth").oninput = by("elevation").oninput = setAngles;
  by("front").onclick = () => setLamp(0, 0);
  for (const button of document.querySelectorAll("[data-rake]"))
    button.onclick = () => {
      const azimuth = radians * button.dataset.rake, far = Math.cos(15 * radians);
      setLamp(far * Math.cos(azimuth), far * Math.sin(azimuth));
    };

  // ---- Hands on the picture: one pointer does what the tool says, two move and zoom.

  let begun = null; // of one pointer: where, in pixels of the picture, and what it may change
  const boxOf = (a, b) => ({ x: Math.min(a.x, b.x), y: Math.min(a.y, b.y), width: Math.abs(a.x - b.x), height: Math.abs(a.y - b.y) });

  function lampOnPicture(event) {
    const box = canvas.getBoundingClientRect(), half = Math.min(box.width, box.height) / 2;
    setLamp((event.clientX - box.left - box.width / 2) / half, -(event.clientY - box.top - box.height / 2) / half);
  }

  // Takes back what the first finger of two has done.
  function cancel() {
    state.box = null;
    if (state.tool === "lamp") setLamp(begun.lamp.x, begun.lamp.y);
    if (state.tool === "measure") { state.line = begun.line; tellLength(); }
    begun = null;
    redraw();
  }

  picture.trackPointers(canvas, {
    press(event) {
      const at = toPicture(event.clientX, event.clientY);
      begun = { at, lamp: { x: state.x, y: state.y }, line: state.line };
      if (state.tool === "lamp") lampOnPicture(event);
      state.isMeasuring = false;
      if (state.tool === "measure") { state.line = [at, at]; redraw(); }
    },
    drag(event, dx, dy) {
      const at = toPicture(event.clientX, event.clientY);
      if (state.tool === "lamp") lampOnPicture(event);
      if (state.tool === "pan") pan(dx, dy);
      if (state.tool === "measure") { state.line = [begun.at, at]; tellLength(); redraw(); }
      if (state.tool === "box") { state.box = boxOf(begun.at, at); redraw(); }
    },
    release(event) {
      if (event.type === "pointerup") {
        if (state.tool === "point") notes.add({ x: begun.at.x, y: begun.at.y, text: "" });
        if (state.tool === "box" && state.box && state.box.width > 0) notes.add({ ...state.box, text: "" });
      }
      begun = state.box = null;
      redraw();
    },
    cancel,
    pinch(dx, dy, factor, x, y) { pan(dx, dy); zoomAt(factor, x, y); },
    zoom: zoomAt,
  });
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    const far = event.shiftKey ? 5 : 60; // pixels of the page
    if (step) pan(far * step[0], far * step[1]);
    else if (event.key === "m" || event.key === "M") measureInMiddle();
    else if (event.key === "+" || event.key === "=") zoomInMiddle(1.25);
    else if (event.key === "-") zoomInMiddle(0.8);
    else if (event.key === "0") fit();
    else if (event.key === "1") one();
    else return;
    event.preventDefault();
  });
  by("fit").onclick = fit;
  by("one").onclick = one;
  by("in").onclick = () => zoomInMiddle(1.5);
  by("out").onclick = () => zoomInMiddle(1 / 1.5);

  // ---- Choices.

  for (const button of document.querySelectorAll("[data-tool]"))
    button.onclick = () => { state.tool = stage.dataset.tool = button.dataset.tool; picture.press("tool", state.tool); };
  const shown = ["color", "normals", "specular"];
  for (const button of document.querySelectorAll("[data-show]")) {
    button.disabled = !page.normals && button.dataset.show !== "color";
    button.onclick = () => {
      state.show = shown.indexOf(button.dataset.show);
      picture.press("show", button.dataset.show);
      by("gloss").hidden = state.show !== 2;
      redraw();
    };
  }
  by("brightness").oninput = (event) => { state.stops = +event.target.value; by("stops").textContent = event.target.value; redraw(); };
  by("exponent").oninput = (event) => { state.exponent = +event.target.value; redraw(); };
  by("diffuse").oninput = (event) => { state.diffuse = +event.target.value; redraw(); };

  // ---- Measuring.

  function tellLength() {
    by("length").textContent = state.line ? overlay.measured(state.line, state.pixelsPerMm) : "Choose Measure, then draw a line; or press M on the picture.";
  }
  // Begins a line in the middle of the canvas, which follows the middle while keys move the picture; or ends it there.
  function measureInMiddle() {
    state.isMeasuring = !state.isMeasuring;
    if (state.isMeasuring) state.line = [{ x: state.view.x, y: state.view.y }];
    redraw();
  }
  by("scale").value = state.pixelsPerMm || "";
  by("scale").oninput = (event) => { state.pixelsPerMm = Math.max(0, +event.target.value || 0); tellLength(); redraw(); };

  by("add").onclick = () => notes.add({ x: state.view.x, y: state.view.y, text: "" });
  by("about").textContent = `${page.width} × ${page.height} pixels, ${page.lights.length} lamps as ${page.planes} pictures. `
    + `White stands for ${page.white.toPrecision(3)} of the lamp's irradiance; the brightest thousandth of the values is clipped to it. Made with Surflect.`;

  new ResizeObserver(redraw).observe(stage);
  setLamp(0, 0);
  surflect.app = { state, tiles, notes, setLamp, draw, redraw, toScreen, toPicture, canvas };
})();
