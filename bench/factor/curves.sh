#!/bin/sh
# All models on three data sets of the simulated rig, bytes and time against error:
#   bench/factor/curves.sh BUILD OUT [quick]
# BUILD is a build folder made with -DNACRE_WITH_BENCH=ON; writes OUT.csv, OUT.svg and
# OUT_thesis.svg. Data are simulated with photon noise of 0.1 % of the peak; errors are
# against the noiseless truth.
set -e
build=$1
out=$2
shift 2
source=$(cd "$(dirname "$0")/../.." && pwd)
data=$(mktemp -d)
trap 'rm -rf "$data"' EXIT
# 32 × 32 points each, which keeps it to minutes.
simulate() {
  sed 's/^points = .*/points = [32, 32]/' "$source/$1" > "$data/$2.toml"
  "$build/nacre" simulate "$data/$2.toml" --solver fast --out "$data/$2.rd.exr" >&2
}
simulate rigs/chessboard4x4.toml chess
simulate rigs/marble-flat.toml marble
simulate bench/factor/skin-like.toml skin
"$build/bench/factor/factor_curves" "$out" "$@" \
  "chess=noise:0.001,$data/chess.rd.exr" \
  "marble=noise:0.001,$data/marble.rd.exr" \
  "skin=noise:0.001,$data/skin.rd.exr"
