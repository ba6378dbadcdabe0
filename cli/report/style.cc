#include "cli/report/style.h"

namespace nacre::cli::report {

// NOLINTNEXTLINE(readability-function-size): a sheet
const char* StyleSheet() {
  return R"(
:root {
  --paper: #fcfbf8; --ink: #22252b; --soft: #666b75; --line: #dfdcd4; --panel: #f3f1eb;
  --accent: #1d6f72; --good: #2f7d4f; --bad: #b3491f;
  --s0: #b8453b; --s1: #3f8a4c; --s2: #3a66b0; --s3: #8a5aa8; --s4: #a97a18; --s5: #2b8a94;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #16181c; --ink: #e4e2dc; --soft: #9a9da5; --line: #33363d; --panel: #1e2126;
    --accent: #6fc3c1; --good: #7cc796; --bad: #e8956d;
    --s0: #e37c70; --s1: #79c286; --s2: #7ea6ea; --s3: #c49ae0; --s4: #dfb85a; --s5: #72c6cf;
  }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body {
  margin: 0; background: var(--paper); color: var(--ink);
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", "Helvetica Neue", "Noto Sans",
    "Liberation Sans", Arial, sans-serif;
  font-variant-numeric: lining-nums; counter-reset: figure;
}
main { max-width: 1000px; margin: 0 auto; padding: 56px 32px 72px; }
h1 { font-size: 2.1rem; line-height: 1.15; letter-spacing: -0.015em; font-weight: 650;
  margin: 0 0 10px; }
.lead { font-size: 1.06rem; color: var(--soft); max-width: 44em; margin: 0 0 32px; }
section { margin: 52px 0 0; padding-top: 22px; border-top: 1px solid var(--line); }
section > header { display: flex; flex-wrap: wrap; align-items: baseline; gap: 4px 16px;
  margin-bottom: 14px; }
h2 { font-size: 1.32rem; font-weight: 620; letter-spacing: -0.008em; margin: 0; }
h3 { font-size: 1rem; font-weight: 620; margin: 30px 0 8px; }
code { font: 0.86em/1.4 ui-monospace, "SF Mono", "Cascadia Mono", "Noto Sans Mono",
  "Liberation Mono", monospace; color: var(--soft); overflow-wrap: anywhere; }
p { margin: 8px 0; max-width: 48em; }
sup, sub { font-size: 0.72em; line-height: 0; }
td code { white-space: nowrap; }
dl { display: grid; grid-template-columns: repeat(auto-fit, minmax(148px, 1fr));
  gap: 14px 24px; margin: 6px 0 22px; padding: 16px 20px; background: var(--panel);
  border-radius: 8px; }
dt { font-size: 0.78rem; color: var(--soft); }
dd { margin: 1px 0 0; font-variant-numeric: tabular-nums; overflow-wrap: anywhere; }
.scroll { overflow-x: auto; margin: 14px 0; }
table { border-collapse: collapse; font-size: 0.92rem; min-width: 50%; }
th { text-align: left; font-weight: 560; font-size: 0.8rem; color: var(--soft);
  padding: 4px 24px 6px 0; border-bottom: 1.5px solid var(--line); white-space: nowrap;
  vertical-align: bottom; }
td { padding: 6px 24px 6px 0; border-bottom: 1px solid var(--line); vertical-align: top; }
th:last-child, td:last-child { padding-right: 0; }
tbody tr:last-child td { border-bottom: 0; }
tr.total td { font-weight: 600; border-top: 1.5px solid var(--line); }
.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
td.bar { width: 130px; }
.track { display: block; height: 9px; border-radius: 5px; background: var(--panel);
  overflow: hidden; margin-top: 7px; min-width: 90px; }
.track i { display: block; height: 100%; background: var(--accent); border-radius: 5px; }
figure { margin: 18px 0 26px; counter-increment: figure; }
figcaption { font-size: 0.86rem; line-height: 1.45; color: var(--soft); margin-top: 9px;
  max-width: 56em; }
figcaption::before { content: "Figure " counter(figure) ". "; color: var(--ink);
  font-weight: 600; }
img { display: block; max-width: 100%; height: auto; border-radius: 3px; }
img.pixels { image-rendering: pixelated; width: 100%; }
img.hero { margin: 0 auto; border-radius: 6px; }
figure.hero figcaption { text-align: center; margin-left: auto; margin-right: auto; }
.grow { flex: 1 1 420px; min-width: 0; }
.grow > :first-child { margin-top: 4px; }
.row { display: flex; flex-wrap: wrap; gap: 4px 36px; align-items: flex-start; }
.row > figure { flex: 1 1 280px; min-width: 0; }
.row > figure.narrow { flex: 0 1 290px; }
.grid { display: grid; gap: 6px; align-items: center; }
.grid span { font-size: 0.78rem; color: var(--soft); text-align: center; line-height: 1.25; }
.grid span.side { text-align: right; padding-right: 4px; white-space: nowrap; }
.scale { display: grid; grid-template-columns: auto 1fr auto; gap: 8px; align-items: center;
  font-size: 0.78rem; color: var(--soft); margin-top: 10px; max-width: 420px; }
.scale img { width: 100%; height: 10px; }
.over { position: relative; }
.over svg { position: absolute; inset: 0; width: 100%; height: 100%; }
svg { display: block; width: 100%; height: auto; font-size: 12.5px; }
svg text { fill: var(--soft); }
svg .axis { stroke: var(--soft); stroke-width: 1; fill: none; }
svg .tick { stroke: var(--line); stroke-width: 1; }
svg .curve { fill: none; stroke-width: 2; stroke-linejoin: round; stroke-linecap: round; }
svg .band { stroke: none; opacity: 0.16; }
.check { display: flex; gap: 10px; align-items: baseline; margin: 6px 0; max-width: none; }
.check b { flex: none; width: 1.25em; height: 1.25em; line-height: 1.25em; border-radius: 50%;
  text-align: center; font-size: 0.82em; color: var(--paper); }
.check.good b { background: var(--good); }
.check.bad b { background: var(--bad); }
footer { margin-top: 64px; padding-top: 14px; border-top: 1px solid var(--line);
  font-size: 0.82rem; color: var(--soft); }
@media (max-width: 600px) { main { padding: 32px 18px 48px; } }
@media print { section { break-inside: avoid-page; } body { font-size: 11pt; } }
)";
}

}  // namespace nacre::cli::report
