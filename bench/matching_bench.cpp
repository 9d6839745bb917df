// Match quality of the front-ends on real pairs: how many matches, how many of them right, how precise, how long.
// Stereo: on one row offset within 1.5 px. Temporal: inliers of a fundamental matrix at 1 px.
// Usage: matching_bench [folder with data/ and models/] [points per image]
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <functional>
#include <iostream>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>

#include "demslam/dataset/sequence.h"
#include "demslam/features/frontend.h"
#include "demslam/image/rectify.h"

namespace fs = std::filesystem;
using namespace demslam;

namespace {

/// An OpenCV detector with its own descriptors; binary ones as +-1 rows, whose dot product orders like the Hamming
/// distance.
class OpenCvExtractor : public Extractor {
 public:
  explicit OpenCvExtractor(cv::Ptr<cv::Feature2D> algorithm) : algorithm_(std::move(algorithm)) {}

  Features extract(const Image& image) override {
    const cv::Mat1b view(image.height, image.width, const_cast<std::uint8_t*>(image.pixels.data()));
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    algorithm_->detectAndCompute(view, cv::noArray(), keypoints, descriptors);
    Features features{.image_width = image.width, .image_height = image.height};
    for (const cv::KeyPoint& k : keypoints) {
      features.keypoints.emplace_back(k.pt.x, k.pt.y);
      features.scores.push_back(k.response);
    }
    features.descriptors = descriptors.depth() == CV_8U ? bits(descriptors) : floats(descriptors);
    features.descriptors.rowwise().normalize();
    return features;
  }

 private:
  static DescriptorRows floats(const cv::Mat1f& rows) {
    return Eigen::Map<const DescriptorRows>(rows.ptr<float>(), rows.rows, rows.cols);
  }
  static DescriptorRows bits(const cv::Mat1b& rows) {
    DescriptorRows result(rows.rows, rows.cols * 8);
    for (int r = 0; r < rows.rows; ++r) {
      for (int b = 0; b < rows.cols * 8; ++b) result(r, b) = (rows(r, b / 8) >> (b % 8) & 1) ? 1.0F : -1.0F;
    }
    return result;
  }
  cv::Ptr<cv::Feature2D> algorithm_;
};

struct Sequence {
  std::string name;
  std::size_t size;
  std::function<StereoFrame(std::size_t index)> pair;
};

std::vector<fs::path> sorted_files(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// Two folders of images, as they are.
Sequence folder_pairs(const std::string& name, const fs::path& left, const fs::path& right) {
  const std::vector<fs::path> lefts = sorted_files(left), rights = sorted_files(right);
  return {name, lefts.size(),
          [=](std::size_t i) { return StereoFrame{0, read_image(lefts[i]), read_image(rights[i])}; }};
}

/// A calibrated dataset, rectified.
Sequence rectified(const std::string& name, const fs::path& path) {
  const std::shared_ptr<StereoSequence> dataset = open_dataset(path);
  const auto rectifier = std::make_shared<Rectifier>(dataset->rig());
  return {name, dataset->size(), [=](std::size_t i) {
            const StereoFrame raw = dataset->frame(i);
            return StereoFrame{raw.t_ns, rectifier->left(raw.left), rectifier->right(raw.right)};
          }};
}

/// Processor time of all threads: readable on a busy machine, too.
class CpuWatch {
 public:
  double elapsed_ms() const { return 1000.0 * static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC; }

 private:
  std::clock_t start_ = std::clock();
};

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

struct Tally {
  double points = 0, matches = 0, on_row = 0, row_sigma_px = 0, temporal = 0, inliers = 0, extract_ms = 0, match_ms = 0;
};

void tally_rows(Tally& tally, const Features& left, const Features& right, const std::vector<Match>& matches) {
  std::vector<double> rows, deviations;
  for (const Match& m : matches) rows.push_back(right.keypoints[m.train].y() - left.keypoints[m.query].y());
  const double offset = median(rows);
  for (const double row : rows) {
    if (std::abs(row - offset) <= 1.5) deviations.push_back(std::abs(row - offset));
  }
  tally.matches += static_cast<double>(matches.size());
  tally.on_row += static_cast<double>(deviations.size());
  tally.row_sigma_px += 1.4826 * median(deviations);
}

int epipolar_inliers(const Features& a, const Features& b, const std::vector<Match>& matches) {
  if (matches.size() < 15) return 0;
  std::vector<cv::Point2f> from, to;
  for (const Match& m : matches) {
    from.emplace_back(a.keypoints[m.query].x(), a.keypoints[m.query].y());
    to.emplace_back(b.keypoints[m.train].x(), b.keypoints[m.train].y());
  }
  std::vector<std::uint8_t> mask;
  cv::findFundamentalMat(from, to, cv::FM_RANSAC, 1.0, 0.999, 3000, mask);
  return static_cast<int>(std::count(mask.begin(), mask.end(), 1));
}

void tally_pair(Tally& tally, Frontend& frontend, const Image& left, const Image& right, const Image& later) {
  const CpuWatch extracting;
  const Features a = frontend.extractor->extract(left), b = frontend.extractor->extract(right);
  tally.extract_ms += extracting.elapsed_ms() / 2.0;
  const Features c = frontend.extractor->extract(later);
  const CpuWatch matching;
  const std::vector<Match> stereo = frontend.matcher->match(a, b), temporal = frontend.matcher->match(a, c);
  tally.match_ms += matching.elapsed_ms() / 2.0;
  tally.points += static_cast<double>(a.size());
  tally.temporal += static_cast<double>(temporal.size());
  tally.inliers += epipolar_inliers(a, c, temporal);
  tally_rows(tally, a, b, stereo);
}

constexpr std::size_t kPairs = 10;

void print_row(const std::string& name, Frontend& frontend, const Sequence& sequence) {
  Tally tally;
  const std::size_t step = (sequence.size - 1) / kPairs;
  for (std::size_t i = 0; i < kPairs; ++i) {
    const StereoFrame now = sequence.pair(i * step);
    tally_pair(tally, frontend, now.left, now.right, sequence.pair(i * step + 1).left);
  }
  const double n = kPairs;
  std::cout << fmt::format("| {} | {} | {:.0f} | {:.0f} | {:.1f} | {:.2f} | {:.0f} | {:.1f} | {:.1f} | {:.1f} |\n",
                           sequence.name, name, tally.points / n, tally.matches / n,
                           100.0 * tally.on_row / tally.matches, tally.row_sigma_px / n, tally.temporal / n,
                           100.0 * tally.inliers / tally.temporal, tally.extract_ms / n, tally.match_ms / n)
            << std::flush;
}

std::vector<std::pair<std::string, Frontend>> frontends(const fs::path& models, int points) {
  const auto nearest = [] { return std::move(make_frontend({}).matcher); };
  std::vector<std::pair<std::string, Frontend>> all;
  all.emplace_back("classical", make_frontend({.max_features = points}));
  all.emplace_back("ORB", Frontend{std::make_unique<OpenCvExtractor>(cv::ORB::create(points)), nearest()});
  all.emplace_back("SIFT", Frontend{std::make_unique<OpenCvExtractor>(cv::SIFT::create(points)), nearest()});
  if (!fs::exists(models / "xfeat.onnx")) return all;
  FrontendOptions options{.extractor = "onnx", .extractor_model = models / "xfeat.onnx", .max_features = points};
  all.emplace_back("XFeat + nearest", make_frontend(options));
  options.matcher = "onnx";
  options.matcher_model = models / "lighterglue_l3.onnx";
  all.emplace_back("XFeat + LighterGlue", make_frontend(options));
  return all;
}

void run(const fs::path& shared, int points) {
  const fs::path data = shared / "data";
  const std::vector<Sequence> sequences{
      folder_pairs("rover_sandbox", data / "rover_sandbox/left", data / "rover_sandbox/right"),
      rectified("kitti_seq1", data / "kitti_seq1"), rectified("euroc_v101", data / "euroc_v101_short")};
  std::cout << "| images | front-end | points | stereo matches | on row, % | row sigma, px | temporal matches | "
               "epipolar, % | "
               "extract, CPU ms | match, CPU ms |\n|---|---|---|---|---|---|---|---|---|---|\n";
  auto all = frontends(shared / "models", points);
  for (const Sequence& sequence : sequences) {
    for (auto& [name, frontend] : all) print_row(name, frontend, sequence);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  run(argc > 1 ? argv[1] : DEMSLAM_SHARED_DIR, argc > 2 ? std::stoi(argv[2]) : 1024);
} catch (const std::exception& error) {
  std::cerr << "matching_bench: " << error.what() << '\n';
  return 1;
}
