#include "cli/preview/page.h"

namespace nacre::cli::preview {

const char* const kPage = R"HTML(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Nacre: capture</title>
<meta name="viewport" content="width=device-width">
<link rel="icon" href="data:,">
<style>
:root{color-scheme:dark}
body{margin:0;padding:1.2rem;background:#14161a;color:#d9dce2;font:15px/1.45 system-ui,sans-serif}
header{display:flex;gap:1rem;align-items:baseline;flex-wrap:wrap}
h1{font-size:1.25rem;margin:0}h2{font-size:.8rem;margin:1rem 0 .3rem;color:#8f97a5;
text-transform:uppercase;letter-spacing:.06em}
#end{font-weight:600}.bad{color:#ff7a6b}.good{color:#7bd88f}
main{display:flex;gap:1.5rem;flex-wrap:wrap;margin-top:.8rem}
figure{margin:0;max-width:720px}img{display:block;max-width:100%;background:#000;
image-rendering:pixelated;border:1px solid #2b2f37}
figcaption{color:#8f97a5;margin-top:.3rem}aside{flex:1;min-width:20rem}
progress{width:100%;height:.7rem;accent-color:#6aa7ff}
dl{display:grid;grid-template-columns:auto 1fr;gap:.1rem 1rem;margin:0}
dt{color:#8f97a5}dd{margin:0;font-variant-numeric:tabular-nums}
svg{width:100%;height:9rem;background:#1b1e24;border:1px solid #2b2f37}
</style></head><body>
<header><h1 id="sample">Nacre</h1><span id="camera"></span><span id="end"></span></header>
<progress id="bar" max="1" value="0"></progress>
<main><figure><img id="frame" width="560" alt="the last picture">
<figcaption>square root of the counts; red: saturated</figcaption></figure>
<aside><h2>Progress</h2><dl>
<dt>stage</dt><dd id="stage">waiting</dd><dt>pictures</dt><dd id="count"></dd>
<dt>elapsed</dt><dd id="elapsed"></dd><dt>left</dt><dd id="eta"></dd></dl>
<h2>Last picture</h2><dl>
<dt>shows</dt><dd id="target"></dd><dt>exposure</dt><dd id="exposure"></dd>
<dt>saturated</dt><dd id="saturated"></dd><dt>largest count</dt><dd id="largest"></dd>
<dt>mean count</dt><dd id="mean"></dd><dt>camera</dt><dd id="device"></dd></dl>
<h2>Histogram (logarithmic)</h2>
<svg id="histogram" viewBox="0 0 64 32" preserveAspectRatio="none"></svg>
<h2>Faults so far</h2><dl>
<dt>frames taken again</dt><dd id="retaken"></dd>
<dt>packets sent again</dt><dd id="resent"></dd></dl></aside></main>
<script>
'use strict';
const at = id => document.getElementById(id);
const say = (id, text) => { at(id).textContent = text; };
const clock = s => { s = Math.round(s); const two = n => String(n).padStart(2, '0');
  return s < 3600 ? Math.floor(s / 60) + ':' + two(s % 60)
    : Math.floor(s / 3600) + ':' + two(Math.floor(s / 60) % 60) + ':' + two(s % 60); };
let shown = -1;
function histogram(bins) {
  const top = Math.log1p(Math.max(...bins));
  at('histogram').innerHTML = bins.map((n, k) => {
    const h = top > 0 ? 31 * Math.log1p(n) / top : 0;
    return `<rect x="${k}" y="${32 - h}" width=".9" height="${h}" fill="${
      k === bins.length - 1 ? '#ff7a6b' : '#6aa7ff'}"/>`; }).join('');
}
function picture(p, full) {
  say('target', p.target + (p.channel === null ? '' : ', laser ' + p.channel) +
    (p.group < 0 ? '' : ', spots of group ' + p.group) + ' (picture ' + p.number + ')');
  say('exposure', (p.exposure_us / 1000).toLocaleString('en') + ' ms');
  say('saturated', (100 * p.saturated).toFixed(3) + ' %');
  at('saturated').className = p.saturated > 0 ? 'bad' : '';
  say('largest', p.largest + ' of ' + full);
  say('mean', p.mean.toFixed(1));
  say('device', [p.gain === null ? '' : 'gain ' + p.gain,
    p.temperature_c === null ? '' : p.temperature_c + ' °C'].filter(x => x).join(', ') || '–');
  histogram(p.histogram);
  if (p.number !== shown) { shown = p.number; at('frame').src = 'frame.png?n=' + shown; }
}
function show(s) {
  document.title = (s.total ? Math.floor(100 * s.done / s.total) + ' % ' : '') + s.sample;
  say('sample', s.sample); say('camera', s.camera + (s.mosaic ? ' (' + s.mosaic + ')' : ''));
  say('end', s.end); at('end').className = s.end === 'done' ? 'good' : 'bad';
  at('bar').max = s.total || 1; at('bar').value = s.done;
  say('stage', s.stage || 'waiting'); say('count', s.done + ' of ' + s.total);
  say('elapsed', clock(s.elapsed_s)); say('eta', clock(s.eta_s));
  say('retaken', s.faults.frames_retaken + ' of ' + s.faults.frames);
  at('retaken').className = s.faults.frames_retaken > 0 ? 'bad' : 'good';
  say('resent', s.faults.packets_resent);
  if (s.picture) picture(s.picture, s.full_count);
}
async function poll() {
  try {
    show(await (await fetch('state.json')).json());
    setTimeout(poll, 500);
  } catch (e) {
    if (!at('end').textContent) { say('end', 'the capture has ended'); }
    setTimeout(poll, 3000);
  }
}
poll();
</script></body></html>
)HTML";

}  // namespace nacre::cli::preview
