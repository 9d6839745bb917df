#!/usr/bin/env bash
# Odometry against DEM-anchored over simulated traverses of more than 300 m, three seeds each, on a generated highland and,
# when its elevation map is given, on real lunar terrain. Resumes; writes OUT/table.csv.
#   bench/anchoring_table.sh OUT [nac_pit_1m4.tif]
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:?usage: bench/anchoring_table.sh OUT [NAC_DEM]}
nac=${2:-}
demslam=${DEMSLAM:-build/release/demslam}
mkdir -p "$out"

traverse() {  # traverse NAME SEED SCENE [more options of simulate]
  local name=$1 seed=$2 scene=$3; shift 3
  "$demslam" simulate "$scene" --seed "$seed" -o "$out/${name}_$seed" "$@"
  "$demslam" run "$out/${name}_$seed" -o "$out/${name}_${seed}_run" --overwrite
  "$demslam" evaluate "$out/${name}_${seed}_run/odometry.tum" "$out/${name}_${seed}_run" --truth "$out/${name}_$seed/gt.txt" \
    --csv "$out/${name}_$seed.csv"
}

for seed in 1 2 3; do
  traverse highland "$seed" configs/highland_300m.toml
  if [ -n "$nac" ]; then traverse nac "$seed" configs/nac_traverse.toml --dem "$nac"; fi
done
awk 'FNR == 1 { if (NR == 1) print "dataset," $0; next } { name = FILENAME; sub(/.*\//, "", name); sub(/\.csv$/, "", name); print name "," $0 }' \
  "$out"/*_[123].csv >"$out/table.csv"
cat "$out/table.csv"
