#include "demslam/image/canvas.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "demslam/base/error.h"
#include "demslam/image/encoded.h"

namespace demslam {
namespace {

constexpr int kFractionBits = 4;  // sub-pixel bits of OpenCV's drawing
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;

cv::Scalar to_cv(Colour colour) { return {double(colour.blue), double(colour.green), double(colour.red)}; }

int fixed(double pixels) { return static_cast<int>(std::lround(std::clamp(pixels, -1e6, 1e6) * (1 << kFractionBits))); }

cv::Point fixed(const Eigen::Vector2d& pixel) { return {fixed(pixel.x()), fixed(pixel.y())}; }

std::uint8_t grey_of(float value, float low, float high) {
  return static_cast<std::uint8_t>(std::lround(255.0F * std::clamp((value - low) / (high - low), 0.0F, 1.0F)));
}

}  // namespace

struct Canvas::Picture {
  cv::Mat bgr;

  /// Pastes a zoomed grey layer where `mask` (or everything, if empty) is set.
  void paste(const cv::Mat& grey, const cv::Mat& mask, int u, int v, double zoom) {
    const cv::Size size(std::max(1, cvRound(grey.cols * zoom)), std::max(1, cvRound(grey.rows * zoom)));
    const cv::Rect target = cv::Rect(cv::Point(u, v), size) & cv::Rect(cv::Point(), bgr.size());
    if (target.empty()) return;
    const cv::Rect source = target - cv::Point(u, v);
    cv::Mat layer, zoomed_mask;
    cv::resize(grey, layer, size, 0.0, 0.0, zoom < 1.0 ? cv::INTER_AREA : cv::INTER_NEAREST);
    cv::cvtColor(layer, layer, cv::COLOR_GRAY2BGR);
    if (!mask.empty()) cv::resize(mask, zoomed_mask, size, 0.0, 0.0, cv::INTER_NEAREST);
    layer(source).copyTo(bgr(target), mask.empty() ? cv::Mat() : zoomed_mask(source));
  }
};

Canvas::Canvas(int width, int height, Colour background) : picture_(std::make_unique<Picture>()) {
  if (width <= 0 || height <= 0) throw Error("a picture needs a positive width and height");
  picture_->bgr = cv::Mat(height, width, CV_8UC3, to_cv(background));
}

Canvas::~Canvas() = default;
Canvas::Canvas(Canvas&&) noexcept = default;

int Canvas::width() const { return picture_->bgr.cols; }
int Canvas::height() const { return picture_->bgr.rows; }

Colour Canvas::at(int u, int v) const {
  const cv::Vec3b bgr = picture_->bgr.at<cv::Vec3b>(v, u);
  return {bgr[2], bgr[1], bgr[0]};
}

void Canvas::fill(Colour colour) { picture_->bgr.setTo(to_cv(colour)); }

void Canvas::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, Colour colour, int thickness_px) {
  cv::line(picture_->bgr, fixed(from), fixed(to), to_cv(colour), thickness_px, cv::LINE_AA, kFractionBits);
}

void Canvas::polyline(std::span<const Eigen::Vector2d> points, Colour colour, int thickness_px) {
  std::vector<cv::Point> vertices;
  for (const Eigen::Vector2d& point : points) vertices.push_back(fixed(point));
  cv::polylines(picture_->bgr, vertices, false, to_cv(colour), thickness_px, cv::LINE_AA, kFractionBits);
}

void Canvas::circle(const Eigen::Vector2d& centre, double radius_px, Colour colour, int thickness_px) {
  cv::circle(picture_->bgr, fixed(centre), fixed(radius_px), to_cv(colour), thickness_px, cv::LINE_AA, kFractionBits);
}

void Canvas::text(const std::string& text, const Eigen::Vector2d& position, Colour colour, double scale,
                  int thickness_px) {
  const cv::Point baseline(cvRound(position.x()), cvRound(position.y()));
  cv::putText(picture_->bgr, text, baseline, kFont, scale, to_cv(colour), thickness_px, cv::LINE_AA);
}

Eigen::Vector2d Canvas::text_size(const std::string& text, double scale, int thickness_px) {
  const cv::Size size = cv::getTextSize(text, kFont, scale, thickness_px, nullptr);
  return {double(size.width), double(size.height)};
}

void Canvas::draw(const Image& image, int u, int v, double zoom) {
  const cv::Mat grey(image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.pixels.data()));
  if (!image.empty()) picture_->paste(grey, {}, u, v, zoom);
}

void Canvas::draw(std::span<const float> values, int columns, float low, float high, int u, int v, double zoom) {
  if (values.empty()) return;
  assert(columns > 0 && values.size() % columns == 0 && high > low);
  cv::Mat grey(static_cast<int>(values.size()) / columns, columns, CV_8U, cv::Scalar(0)), mask = grey.clone();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isnan(values[i])) continue;
    grey.data[i] = grey_of(values[i], low, high);
    mask.data[i] = 255;
  }
  picture_->paste(grey, mask, u, v, zoom);
}

std::string Canvas::png() const {
  std::vector<std::uint8_t> bytes;
  cv::imencode(".png", picture_->bgr, bytes);
  return {bytes.begin(), bytes.end()};
}

void Canvas::write(const std::filesystem::path& file) const {
  std::vector<std::uint8_t> bytes;
  try {
    cv::imencode(file.extension().string(), picture_->bgr, bytes);
  } catch (const cv::Exception&) {
    throw Error("cannot write " + file.string() + ": pictures are written as .png or .jpg");
  }
  write_encoded(file, bytes);
}

}  // namespace demslam
