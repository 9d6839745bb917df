#include "demslam/image/image.h"

#include <algorithm>
#include <cctype>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "demslam/base/error.h"
#include "demslam/image/encoded.h"

namespace demslam {
namespace {

cv::Mat decode_grey(const std::vector<std::uint8_t>& bytes, const std::filesystem::path& file) {
  try {
    cv::Mat grey = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
    if (!grey.empty()) return grey;
  } catch (const cv::Exception&) {
    // Reported below, in one line and with the file's name.
  }
  throw Error("image " + file.string() + " is damaged or in no known image format");
}

std::string lower_extension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension;
}

}  // namespace

Image read_image(const std::filesystem::path& file) {
  const std::vector<std::uint8_t> bytes = read_encoded(file);
  check_complete(bytes, file);
  const cv::Mat grey = decode_grey(bytes, file);
  Image image(grey.cols, grey.rows);
  grey.copyTo(cv::Mat(image.height, image.width, CV_8U, image.pixels.data()));
  return image;
}

void write_image(const std::filesystem::path& file, const Image& image) {
  const std::string extension = lower_extension(file);
  if (extension != ".png" && extension != ".jpg" && extension != ".jpeg") {
    throw Error("cannot write " + file.string() + ": images are written as .png or .jpg");
  }
  if (image.empty()) throw Error("cannot write " + file.string() + ": the image has no pixels");
  const cv::Mat grey(image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.pixels.data()));
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, grey, bytes);
  write_encoded(file, bytes);
}

void write_image(const std::filesystem::path& file, int width, int height, const std::vector<std::uint16_t>& values) {
  const cv::Mat grey(height, width, CV_16U, const_cast<std::uint16_t*>(values.data()));
  std::vector<std::uint8_t> bytes;
  cv::imencode(".png", grey, bytes);
  write_encoded(file, bytes);
}

}  // namespace demslam
