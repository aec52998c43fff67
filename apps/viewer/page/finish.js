// Exposure, tone and background: those of the script where it gives them, so that Save keeps them, else those of the view.

const paths = { exposure: ["camera", "exposure"], tone: ["output", "tone"], background: ["output", "background"] };

const isColor = (x) => Array.isArray(x) && x.length === 3 && x.every((c) => c >= 0 && c <= 1);
// What the page's controls can show of the script's values.
const fits = {
  exposure: (x) => Number.isFinite(x),
  tone: (x) => x === "none" || x === "filmic",
  background: isColor,
};

function scripted(doc, key) {
  const [table, name] = paths[key],
    value = doc[table]?.[name];
  return key === "background" && value === "transparent" ? undefined : value;
}

// Why a control cannot change the script's value; "" if it can.
export function whyFixed({ doc }, key) {
  const value = scripted(doc, key);
  if (value === undefined || fits[key](value)) return "";
  if (key === "exposure") return "The script's exposure moves; edit it there.";
  return `The script gives ${key} ${JSON.stringify(value)}; edit it there.`;
}

// The value that is in force; that of the view where a control cannot show the script's.
export function finishOf({ doc, view }, key) {
  const value = scripted(doc, key);
  return value !== undefined && fits[key](value) ? value : view[key];
}

// Largest exposure that a control can set, up or down.
export const mostStops = (store) => (isScripted(store, "exposure") ? 30 : 8);

export const isScripted = ({ doc }, key) => scripted(doc, key) !== undefined;

// Changes the script where it has the key, else the view.
export function setFinish(store, key, value, stamp) {
  if (whyFixed(store, key)) return;
  if (!isScripted(store, key)) return store.setView({ [key]: value }, stamp);
  const [table, name] = paths[key];
  store.edit((doc) => (doc[table] = { ...doc[table], [name]: value }), { gesture: `finish ${key}`, stamp });
}

// A camera of the shot's with the exposure that the shot has.
export function exposed(camera, { doc }) {
  const exposure = doc.camera?.exposure;
  return exposure === undefined ? camera : { ...camera, exposure };
}
