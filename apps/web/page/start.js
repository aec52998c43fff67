// The names that the scripts of a page share; data, annotations and tiles come as scripts that call functions of it.
"use strict";
window.surflect = {
  errors: [],
  data(read) { surflect.page = read; },
  annotations(read) { surflect.published = read.annotations; },
};
window.addEventListener("error", (event) => surflect.errors.push(String(event.message)));
window.addEventListener("unhandledrejection", (event) => surflect.errors.push(String(event.reason)));
