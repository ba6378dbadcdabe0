#include "cli/view/page.h"

namespace nacre::cli::view {

const char* const kPage = R"HTML(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Nacre</title>
<meta name="viewport" content="width=device-width">
<link rel="icon" href="data:,">
<style>
:root{color-scheme:dark}
body{margin:0;padding:1.2rem;background:#14161a;color:#d9dce2;font:15px/1.45 system-ui,sans-serif}
header{display:flex;gap:1rem;align-items:baseline;flex-wrap:wrap}
h1{font-size:1.25rem;margin:0}h2{font-size:.9rem;margin:1rem 0 .3rem;color:#8f97a5}
#facts,figcaption,small{color:#8f97a5}#error{color:#ff7a6b}
main{display:flex;gap:1.5rem;flex-wrap:wrap;margin-top:.8rem}
figure{margin:0 0 .8rem}section{min-width:20rem}
canvas,img{image-rendering:pixelated;background:#000;border:1px solid #2b2f37;display:block}
#sample{width:480px;cursor:crosshair;max-width:100%}#frame{max-width:900px;image-rendering:auto}
.row{display:flex;gap:.8rem;flex-wrap:wrap}.row canvas{width:200px;height:200px}
.sheet img{width:110px}label{display:flex;gap:.6rem;align-items:center}input[type=range]{flex:1}
output{font-variant-numeric:tabular-nums;min-width:8rem}
svg{width:520px;max-width:100%;background:#1b1e24;border:1px solid #2b2f37}
svg text{fill:#8f97a5;font-size:11px}[hidden]{display:none!important}
</style></head><body>
<header><h1 id="title">Nacre</h1><span id="facts"></span><span id="error"></span></header>
<main id="of-sample" hidden><section>
<figure><img id="sample" alt="the sample" draggable="false">
<figcaption id="caption"></figcaption></figure>
<label><input type="radio" name="mode" value="slice" id="mode-slice" checked> click a point x_i:
its slice</label>
<label><input type="radio" name="mode" value="light" id="mode-light"> move a disc of light</label>
<label>radius<input type="range" id="radius" min="0" max="100" value="12">
<output id="radius-mm"></output></label>
<label>exposure<input type="range" id="ev" min="-4" max="10" step=".25" value="0">
<output id="ev-stops"></output></label>
<label id="with-terms" hidden>terms<input type="range" id="terms" min="1" max="1" value="1">
<output id="terms-error"></output></label>
<svg id="curve" viewBox="0 0 520 150" hidden></svg>
</section><section id="slice-section"><h2>Slice R_d(x_i, d), mm⁻², logarithmic</h2>
<div id="where"></div><div class="row" id="slices"></div>
<h2>Mean on rings of |d|</h2><svg id="profile" viewBox="0 0 520 240"></svg>
<h2 id="residual-title"></h2><div id="residual-l2"></div><div class="row" id="residuals"></div></section>
<section id="factors" hidden><h2>Kernels</h2><div class="row sheet" id="kernels"></div>
<h2>Factor maps</h2><div class="row sheet" id="maps"></div></section></main>
<main id="of-session" hidden><section><label>picture<input type="range" id="picture" min="0"
value="0"><output id="picture-name"></output></label><figure><img id="frame" alt="a picture">
<figcaption>square root of the counts; red: saturated</figcaption></figure></section></main>
<script>
'use strict';
const at = id => document.getElementById(id);
const say = (id, text) => { at(id).textContent = text; };
const three = x => Number(x).toPrecision(3);
const colors = ['#ff7a6b', '#7bd88f', '#6aa7ff', '#e3c567', '#c79bf2', '#69d2d6'];
const shade = name => colors[{R: 0, G: 1, B: 2}[name] ?? 3];
let state, point = null, waiting = null, busy = false;

async function ask(name, query = {}) {
  const answer = await fetch(name + '?' + new URLSearchParams(query));
  if (!answer.ok) { throw new Error(await answer.text()); }
  say('error', '');
  return answer;
}
// The last request asked for while another is under way is made when that is done.
async function latest(work) {
  waiting = work;
  if (busy) { return; }
  busy = true;
  while (waiting) {
    const now = waiting;
    waiting = null;
    try { await now(); } catch (e) { say('error', e.message); }
  }
  busy = false;
}

// t in [0, 1] from dark blue to light yellow; s in [-1, 1] from blue to red.
const ramp = t => [255 * Math.min(1, 1.6 * t), 255 * t ** 1.4, 90 + 120 * Math.sin(3 * t)];
const around = s => s < 0 ? [235 + 200 * s, 235 + 150 * s, 240] : [240, 235 - 170 * s, 235 - 200 * s];
function paint(parent, id, values, valid, color) {
  const canvas = document.createElement('canvas'), n = state.core;
  canvas.width = canvas.height = n;
  canvas.id = id;
  const image = new ImageData(n, n);
  values.forEach((v, k) => {
    const rgb = valid[k] ? color(v) : [70, 0, 70];
    image.data.set([...rgb, 255], 4 * k);
  });
  canvas.getContext('2d').putImageData(image, 0, 0);
  parent.append(canvas);
}
function rings(values, valid) {
  const half = (state.core - 1) / 2, sum = [], count = [];
  values.forEach((v, k) => {
    if (!valid[k]) { return; }
    const r = Math.round(Math.hypot(k % state.core - half, Math.floor(k / state.core) - half));
    sum[r] = (sum[r] || 0) + v;
    count[r] = (count[r] || 0) + 1;
  });
  return sum.map((s, r) => s / count[r]).slice(0, half + 1);
}
function plot(curves) {
  const all = curves.flatMap(c => c.mean).filter(v => v > 0);
  const top = Math.log10(Math.max(...all)), low = Math.max(top - 7, Math.log10(Math.min(...all)));
  const half = (state.core - 1) / 2, X = r => 50 + 460 * r / half;
  const Y = v => 12 + 200 * (top - Math.log10(v)) / Math.max(top - low, 1e-9);
  let svg = '';
  for (let e = Math.ceil(low); e <= top; ++e) {
    const y = Y(10 ** e);
    svg += `<path d="M50 ${y}H510" stroke="#2b2f37"/><text x="4" y="${y + 4}">1e${e}</text>`;
  }
  for (let k = 0; k <= 4; ++k) {
    svg += `<text x="${X(half * k / 4) - 10}" y="232">${
      (half * k / 4 * state.pitch_mm).toFixed(1)} mm</text>`;
  }
  for (const c of curves) {
    const d = c.mean.map((v, r) => v > 0 && Math.log10(v) >= low ? `${X(r)},${Y(v)}` : '')
      .filter(p => p).join(' ');
    svg += `<polyline points="${d}" fill="none" stroke="${c.color}" stroke-width="1.6"${
      c.dashed ? ' stroke-dasharray="4 3"' : ''}/>`;
  }
  at('profile').innerHTML = svg;
}
function showSlice(s) {
  say('where', `x_i = (${s.x_mm.toFixed(2)}, ${s.y_mm.toFixed(2)}) mm, point (${s.i}, ${s.j})` +
    s.channels.map(c => `, ${c.name} ${three(c.albedo)}`).join('') +
    (s.channels.length ? ' in all' : ''));
  at('slices').replaceChildren();
  at('residuals').replaceChildren();
  const curves = [];
  const size = state.core ** 2;
  s.channels.forEach((c, k) => {
    const valid = s.valid.length > size ? s.valid.slice(k * size, (k + 1) * size) : s.valid;
    const top = Math.log(Math.max(...c.rd, 1e-30)), range = Math.log(1e5);
    paint(at('slices'), 'slice-' + c.name, c.rd, valid,
      v => v > 0 ? ramp(Math.max(0, 1 + (Math.log(v) - top) / range)) : [0, 0, 0]);
    const mean = rings(c.rd, valid), half = (state.core - 1) / 2;
    curves.push({mean, color: shade(c.name)});
    if (c.other) { curves.push({mean: rings(c.other, valid), color: shade(c.name), dashed: true}); }
    paint(at('residuals'), 'residual-' + c.name, c.rd, valid.map((ok, i) => ok), v => around(0));
    const context = at('residual-' + c.name).getContext('2d');
    const image = new ImageData(state.core, state.core);
    let sum = 0, weight = 0;
    c.rd.forEach((v, i) => {
      const r = Math.hypot(i % state.core - half, Math.floor(i / state.core) - half);
      const base = c.other ? c.other[i] : mean[Math.min(half, Math.round(r))];
      sum += (v - base) ** 2;
      weight += base ** 2;
      const off = base > 0 ? v / base - 1 : 0;
      image.data.set([...(valid[i] ? around(Math.max(-1, Math.min(1, off))) : [70, 0, 70]), 255],
        4 * i);
    });
    context.putImageData(image, 0, 0);
    at('residual-' + c.name).title = `${c.name}: ${three(100 * Math.sqrt(sum / weight))} % (L2)`;
    at('residual-' + c.name).dataset.l2 = Math.sqrt(sum / weight);
  });
  say('residual-l2', 'off by ' + s.channels.map(c => `${c.name} ${
    three(100 * at('residual-' + c.name).dataset.l2)} %`).join(', ') + ' (relative L2)');
  plot(curves);
}
// The error of the first S terms, against S; a dot at the slider's.
function curve() {
  const known = state.error_curve, n = known.length, last = known[n - 1].terms;
  const e = known.map(p => Math.log10(p.relative_l2)), top = Math.max(...e), low = Math.min(...e);
  const X = s => 60 + 440 * (s - 1) / Math.max(1, last - 1);
  const Y = v => 15 + 100 * (top - v) / Math.max(top - low, 1e-9);
  const line = known.map((p, k) => `${X(p.terms)},${Y(e[k])}`).join(' ');
  const now = known.findIndex(p => p.terms >= terms()), k = now < 0 ? n - 1 : now;
  const percent = v => three(100 * 10 ** v) + ' %';
  at('curve').innerHTML = `<polyline points="${line}" fill="none" stroke="#6aa7ff"/>
    <circle cx="${X(known[k].terms)}" cy="${Y(e[k])}" r="4" fill="#e3c567"/>
    <text x="4" y="19">${percent(top)}</text><text x="4" y="119">${percent(low)}</text>
    <text x="56" y="140">1</text><text x="488" y="140">${last}</text>
    <text x="210" y="140">terms S; error, relative L2</text>`;
}
const terms = () => at('with-terms').hidden ? 0 : Number(at('terms').value);
function askSlice() {
  if (!point) { return; }
  latest(async () => showSlice(await (await ask('slice.json',
    {i: point[0], j: point[1], terms: terms()})).json()));
}
const radius = () => at('radius').value / 100 * 0.5 * Math.hypot(...state.points) * state.pitch_mm;
let place = [0, 0];
function askLight() {
  latest(async () => {
    at('sample').src = 'light.png?' + new URLSearchParams(
      {x: place[0], y: place[1], r: radius(), ev: at('ev').value});
    await at('sample').decode();
    at('sample').dataset.lit = place.map(p => p.toFixed(2)).join(',');
  });
}
const lit = () => at('mode-light').checked;
// Where on the sample, in mm, picture order turned to y up.
function under(event) {
  const box = at('sample').getBoundingClientRect(), [w, h] = state.points;
  const x = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
  const y = Math.min(1, Math.max(0, (event.clientY - box.top) / box.height));
  return {x: (x - .5) * w * state.pitch_mm, y: (.5 - y) * h * state.pitch_mm,
    i: Math.min(w - 1, Math.floor(x * w)), j: Math.min(h - 1, Math.floor(y * h))};
}
function sliders() {
  say('radius-mm', radius().toFixed(2) + ' mm');
  say('ev-stops', at('ev').value + ' stops');
  if (at('with-terms').hidden) { return; }
  const known = state.error_curve.find(e => e.terms === terms());
  if (!at('curve').hasAttribute('hidden')) { curve(); }
  say('terms-error', terms() + (known ? `, error ${three(100 * known.relative_l2)} %` : ''));
}
function mode() {
  for (const id of ['radius', 'ev']) { at(id).disabled = !lit(); }
  say('caption', lit() ? 'exitance under the disc, white: its largest albedo'
    : `albedo, white: ${three(state.largest_albedo)}; ${state.points.join(' × ')} points, ${
      state.pitch_mm} mm apart`);
  if (lit()) { askLight(); } else { at('sample').src = 'albedo.png'; }
}
function sheet(id, name, sets, count) {
  for (let c = 0; c < sets; ++c) {
    for (let n = 0; n < Math.min(count, 12); ++n) {
      const image = document.createElement('img');
      image.src = `${name}?channel=${c}&n=${n}`;
      image.alt = image.title = `${sets > 1 ? state.channels[c] + ' ' : ''}${n + 1}`;
      at(id).append(image);
    }
  }
}
function openSample() {
  at('of-sample').hidden = false;
  at('sample').style.aspectRatio = state.points.join('/');
  say('residual-title', state.against ? 'Ratio to the other: blue below half, red above double'
    : 'Ratio to the rings’ mean: how far from round');
  if (state.kind !== 'dataset') {
    const e = state.error;
    say('facts', `${state.method}, ${state.terms} terms` + (e && e.relative_l2 !== undefined
      ? `, relative L2 error ${three(100 * e.relative_l2)} %` : '') +
      (state.preset ? `, ${state.preset.licence}` : ''));
    at('with-terms').hidden = !state.sums_terms || state.terms < 2;
    at('curve').toggleAttribute('hidden', at('with-terms').hidden || !state.error_curve.length);
    at('terms').max = state.terms;
    at('terms').value = state.terms;
    at('factors').hidden = false;
    sheet('kernels', 'kernel.png', state.kernel_sets, state.kernels);
    sheet('maps', 'map.png', state.map_sets, state.maps);
  } else {
    say('facts', `${state.points.join(' × ')} points, core ${state.core}, pitch ${
      state.pitch_mm} mm, η ${state.eta}`);
  }
  at('sample').addEventListener('click', event => {
    if (lit()) { return; }
    const u = under(event);
    point = [u.i, u.j];
    askSlice();
  });
  at('sample').addEventListener('pointermove', event => {
    if (!lit()) { return; }
    const u = under(event);
    place = [u.x, u.y];
    askLight();
  });
  for (const id of ['mode-slice', 'mode-light']) { at(id).addEventListener('change', mode); }
  for (const id of ['radius', 'ev']) {
    at(id).addEventListener('input', () => { sliders(); if (lit()) { askLight(); } });
  }
  at('terms').addEventListener('input', () => { sliders(); askSlice(); });
  sliders();
  mode();
  point = state.points.map(n => Math.floor(n / 2));
  askSlice();
}
function openSession() {
  at('of-session').hidden = false;
  say('facts', `${state.camera}, ${state.size_px.join(' × ')} pixels, ${state.pictures.length} of ${
    state.total} pictures`);
  at('picture').max = Math.max(0, state.pictures.length - 1);
  const show = () => {
    const p = state.pictures[at('picture').value];
    if (!p) { return; }
    say('picture-name', `${p.number}: ${p.target}` +
      (p.channel < 0 ? '' : `, ${state.channels[p.channel]}`) +
      (p.group < 0 ? '' : `, group ${p.group}`) + (p.taken ? '' : ' (left out)'));
    at('frame').hidden = !p.taken;
    if (p.taken) { at('frame').src = 'frame.png?n=' + p.number; }
  };
  at('picture').addEventListener('input', show);
  show();
}
(async () => {
  try {
    state = await (await ask('state.json')).json();
    say('title', state.title);
    document.title = state.title + ' – Nacre';
    (state.kind === 'session' ? openSession : openSample)();
  } catch (e) { say('error', e.message); }
})();
</script></body></html>
)HTML";

}  // namespace nacre::cli::view
