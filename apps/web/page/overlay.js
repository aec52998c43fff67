// What lies over the picture: scale bar, measured line, annotations.
"use strict";
(() => {
  const make = (name, attributes, text) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text !== undefined) element.textContent = text;
    return element;
  };
  const twice = (name, attributes) => [make(name, { ...attributes, class: "back" }), make(name, { ...attributes, class: "front" })];

  // Length of a scale bar: the longest 1, 2 or 5 times a power of ten that is at most `most`.
  function barLength(most) {
    const power = 10 ** Math.floor(Math.log10(most));
    return [5, 2, 1].map((digit) => digit * power).find((length) => length <= most);
  }

  const lengthText = (mm) => mm >= 1000 ? `${+(mm / 1000).toPrecision(4)} m` : mm >= 10 ? `${+(mm / 10).toPrecision(4)} cm`
    : mm >= 0.1 ? `${+mm.toPrecision(4)} mm` : `${+(1000 * mm).toPrecision(4)} µm`;

  // Length of a line between two points in pixels of the full picture.
  function measured([a, b], pixelsPerMm) {
    const pixels = Math.hypot(b.x - a.x, b.y - a.y);
    return `${pixels.toFixed(1)} pixels` + (pixelsPerMm > 0 ? `, ${lengthText(pixels / pixelsPerMm)}` : "");
  }

  // Scale bar in the lower left corner; nothing without a scale, pixels of the page a millimetre.
  function scaleBar(pixelsPerMm, height) {
    if (!(pixelsPerMm > 0)) return [];
    const mm = barLength(160 / pixelsPerMm), length = mm * pixelsPerMm, y = height - 64;
    return [...twice("path", { d: `M12 ${y - 5}V${y}H${12 + length}V${y - 5}`, id: "bar" }), make("text", { x: 16, y: y - 8 }, lengthText(mm))];
  }

  // toScreen: a point of the full picture to pixels of the page; scale: pixels of the page a pixel of the picture.
  function drawOverlay(svg, { toScreen, scale, height, pixelsPerMm, line, box, notes, chosen }) {
    const parts = scaleBar(pixelsPerMm * scale, height);
    notes.forEach((note, i) => {
      const group = make("g", i === chosen ? { class: "chosen" } : {}), p = toScreen(note);
      if (note.width !== undefined) {
        const q = toScreen({ x: note.x + note.width, y: note.y + note.height });
        group.append(...twice("rect", { x: p.x, y: p.y, width: Math.max(0, q.x - p.x), height: Math.max(0, q.y - p.y) }));
      } else group.append(...twice("circle", { cx: p.x, cy: p.y, r: 7 }));
      group.append(make("text", { x: p.x + 11, y: p.y - 9 }, `${i + 1} ${note.text}`.trim()));
      parts.push(group);
    });
    if (box) {
      const p = toScreen(box), q = toScreen({ x: box.x + box.width, y: box.y + box.height });
      parts.push(...twice("rect", { x: p.x, y: p.y, width: q.x - p.x, height: q.y - p.y }));
    }
    if (line) {
      const [a, b] = line.map(toScreen);
      parts.push(...twice("path", { d: `M${a.x} ${a.y}L${b.x} ${b.y}` }),
        make("text", { x: (a.x + b.x) / 2 + 8, y: (a.y + b.y) / 2 - 8 }, measured(line, pixelsPerMm)));
    }
    svg.replaceChildren(...parts);
  }

  surflect.overlay = { drawOverlay, scaleBar, measured, barLength, lengthText };
})();
