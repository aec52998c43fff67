// Makes elements of the page.

// An element. `props`: class, text, data (data-* attributes), on (listeners); true and strings become attributes.
export function el(tag, props = {}, ...children) {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(props)) {
    if (value === undefined || value === null || value === false) continue;
    if (key === "class") node.className = value;
    else if (key === "text") node.textContent = value;
    else if (key === "data") Object.assign(node.dataset, value);
    else if (key === "on")
      for (const [type, listener] of Object.entries(value)) node.addEventListener(type, listener);
    else if (key === "value") node.value = value;
    else node.setAttribute(key, value === true ? "" : value);
  }
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}

export const byId = (id) => document.getElementById(id);

// Opens a section of the panel and scrolls it into view.
export function openSection(id) {
  const section = byId(id);
  section.open = true;
  section.scrollIntoView({ block: "start" });
}

// Scrolls the panel, where it is beside the picture, so far that a part of it is seen from its beginning.
export function scrollInPanel(node) {
  const panel = byId("panel-body"),
    box = node.getBoundingClientRect(),
    around = panel.getBoundingClientRect();
  if (panel.scrollHeight <= panel.clientHeight || !box.height) return;
  if (box.top < around.top) panel.scrollTop += box.top - around.top;
  else if (box.bottom > around.bottom)
    panel.scrollTop += Math.min(box.bottom - around.bottom, box.top - around.top);
}

// A button; `name` is its label for screen readers where its text is only a sign.
export function button(text, onClick, { id, name, title, pressed, data, className } = {}) {
  return el("button", {
    type: "button",
    id,
    class: className,
    text,
    "aria-label": name,
    title: title ?? name,
    data,
    "aria-pressed": pressed === undefined ? undefined : String(pressed),
    on: { click: onClick },
  });
}

export const setPressed = (node, pressed) => node.setAttribute("aria-pressed", String(Boolean(pressed)));

// A drop-down list of [value, text] pairs.
export function select(options, value, onChange, { id, name, data } = {}) {
  const node = el("select", { id, "aria-label": name, data, on: { change: () => onChange(node.value) } });
  fillSelect(node, options, value);
  return node;
}

export function fillSelect(node, options, value) {
  const key = JSON.stringify(options);
  if (node.dataset.filled !== key) {
    node.replaceChildren(...options.map(([v, text]) => el("option", { value: v, text })));
    node.dataset.filled = key;
  }
  node.value = value;
}

// A labelled row: the label's text on the left, controls on the right.
export function row(text, control, extra) {
  const label = el("label", { class: "row-label", text });
  if (control.id) label.htmlFor = control.id;
  return el("div", { class: "row" }, label, control, extra ?? null);
}

// A check box with its label.
export function checkBox(text, checked, onChange, { id, data, title } = {}) {
  const box = el("input", { type: "checkbox", id, data, on: { change: () => onChange(box.checked) } });
  box.checked = checked;
  const label = el("label", { class: "check", title }, box, el("span", { text }));
  return { node: label, box };
}

let ids = 0;

// An id that no other control of the page has.
export const freshId = () => `field-${++ids}`;
