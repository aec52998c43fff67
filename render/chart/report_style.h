// Style sheet and script of the report. The script is also XML text: it has neither < nor &.
#pragma once

#include <string_view>

namespace surflect::chart {

// Hues are those of Okabe and Ito, which people with any colour vision tell apart.
inline constexpr std::string_view kStyle = R"(
:root {
  color-scheme: light dark;
  --page: #fdfdfc; --card: #f5f5f3; --ink: #1c1e21; --soft: #5f656d; --rule: #dedfdc; --grid: #ebebe8;
  --h0: #0072b2; --h1: #d55e00; --h2: #009e73; --h3: #cc79a7; --h4: #e69f00; --h5: #56b4e9; --h6: #8a8d91;
  --glow: #fff3c4; --on0: #fff;
}
@media (prefers-color-scheme: dark) {
  :root {
    --page: #16181b; --card: #1f2226; --ink: #e8e9ea; --soft: #a2a8b0; --rule: #363a40; --grid: #2a2d32;
    --h0: #4aa8e0; --h1: #f08a4b; --h2: #2fbf95; --h3: #dd9cc2; --h4: #e9b44c; --h5: #8fd0f5; --h6: #7d8288;
    --glow: #4a4122; --on0: #000;
  }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body {
  margin: 0 auto; padding: 56px 40px 80px; max-width: 1200px; background: var(--page); color: var(--ink);
  font: 16px/1.55 Inter, system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif;
  font-variant-numeric: tabular-nums;
}
h1 { margin: 0 0 20px; font-size: 34px; line-height: 1.2; font-weight: 650; letter-spacing: -0.015em;
  overflow-wrap: anywhere; }
h2 { margin: 72px 0 8px; font-size: 22px; line-height: 1.3; font-weight: 650; letter-spacing: -0.01em; }
h3 { margin: 0 0 6px; font-size: 15px; line-height: 1.4; font-weight: 650; overflow-wrap: anywhere; }
p { margin: 0 0 16px; max-width: 72ch; }
h2 + p { color: var(--soft); margin-bottom: 24px; }
.kicker { margin: 0 0 8px; color: var(--soft); font-size: 14px; }
.lead { font-size: 20px; line-height: 1.5; max-width: 62ch; margin-bottom: 32px; }
.note { color: var(--soft); font-size: 14px; font-weight: 400; }
code { font: 13px/1.5 ui-monospace, "SF Mono", Menlo, Consolas, "DejaVu Sans Mono", monospace;
  overflow-wrap: anywhere; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 4px 24px; margin: 0; font-size: 14px; }
dt { color: var(--soft); }
dd { margin: 0; overflow-wrap: anywhere; min-width: 0; }
.badge { display: inline-block; min-width: 22px; padding: 0 6px; border-radius: 11px; background: var(--ink);
  color: var(--page); font-size: 13px; font-weight: 650; line-height: 22px; text-align: center; }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(260px, 1fr)); gap: 20px; margin: 40px 0; }
.card { display: grid; grid-row: span 3; grid-template-rows: subgrid; row-gap: 0; padding: 20px 22px 18px;
  border-radius: 10px; background: var(--card); min-width: 0; }
.card h3 { margin-bottom: 0; }
.card .big { margin: 12px 0 10px; font-size: 30px; line-height: 1.2; font-weight: 600; letter-spacing: -0.02em; }
.card .big small { color: var(--soft); font-size: 15px; font-weight: 400; letter-spacing: 0; }
.card dl { grid-template-columns: 1fr max-content; gap: 2px 12px; align-content: start; }
.card dd { text-align: right; }
.card dd.note { grid-column: 1 / -1; margin-top: -3px; font-size: 13px; }
.card code { color: var(--soft); }
.plots { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 40px; }
figure { display: flex; flex-direction: column; margin: 0; min-width: 0; }
figcaption { margin-bottom: 8px; }
figcaption .note { margin: 0; }
.knobs figcaption { flex: 1; }
svg { display: block; width: 100%; height: auto; }
svg text { font: 12px Inter, system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif;
  fill: var(--soft); }
.grid { stroke: var(--grid); stroke-width: 1; }
.edge { stroke: var(--rule); stroke-width: 1; }
.full { stroke-width: 1.2; stroke-dasharray: 5 4; fill: none; }
.front { fill: none; stroke-width: 2; stroke-linejoin: round; opacity: 0.75; }
.across { stroke: var(--ink); }
.leader { stroke: var(--soft); stroke-width: 1; }
svg text.label { fill: var(--ink); font-weight: 650; paint-order: stroke; stroke: var(--page); stroke-width: 4px;
  stroke-linejoin: round; }
svg text.value { fill: var(--ink); font-weight: 600; }
.mark { stroke: var(--page); stroke-width: 1; opacity: 0.42; }
.mark.best { opacity: 1; }
.mark.chosen { opacity: 1; stroke: var(--ink); stroke-width: 2; }
.mark.bent { fill: var(--page); stroke-width: 1.6; opacity: 0.6; }
.mark.bent.chosen { opacity: 1; stroke-width: 2.4; }
a:hover .mark, a:focus .mark, .on .mark { opacity: 1; stroke: var(--ink); stroke-width: 2.5; }
.s0 { stroke: var(--h0); } .s1 { stroke: var(--h1); } .s2 { stroke: var(--h2); } .s3 { stroke: var(--h3); }
.s4 { stroke: var(--h4); } .s5 { stroke: var(--h5); } .s6 { stroke: var(--h6); }
.f0 { fill: var(--h0); } .f1 { fill: var(--h1); } .f2 { fill: var(--h2); } .f3 { fill: var(--h3); }
.f4 { fill: var(--h4); } .f5 { fill: var(--h5); } .f6 { fill: var(--h6); }
.b0 { background: var(--h0); } .b1 { background: var(--h1); } .b2 { background: var(--h2); }
.b3 { background: var(--h3); } .b4 { background: var(--h4); } .b5 { background: var(--h5); }
.b6 { background: var(--h6); }
.legend { display: flex; flex-wrap: wrap; gap: 4px 20px; margin: 12px 0 0; padding: 0; list-style: none;
  font-size: 14px; color: var(--soft); }
.legend li { display: flex; align-items: center; gap: 7px; min-width: 0; overflow-wrap: anywhere; }
.legend svg { width: 18px; height: 18px; flex: none; }
.legend i { width: 12px; height: 12px; border-radius: 3px; flex: none; }
.knobs { display: grid; grid-template-columns: repeat(auto-fill, minmax(230px, 1fr)); gap: 40px 32px; }
.bars { display: grid; grid-template-columns: minmax(120px, 260px) 1fr; gap: 14px 20px; align-items: center; }
.bars .name { font-size: 14px; line-height: 1.4; min-width: 0; }
.bar { display: flex; align-items: center; height: 30px; }
.bar i { height: 100%; flex: none; overflow: hidden; border-right: 1px solid var(--page);
  color: #000; font: normal 12px/30px Inter, system-ui, sans-serif; text-align: center; }
.bar .b0 { color: var(--on0); }
.bars + .legend { margin-top: 22px; }
.bar b { padding-left: 10px; font-size: 14px; font-weight: 600; white-space: nowrap; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(200px, 1fr)); gap: 20px;
  margin: 0 0 40px; }
.pictures figure { max-width: 360px; }
.pictures figcaption { overflow: hidden; text-overflow: ellipsis; white-space: nowrap; }
.pictures img { display: block; width: 100%; height: auto; margin-bottom: 6px; border-radius: 4px;
  background: #000; }
.scale { height: 12px; border-radius: 3px; margin-top: 4px; background: linear-gradient(90deg, #000004,
  #1d1147, #51127c, #822681, #b63679, #e65164, #fb8861, #fec287, #fcfdbf); }
.ends { display: flex; justify-content: space-between; font-size: 13px; color: var(--soft); }
.scroll { overflow-x: auto; margin: 0 -12px; }
table { border-collapse: collapse; font-size: 14px; line-height: 1.4; min-width: 100%; }
th, td { padding: 6px 12px; text-align: right; white-space: nowrap; border-bottom: 1px solid var(--grid); }
th { vertical-align: bottom; font-weight: 600; border-bottom-color: var(--rule); }
th small { display: block; font-weight: 400; color: var(--soft); font-size: 12px; }
th button { all: unset; cursor: pointer; }
th button:focus-visible { outline: 2px solid var(--h0); outline-offset: 2px; }
th[aria-sort=ascending] button::after { content: " ↑"; } th[aria-sort=descending] button::after { content: " ↓"; }
.left { text-align: left; }
.setting { min-width: 26ch; white-space: normal; }
tr.front-row td { font-weight: 600; }
tbody tr:hover, tbody tr:target, tbody tr.on { background: var(--glow); }
.command { display: flex; gap: 10px; align-items: center; font-weight: 400; }
.command code { display: block; max-width: 46ch; overflow: hidden; text-overflow: ellipsis; white-space: nowrap;
  user-select: all; color: var(--soft); }
.copy { flex: none; padding: 1px 9px; border: 1px solid var(--rule); border-radius: 6px; background: none;
  color: inherit; font: inherit; font-size: 12px; line-height: 20px; cursor: pointer; }
.terms dt { color: var(--ink); font-weight: 600; }
.terms { gap: 10px 24px; font-size: 15px; max-width: 90ch; }
#tip { position: fixed; z-index: 2; left: 0; top: 0; max-width: min(440px, 92vw); padding: 10px 14px;
  border: 1px solid var(--rule); border-radius: 8px; background: var(--page); color: var(--ink);
  box-shadow: 0 6px 24px rgb(0 0 0 / 0.16); font-size: 13px; line-height: 1.5; white-space: pre-line;
  overflow-wrap: anywhere; pointer-events: none; }
#tip::first-line { font-weight: 650; }
@media (max-width: 860px) { .plots { grid-template-columns: minmax(0, 1fr); } }
@media (max-width: 620px) {
  body { padding: 28px 16px 56px; }
  h1 { font-size: 26px; } h2 { margin-top: 56px; } .lead { font-size: 18px; }
  dl:not(.card dl) { grid-template-columns: minmax(0, 1fr); gap: 0; }
  dl:not(.card dl) dd { margin-bottom: 10px; }
  .knobs { grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 32px 20px; }
  .cards { grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 14px; margin: 28px 0; }
  .card { padding: 14px; } .card .big { font-size: 23px; } .card .big small { display: block; font-size: 14px; }
  .card dl { font-size: 13px; }
  .pictures { grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 14px; }
  .bars { grid-template-columns: minmax(0, 1fr); gap: 2px; } .bars .name:not(:first-child) { margin-top: 14px; }
  .scroll { margin: 0 -16px; padding: 0 4px; }
}
)";

// Tooltips, links between marks and rows, sorting, copying, and photographs under the pointer. The page says
// everything without it, too.
inline constexpr std::string_view kScript = R"(
'use strict';
const all = (what, from = document) => Array.from(from.querySelectorAll(what));
const tip = document.createElement('div');
tip.id = 'tip';
tip.hidden = true;
document.body.append(tip);

const light = (point, on) =>
  all('[data-point="' + point + '"]').forEach(e => e.classList.toggle('on', on));
for (const e of all('[data-point]')) {
  const title = e.querySelector('title');
  const words = title ? title.textContent : '';
  if (title) title.remove();
  const show = place => {
    light(e.dataset.point, true);
    if (!words) return;
    tip.textContent = words;
    tip.hidden = false;
    const right = document.documentElement.clientWidth - tip.offsetWidth - 8;
    const above = place.y - tip.offsetHeight - 14;
    tip.style.left = Math.max(8, Math.min(right, place.x + 14)) + 'px';
    tip.style.top = (above > 8 ? above : place.y + 18) + 'px';
  };
  const hide = () => { light(e.dataset.point, false); tip.hidden = true; };
  e.addEventListener('pointermove', show);
  e.addEventListener('pointerleave', hide);
  e.addEventListener('focus', () => {
    const box = e.getBoundingClientRect();
    show({x: box.right, y: box.top});
  });
  e.addEventListener('blur', hide);
}

for (const button of all('th button')) button.addEventListener('click', () => {
  const head = button.closest('th');
  const column = Array.from(head.parentNode.children).indexOf(head);
  const up = head.getAttribute('aria-sort') !== 'ascending';
  all('th').forEach(other => other.removeAttribute('aria-sort'));
  head.setAttribute('aria-sort', up ? 'ascending' : 'descending');
  const body = head.closest('table').tBodies[0];
  const key = row => row.children[column].dataset.key;
  const order = (a, b) => head.classList.contains('left') ? key(a).localeCompare(key(b)) : key(a) - key(b);
  Array.from(body.rows).sort((a, b) => up ? order(a, b) : order(b, a)).forEach(row => body.append(row));
});

for (const button of all('.copy')) button.addEventListener('click', async () => {
  const code = button.parentNode.querySelector('code');
  try {
    await navigator.clipboard.writeText(code.textContent);
  } catch (refused) {
    getSelection().selectAllChildren(code);
    document.execCommand('copy');
  }
  button.textContent = 'Copied';
  setTimeout(() => { button.textContent = 'Copy'; }, 1200);
});

for (const picture of all('img[data-truth]')) {
  const own = picture.src;
  picture.addEventListener('pointerenter', () => {
    picture.src = document.getElementById(picture.dataset.truth).src;
  });
  picture.addEventListener('pointerleave', () => { picture.src = own; });
}
)";

} // namespace surflect::chart
