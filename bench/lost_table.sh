#!/usr/bin/env bash
# What it costs to see nothing for ten seconds, or only every n-th frame: odometry alone, with and without gyroscope and wheels.
#   bench/lost_table.sh DEMSLAM WORK_FOLDER
set -euo pipefail
demslam=$1 work=$2
mkdir -p "$work"
"$demslam" simulate "$(dirname "$0")/circle_scene.toml" -o "$work/whole" >"$work/simulate.txt" 2>&1
printf '[odometry.lost]\nuse_imu = false\nuse_wheels = false\n' >"$work/no_sensors.toml"
printf '' >"$work/sensors.toml"

images() { ls "$work/whole/$1/color" | sort -n; }
variant() {  # variant NAME: everything but the images
  rm -rf "${work:?}/$1"
  mkdir -p "$work/$1/image0/color" "$work/$1/image1/color"
  for file in calibration.toml start.toml dem.tif imu.txt wheels.txt; do cp "$work/whole/$file" "$work/$1/"; done
}
frozen() {  # frozen NAME FIRST LAST: the camera repeats one frame
  variant "$1"
  for camera in image0 image1; do
    local n=0 last=
    for image in $(images $camera); do
      if ((n < $2 || n > $3)); then last=$image; fi
      cp "$work/whole/$camera/color/$last" "$work/$1/$camera/color/$image"
      n=$((n + 1))
    done
  done
}
every() {  # every NAME N
  variant "$1"
  for camera in image0 image1; do
    images $camera | awk -v n="$2" 'NR % n == 1' | while read -r image; do
      cp "$work/whole/$camera/color/$image" "$work/$1/$camera/color/"
    done
  done
}

frozen frozen_10s 60 69
every every_2nd 2
every every_3rd 3
every every_4th 4
echo "| frames | sensors | completion | ATE |"
echo "| --- | --- | --- | --- |"
for data in whole frozen_10s every_2nd every_3rd every_4th; do
  for sensors in sensors no_sensors; do
    "$demslam" run "$work/$data" -o "$work/run" -c "$work/$sensors.toml" --odometry-only --overwrite >"$work/run.txt"
    "$demslam" evaluate "$work/run" --truth "$work/whole/gt.txt" --json "$work/run.json" >"$work/evaluate.txt"
    value() { grep -o "\"$1\": *[0-9.e-]*" "$work/run.json" | head -1 | sed 's/.*: *//'; }
    printf '| %s | %s | %.0f %% | %.2f m |\n' $data $sensors "$(awk "BEGIN { print 100 * $(value completion) }")" "$(value ate_rmse_m)"
  done
done
