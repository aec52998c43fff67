// The rig from outside: captured cameras and lights, the script's lamps, the object and the present camera.

import { basis, dollied, orbited, poseOfModel, project } from "./camera.js";
import { byId, setPressed } from "./dom.js";
import { colorOf, draggedOnSphere, hexOfLinear, inkOn, markerPlace } from "./lamps.js";
import { add, cross, isFinite3, length, perpendicular, scale, sub } from "./vec.js";

const radians = Math.PI / 180;

// Corners of a camera's frustum, `depth` along its axis.
function frustum(pose, aspect, depth) {
  const { right, up, forward } = basis(pose),
    half = Math.tan((pose.fov_deg * radians) / 2) * depth;
  const middle = add(pose.position, scale(forward, depth));
  return [
    [-1, -1],
    [1, -1],
    [1, 1],
    [-1, 1],
  ].map(([x, y]) => add(middle, add(scale(right, x * half * aspect), scale(up, y * half))));
}

export class Rig {
  // hooks: snap(name), select(lamp), move(lamp, place, event), ended(), resized().
  constructor(app, hooks) {
    Object.assign(this, {
      app,
      hooks,
      canvas: byId("rig"),
      box: byId("rig-box"),
      pose: null,
      model: null,
      spots: [],
    });
    byId("rig-size").addEventListener("click", () => this.toggleSize());
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    this.listen();
  }

  toggleSize() {
    setPressed(byId("rig-size"), this.box.classList.toggle("large"));
    this.hooks.resized();
  }

  // The rig is seen from where all of its cameras and lights fit.
  look() {
    const model = this.app.model();
    if (this.model === model) return;
    this.model = model;
    const reach = Math.max(
      2 * model.radius,
      ...[...model.cameras, ...model.lights]
        .filter((item) => item.position)
        .map((item) => length(sub(item.position, model.middle)))
        .map((d) => Math.min(d, 20 * model.radius)),
    );
    const pose = poseOfModel(model);
    this.pose = dollied(
      orbited({ ...pose, fov_deg: 35 }, model.up, 0.6, 0.25),
      (3.3 * reach) / length(sub(pose.position, pose.look_at)),
    );
    this.reach = reach;
  }

  aspect() {
    return this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight);
  }

  at(point) {
    const { x, y, depth } = project(this.pose, this.aspect(), point);
    return { x: x * this.canvas.clientWidth, y: y * this.canvas.clientHeight, depth };
  }

  line(points, close) {
    const { context } = this;
    context.beginPath();
    points.forEach((point, i) => {
      const { x, y } = this.at(point);
      if (i) context.lineTo(x, y);
      else context.moveTo(x, y);
    });
    if (close) context.closePath();
    context.stroke();
  }

  camera(pose, aspect, depth) {
    const corners = frustum(pose, aspect, depth);
    this.line(corners, true);
    for (const corner of corners) this.line([pose.position, corner]);
  }

  dot(point, radius, fill) {
    const { x, y } = this.at(point),
      { context } = this;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    if (fill) context.fill();
    else context.stroke();
    return { x, y };
  }

  draw() {
    const { canvas, app } = this,
      { clientWidth: width, clientHeight: height } = canvas;
    if (!width || !height) return;
    this.look();
    const model = app.model(),
      style = getComputedStyle(this.box),
      color = (name) => style.getPropertyValue(name).trim();
    canvas.width = width * devicePixelRatio;
    canvas.height = height * devicePixelRatio;
    const context = (this.context = canvas.getContext("2d"));
    context.scale(devicePixelRatio, devicePixelRatio);
    context.lineWidth = 1;
    this.spots = [];
    this.drawObject(model, color);
    const size = 0.09 * this.reach,
      now = app.scene.captured();
    context.strokeStyle = color("--rig-line");
    for (const camera of model.cameras) {
      const pose = {
        position: camera.position,
        look_at: add(camera.position, camera.forward),
        up: camera.up,
        fov_deg: camera.fov_deg,
      };
      context.globalAlpha = camera === now ? 1 : camera.heldOut ? 0.35 : 0.7;
      this.camera(pose, camera.width / camera.height, size);
      this.spots.push({ ...this.at(camera.position), camera: camera.name });
    }
    context.globalAlpha = 0.8;
    context.fillStyle = color("--rig-light");
    for (const light of model.lights) {
      const place =
        light.position ??
        add(
          model.middle,
          scale(light.direction, (0.9 * this.reach) / Math.max(1e-9, length(light.direction))),
        );
      this.dot(place, 1.5, true);
    }
    context.globalAlpha = 1;
    if (app.stage) {
      context.strokeStyle = color("--accent");
      context.lineWidth = 1.5;
      this.camera(app.scene.pose(), app.stage.aspect(), 2 * size);
    }
    this.drawLamps(model, color);
  }

  drawObject(model, color) {
    const { context } = this,
      { middle, radius, up } = model,
      side = perpendicular(up),
      front = cross(up, side);
    context.strokeStyle = color("--rig-line");
    context.globalAlpha = 0.6;
    const circle = (a, b) =>
      this.line(
        Array.from({ length: 48 }, (_, i) =>
          add(
            middle,
            add(
              scale(a, radius * Math.cos((i * Math.PI) / 24)),
              scale(b, radius * Math.sin((i * Math.PI) / 24)),
            ),
          ),
        ),
        true,
      );
    circle(side, front);
    circle(side, up);
    circle(front, up);
    context.globalAlpha = 1;
    [
      ["#e5484d", [1, 0, 0]],
      ["#30a46c", [0, 1, 0]],
      ["#3b82f6", [0, 0, 1]],
    ].forEach(([stroke, axis]) => {
      context.strokeStyle = stroke;
      this.line([middle, add(middle, scale(axis, 0.7 * radius))]);
    });
  }

  drawLamps(model, color) {
    const { context, app } = this;
    Object.assign(context, { font: "bold 9px sans-serif", textAlign: "center", textBaseline: "middle" });
    app.scene.values().light.forEach((lamp, index) => {
      const place = markerPlace(lamp, model);
      if (!isFinite3(place)) return;
      const isChosen = index === app.selectedLamp;
      context.fillStyle = hexOfLinear(colorOf(lamp));
      context.strokeStyle = color(isChosen ? "--accent" : "--rig-text");
      context.lineWidth = isChosen ? 3 : 1;
      context.globalAlpha = app.isLit(index) ? 1 : 0.35;
      if (lamp.type === "directional")
        this.line([place, add(model.middle, scale(sub(place, model.middle), 0.6))]);
      const spot = this.dot(place, 7, true);
      this.dot(place, 7, false);
      context.fillStyle = inkOn(colorOf(lamp));
      context.fillText(String(index + 1), spot.x, spot.y + 0.5);
      this.spots.unshift({ ...spot, lamp: index, place });
    });
    context.globalAlpha = 1;
  }

  listen() {
    const { canvas } = this;
    let grabbed = null,
      offset = { x: 0, y: 0 }, // of the pointer from the lamp grabbed
      last = null,
      travelled = 0;
    const local = (event) => {
      const box = canvas.getBoundingClientRect();
      return { x: event.clientX - box.left, y: event.clientY - box.top };
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.pose) return;
      last = local(event);
      travelled = 0;
      const near = (spot) => Math.hypot(spot.x - last.x, spot.y - last.y);
      grabbed =
        this.spots
          .filter((spot) => near(spot) < 10)
          .sort((a, b) => (a.lamp === undefined) - (b.lamp === undefined) || near(a) - near(b))[0] ?? null;
      if (grabbed) offset = { x: last.x - grabbed.x, y: last.y - grabbed.y };
      if (grabbed?.lamp !== undefined) this.hooks.select(grabbed.lamp);
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!last) return;
      const now = local(event),
        dx = now.x - last.x,
        dy = now.y - last.y,
        model = this.app.model();
      travelled += Math.hypot(dx, dy);
      if (grabbed?.lamp !== undefined && travelled > 2) {
        const x = (now.x - offset.x) / canvas.clientWidth,
          y = (now.y - offset.y) / canvas.clientHeight;
        grabbed.place = draggedOnSphere(grabbed.place, model, this.pose, this.aspect(), x, y);
        this.hooks.move(grabbed.lamp, grabbed.place, event);
      } else if (!grabbed) {
        const k = Math.PI / canvas.clientHeight;
        this.pose = orbited(this.pose, model.up, -dx * k, dy * k);
        this.draw();
      }
      last = now;
    });
    const end = () => {
      if (grabbed?.camera && travelled < 4) this.hooks.snap(grabbed.camera);
      if (last) this.hooks.ended();
      grabbed = last = null;
    };
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
    canvas.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        this.pose = dollied(this.pose, Math.exp(event.deltaY * 0.001));
        this.draw();
      },
      { passive: false },
    );
  }
}
