// What pages with a picture share: WebGL, one drawing a frame, mouse and fingers, buttons of a choice.
"use strict";
(() => {
  const clamp = (x, least, most) => Math.min(most, Math.max(least, x));

  // WebGL 2 of a canvas; none where the browser has none, which visitors are told.
  function contextOf(canvas, attributes) {
    const gl = canvas.getContext("webgl2", { antialias: false, preserveDrawingBuffer: true, ...attributes });
    if (!gl) surflect.fail("This browser draws no WebGL 2, which the picture needs.");
    canvas.addEventListener("webglcontextlost", () => surflect.fail("The browser took the graphics away: load the page again."));
    return gl;
  }

  // A program, and `at`: the places of its uniforms by name.
  function programOf(gl, vertexText, fragmentText) {
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertexText], [gl.FRAGMENT_SHADER, fragmentText]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    return { program, at: new Proxy({}, { get: (known, name) => known[name] ??= gl.getUniformLocation(program, name) }) };
  }

  // GLSL: linear light as screens encode it [IEC 61966-2-1].
  const srgb = `
    vec3 srgb(vec3 x) {
      x = clamp(x, 0.0, 1.0);
      return mix(12.92 * x, 1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, x));
    }`;

  // Gives the canvas the pixels that its stage covers on the screen.
  function fill(canvas, stage) {
    const width = Math.max(1, Math.round(stage.clientWidth * devicePixelRatio)), height = Math.max(1, Math.round(stage.clientHeight * devicePixelRatio));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  }

  // A function that asks for a drawing; many wishes before the next frame are one.
  function onceAFrame(draw) {
    let asked = false;
    return () => {
      if (asked) return;
      asked = true;
      requestAnimationFrame((time) => { asked = false; draw(time); });
    };
  }

  // Pointers on the picture. One: press(event), drag(event, dx, dy), release(event). A second one calls cancel() instead
  // of release(), and both together pinch(dx, dy, factor, x, y); the wheel calls zoom(factor, x, y). Pixels of the page.
  function trackPointers(canvas, on) {
    const held = new Map();
    let drags = false;
    const pinch = () => {
      const [a, b] = [...held.values()];
      return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(a.x - b.x, a.y - b.y) };
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button) return; // the main one alone
      canvas.setPointerCapture(event.pointerId);
      held.set(event.pointerId, { x: event.clientX, y: event.clientY });
      if (held.size > 1) {
        if (drags) on.cancel();
        drags = false;
        return;
      }
      drags = true;
      on.press(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      const last = held.get(event.pointerId);
      if (!last) return;
      const before = held.size === 2 ? pinch() : null;
      held.set(event.pointerId, { x: event.clientX, y: event.clientY });
      if (before) {
        const now = pinch();
        on.pinch(now.x - before.x, now.y - before.y, before.apart > 0 ? now.apart / before.apart : 1, now.x, now.y);
      } else if (drags) on.drag(event, event.clientX - last.x, event.clientY - last.y);
    });
    const release = (event) => {
      if (held.delete(event.pointerId) && drags) on.release(event);
      drags = drags && held.size > 0;
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      on.zoom(Math.exp(-clamp(event.deltaY * (event.deltaMode ? 30 : 1), -300, 300) / 400), event.clientX, event.clientY);
    }, { passive: false });
  }

  // Shows which button of a choice is pressed: those with the attribute data-CHOICE.
  function press(choice, value) {
    for (const button of document.querySelectorAll(`button[data-${choice}]`))
      button.setAttribute("aria-pressed", String(button.dataset[choice] === value));
  }

  surflect.picture = { clamp, contextOf, programOf, srgb, fill, onceAFrame, trackPointers, press };
})();
