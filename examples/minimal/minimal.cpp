// Runs the SLAM over a dataset from your own program: minimal DATASET RUN_FOLDER
#include <iostream>

#include "demslam/config/slam_config.h"
#include "demslam/slam/run.h"

int main(int argc, char** argv) {
  if (argc != 3) return std::cerr << "usage: minimal DATASET RUN_FOLDER\n", 2;
  const demslam::SlamOptions options;
  const demslam::RunInputs inputs{.dataset = argv[1], .output = argv[2], .config_toml = demslam::to_toml(options)};
  const demslam::RunReport report = demslam::run_slam(inputs, options, {});
  std::cout << report.result.counters.tracked << " of " << report.frames_asked << " frames tracked\n";
}
