// The names that the scripts of a page share; data, annotations, tiles and terms come as scripts that call functions of it.
"use strict";
window.surflect = {
  errors: [],
  data(read) { surflect.page = read; },
  annotations(read) { surflect.published = read.annotations; },
  // Tells visitors the first failure; later ones mostly follow from it.
  fail(problem) {
    surflect.errors.push(problem);
    const place = document.getElementById("problem");
    if (place.hidden) place.textContent = problem;
    place.hidden = false;
  },
};
window.addEventListener("error", (event) => { // scripts that are missing come here too, in the capturing phase
  if (event.target.dataset?.part || event.message?.startsWith("ResizeObserver")) return; // who asked for it tells; no failure
  surflect.fail(event.target === window ? `The page fails: ${event.message}`
    : `A file of the page is missing: ${event.target.getAttribute("src") ?? event.target.getAttribute("href")}`);
}, true);
window.addEventListener("unhandledrejection", (event) => surflect.fail(`The page fails: ${event.reason}`));
