// node long_run.mjs FOLDER: writes FOLDER/long, a run of 11 km as `demslam run` leaves it, with images full of noise,
// the worst case for a page's size (docs/report.md).
import { linkSync, mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { deflateSync, crc32 as builtIn } from "node:zlib";

const FRAMES = 22000;
const STEP_M = 0.5;
const EVERY = 1; // frames per keyframe

/** The same numbers on every call (Lehmer's generator). */
function randomNumbers(seed) {
  let state = seed;
  return () => (state = (state * 48271) % 2147483647) / 2147483647;
}

function crc32(bytes) {
  if (builtIn) return builtIn(bytes);
  let crc = ~0;
  for (const byte of bytes) {
    crc ^= byte;
    for (let k = 0; k < 8; ++k) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc >>> 0;
}

function chunk(type, data) {
  const body = Buffer.concat([Buffer.from(type), data]);
  const chunk = Buffer.alloc(body.length + 8);
  chunk.writeUInt32BE(data.length, 0);
  body.copy(chunk, 4);
  chunk.writeUInt32BE(crc32(body), body.length + 4);
  return chunk;
}

function noisyPng(side, random) {
  const rows = Buffer.alloc(side * (side + 1));
  for (let i = 0; i < rows.length; ++i) rows[i] = i % (side + 1) === 0 ? 0 : 90 + 90 * random();
  const header = Buffer.alloc(13);
  header.writeUInt32BE(side, 0);
  header.writeUInt32BE(side, 4);
  header[8] = 8; // bits, grey
  return Buffer.concat([Buffer.from("\x89PNG\r\n\x1a\n", "latin1"), chunk("IHDR", header), chunk("IDAT", deflateSync(rows)), chunk("IEND", Buffer.alloc(0))]);
}

const stamp = (frame) => 1_000_000_000 + frame * 500_000_000;
const seconds = (frame) => `${Math.floor(stamp(frame) / 1e9)}.${String(stamp(frame) % 1e9).padStart(9, "0")}`;

/** A winding way north-east, driven with a drift that grows. */
function position(frame, drift) {
  const s = frame * STEP_M;
  const x = 0.8 * s + 300 * Math.sin(s / 900) + drift * s;
  const y = 0.5 * s - 250 * Math.sin(s / 1300) + drift * 0.4 * s;
  return [x - 4400, y - 2750, 8 * Math.sin(s / 400) + drift * 0.2 * s];
}

function writeImages(data, random) {
  for (const camera of ["image0", "image1"]) mkdirSync(join(data, camera, "color"), { recursive: true });
  const originals = [];
  // The page takes every 2^n-th keyframe and the last one.
  const frames = [...Array.from({ length: Math.ceil(FRAMES / 64) }, (_, i) => 64 * i), FRAMES - 1];
  for (const [i, frame] of frames.entries()) {
    for (const camera of ["image0", "image1"]) {
      const file = join(data, camera, "color", `${stamp(frame)}.png`);
      if (originals.length >= 8) linkSync(originals[i % 8], file);
      else writeFileSync(file, noisyPng(640, random));
      if (originals.length < 8) originals.push(file);
    }
  }
}

/** Waves 12 km by 9 km around the map's origin, which is the raster's middle. */
function demText() {
  const [rows, cols, cell] = [450, 600, 20];
  const line = (row) => Array.from({ length: cols }, (_, col) => (40 * Math.sin(col / 17) * Math.cos(row / 23) + 6 * Math.sin((col + 2 * row) / 5)).toFixed(2)).join(" ");
  const head = { ncols: cols, nrows: rows, xllcorner: -0.5 * cols * cell, yllcorner: -0.5 * rows * cell, cellsize: cell, NODATA_value: -99999 };
  return [...Object.entries(head).map((entry) => entry.join(" ")), ...Array.from({ length: rows }, (_, row) => line(row))].join("\n") + "\n";
}

function writeLongRun(folder) {
  const random = randomNumbers(7);
  const [data, run] = [join(folder, "data"), join(folder, "long")];
  mkdirSync(run, { recursive: true });
  writeImages(data, random);
  writeFileSync(join(data, "dem.asc"), demText());
  writeFileSync(join(data, "calibration.toml"), "baseline_m = 0.3\n[left]\nwidth = 640\nheight = 640\nfx = 500.0\nfy = 500.0\ncx = 319.5\ncy = 319.5\n");
  const texts = { "frames.jsonl": [], "timings.csv": ["frame,extract_ms,stereo_ms,motion_ms,loop_ms,optimize_ms,total_ms"], "trajectory.tum": [], "odometry.tum": [], "covariance.csv": [`t_ns${",c".repeat(36)}`], "residuals.csv": ["kind,keyframe,rows,chi_square"] };
  const truth = [];
  const tum = (frame, drift) => `${seconds(frame)} ${position(frame, drift).map((v) => v.toFixed(6)).join(" ")} 0 0 0 1`;
  for (let frame = 0; frame < FRAMES; ++frame) {
    const keyframe = frame % EVERY === 0 ? { keyframe: frame / EVERY } : {};
    texts["frames.jsonl"].push(JSON.stringify({ frame, t_ns: stamp(frame), status: "tracked", keypoints: 1500, stereo_points: 900, matches: Math.floor(300 + 200 * random()), inliers: Math.floor(150 + 150 * random()), rms_px: 0.3 + 0.2 * random(), ...keyframe }));
    texts["timings.csv"].push([frame, 2, 18, 25 + 20 * random(), 0, 0, 60 + 30 * random()].map((v) => Number(v).toFixed(3)).join(","));
    texts["trajectory.tum"].push(tum(frame, 5e-5));
    texts["odometry.tum"].push(tum(frame, 2e-3));
    truth.push(`${stamp(frame)},${position(frame, 0).map((v) => v.toFixed(6)).join(",")},1,0,0,0`);
    if (frame % 10 === 0) for (const [kind, rows] of [["dem_height", 1], ["dem_normal", 2], ["terrain_patch", 200]]) texts["residuals.csv"].push([kind, frame / EVERY, rows, (2 * rows * random()).toFixed(3)].join(","));
    if (frame % EVERY === 0) texts["covariance.csv"].push([stamp(frame), ...Array.from({ length: 36 }, (_, i) => (i % 7 === 0 ? 0.01 + frame * 1e-5 : 0))].join(","));
  }
  for (const [name, lines] of Object.entries(texts)) writeFileSync(join(run, name), lines.join("\n") + "\n");
  writeFileSync(join(data, "gt.txt"), truth.join("\n") + "\n");
  writeFileSync(join(run, "config.toml"), "[odometry]\nmethod = \"window\"\n");
  writeFileSync(join(run, "summary.json"), JSON.stringify({ demslam: "0.1.0", inputs: { dataset: data, format: "demslam", dem: { path: join(data, "dem.asc") } }, frames_asked: FRAMES, counters: { frames: FRAMES, tracked: FRAMES, keyframes: FRAMES / EVERY } }));
}

writeLongRun(process.argv[2]);
