// What a front-end sees in a sequence, side by side for real and simulated images: grey-value gradients, keypoints,
// and the share of right matches of a stereo pair and of images some frames apart (SIFT, at most 1500 points).
// Usage: image_statistics NAME=DATASET:FRAMES_APART[:CALIBRATION] ...
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "demslam/base/error.h"
#include "demslam/dataset/sequence.h"

using namespace demslam;

namespace {

constexpr int kPlaces = 10;  // of a sequence, evenly spread
constexpr double kRatio = 0.8, kEpipolarPx = 1.0, kRowPx = 1.0;

struct Points {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
};

/// A copy that owns its pixels.
cv::Mat1b grey(const Image& image) {
  cv::Mat1b copy(image.height, image.width);
  std::copy(image.pixels.begin(), image.pixels.end(), copy.begin());
  return copy;
}

Points points_of(const Image& image) {
  Points points;
  cv::SIFT::create(1500)->detectAndCompute(grey(image), cv::noArray(), points.keypoints, points.descriptors);
  return points;
}

/// Matches that pass the ratio test.
std::vector<cv::DMatch> matched(const Points& a, const Points& b) {
  std::vector<cv::DMatch> good;
  if (a.descriptors.rows < 2 || b.descriptors.rows < 2) return good;
  std::vector<std::vector<cv::DMatch>> nearest;
  cv::BFMatcher(cv::NORM_L2).knnMatch(a.descriptors, b.descriptors, nearest, 2);
  for (const auto& pair : nearest) {
    if (pair.size() == 2 && pair[0].distance < kRatio * pair[1].distance) good.push_back(pair[0]);
  }
  return good;
}

double share(double part, std::size_t whole) { return whole == 0 ? 0.0 : 100.0 * part / static_cast<double>(whole); }

/// Percent of the matches within a pixel of the pair's median row offset.
double on_row(const Points& left, const Points& right, const std::vector<cv::DMatch>& matches) {
  std::vector<double> offsets;
  for (const cv::DMatch& m : matches) {
    offsets.push_back(right.keypoints[m.trainIdx].pt.y - left.keypoints[m.queryIdx].pt.y);
  }
  if (offsets.empty()) return 0.0;
  std::vector<double> sorted = offsets;
  std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
  const double median = sorted[sorted.size() / 2];
  const auto right_ones =
      std::count_if(offsets.begin(), offsets.end(), [&](double offset) { return std::abs(offset - median) < kRowPx; });
  return share(static_cast<double>(right_ones), offsets.size());
}

/// Percent of the matches within a pixel of the epipolar lines of a fundamental matrix.
double epipolar(const Points& from, const Points& to, const std::vector<cv::DMatch>& matches) {
  if (matches.size() < 8) return 0.0;
  std::vector<cv::Point2f> a, b;
  for (const cv::DMatch& m : matches) {
    a.push_back(from.keypoints[m.queryIdx].pt);
    b.push_back(to.keypoints[m.trainIdx].pt);
  }
  cv::setRNGSeed(1);
  cv::Mat inliers;
  cv::findFundamentalMat(a, b, cv::FM_RANSAC, kEpipolarPx, 0.999, 2000, inliers);
  return share(cv::countNonZero(inliers), matches.size());
}

/// Percentiles of the gradient's length, grey values per pixel, over the pixels that are not black sky or shadow.
struct Gradients {
  double p50, p90, p99;
};

Gradients gradients_of(const Image& image) {
  cv::Mat1f dx, dy;
  const cv::Mat1b view = grey(image);
  cv::Sobel(view, dx, CV_32F, 1, 0, 3, 0.125);
  cv::Sobel(view, dy, CV_32F, 0, 1, 3, 0.125);
  std::vector<double> lengths;
  for (int v = 0; v < view.rows; ++v) {
    for (int u = 0; u < view.cols; ++u) {
      if (view(v, u) > 8) lengths.push_back(std::hypot(dx(v, u), dy(v, u)));
    }
  }
  if (lengths.empty()) return {};
  std::sort(lengths.begin(), lengths.end());
  const auto at = [&](double p) {
    return lengths[static_cast<std::size_t>(p * static_cast<double>(lengths.size() - 1))];
  };
  return {at(0.5), at(0.9), at(0.99)};
}

/// Sums over the places of a sequence.
struct Row {
  double p50 = 0.0, p90 = 0.0, p99 = 0.0, keypoints = 0.0;
  double stereo = 0.0, stereo_right = 0.0, metre = 0.0, metre_right = 0.0;
};

Row measured(const StereoSequence& sequence, double frames_apart) {
  Row row;
  const auto apart = static_cast<std::size_t>(std::max(1.0, std::round(frames_apart)));
  const std::size_t last = sequence.size() > apart ? sequence.size() - 1 - apart : 0;
  for (int k = 0; k < kPlaces; ++k) {
    const std::size_t i = last * static_cast<std::size_t>(k) / (kPlaces - 1);
    const StereoFrame here = sequence.frame(i);
    const Points left = points_of(here.left), right = points_of(here.right);
    const Points ahead = points_of(sequence.frame(std::min(i + apart, sequence.size() - 1)).left);
    const Gradients gradients = gradients_of(here.left);
    const auto stereo = matched(left, right), metre = matched(left, ahead);
    row.p50 += gradients.p50, row.p90 += gradients.p90, row.p99 += gradients.p99;
    row.keypoints += static_cast<double>(left.keypoints.size());
    row.stereo += static_cast<double>(stereo.size()), row.stereo_right += on_row(left, right, stereo);
    row.metre += static_cast<double>(metre.size()), row.metre_right += epipolar(left, ahead, metre);
  }
  return row;
}

void print(const std::string& argument) {
  const std::size_t equals = argument.find('=');
  if (equals == std::string::npos) throw Error("'" + argument + "' is not NAME=DATASET:FRAMES_APART");
  std::istringstream parts(argument.substr(equals + 1));
  std::string path, rate, calibration;
  std::getline(parts, path, ':'), std::getline(parts, rate, ':'), std::getline(parts, calibration);
  const auto sequence = open_dataset(path, "", calibration);
  const Row row = measured(*sequence, std::atof(rate.c_str()));
  const Camera& camera = sequence->rig().left;
  const double n = kPlaces;
  fmt::print("| {}, {}x{} | {:.1f} / {:.1f} / {:.1f} | {:.0f} | {:.0f} | {:.0f} % | {:.0f} | {:.0f} % |\n",
             argument.substr(0, equals), camera.width, camera.height, row.p50 / n, row.p90 / n, row.p99 / n,
             row.keypoints / n, row.stereo / n, row.stereo_right / n, row.metre / n, row.metre_right / n);
}

}  // namespace

int main(int argc, char** argv) try {
  fmt::print(
      "| images | gradient p50 / p90 / p99 | keypoints | stereo matches | on the row | matches of frames apart | "
      "epipolar |\n");
  fmt::print("| --- | --- | --- | --- | --- | --- | --- |\n");
  for (int i = 1; i < argc; ++i) print(argv[i]);
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 1;
}
