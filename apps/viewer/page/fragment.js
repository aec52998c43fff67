// The page's state in the address: the doc's difference from the server's doc and the view, as base64url of JSON.

// What turns `from` into `to`: undefined if nothing; { v } a new value; { o, x } changed and deleted keys; { a } items.
export function difference(from, to) {
  if (from === to) return undefined;
  const isObject = (value) => value !== null && typeof value === "object" && !Array.isArray(value);
  if (Array.isArray(from) && Array.isArray(to) && from.length === to.length) {
    const a = {};
    to.forEach((item, i) => {
      const d = difference(from[i], item);
      if (d) a[i] = d;
    });
    return Object.keys(a).length ? { a } : undefined;
  }
  if (isObject(from) && isObject(to)) {
    const o = {},
      x = Object.keys(from).filter((key) => !(key in to));
    for (const key of Object.keys(to)) {
      const d = key in from ? difference(from[key], to[key]) : { v: to[key] };
      if (d) o[key] = d;
    }
    if (!Object.keys(o).length && !x.length) return undefined;
    return x.length ? { o, x } : { o };
  }
  return { v: to };
}

// `from` with a difference put in. Throws TypeError if it does not fit.
export function patched(from, d) {
  if (!d) return from;
  if ("v" in d) return d.v;
  if (d.a) return from.map((item, i) => patched(item, d.a[i]));
  if (from === null || typeof from !== "object" || Array.isArray(from))
    throw new TypeError("no object to patch");
  const to = { ...from };
  for (const key of d.x ?? []) delete to[key];
  for (const [key, change] of Object.entries(d.o)) {
    if (key === "__proto__") throw new TypeError("no key of a script");
    to[key] = patched(from[key], change);
  }
  return to;
}

// Text of a doc without regard to the order of its keys and to empty lists of lamps or warps, which the server may change.
function canonical(doc) {
  const sorted = (_, value) =>
    value !== null && typeof value === "object" && !Array.isArray(value)
      ? Object.fromEntries(Object.entries(value).sort(([a], [b]) => (a < b ? -1 : 1)))
      : value;
  const isThere = ([key, value]) => !(["light", "warp"].includes(key) && value.length === 0);
  return JSON.stringify(Object.fromEntries(Object.entries(doc).filter(isThere)), sorted);
}

// Checksum of a doc [FNV-1a], to tell whether a difference still fits.
export function checksum(doc) {
  let hash = 0x811c9dc5;
  for (const c of canonical(doc)) hash = Math.imul(hash ^ c.codePointAt(0), 0x01000193) >>> 0;
  return hash.toString(36);
}

export function encode(value) {
  const bytes = new TextEncoder().encode(JSON.stringify(value));
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return btoa(text).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

// Null if the text is not an encoded state.
export function decode(text) {
  try {
    const raw = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
    return JSON.parse(new TextDecoder().decode(Uint8Array.from(raw, (c) => c.charCodeAt(0))));
  } catch {
    return null;
  }
}

export const readFragment = () => new URLSearchParams(location.hash.slice(1));

export function writeFragment(state) {
  history.replaceState(null, "", state ? "#s=" + encode(state) : location.pathname);
}
