#include "demslam/features/opencv_extractor.h"

#include <opencv2/features2d.hpp>

namespace demslam {
namespace {

DescriptorRows float_rows(const cv::Mat1f& rows) {
  return Eigen::Map<const DescriptorRows>(rows.ptr<float>(), rows.rows, rows.cols);
}

DescriptorRows bit_rows(const cv::Mat1b& rows) {
  DescriptorRows result(rows.rows, rows.cols * 8);
  for (int r = 0; r < rows.rows; ++r) {
    for (int b = 0; b < rows.cols * 8; ++b) result(r, b) = (rows(r, b / 8) >> (b % 8) & 1) ? 1.0F : -1.0F;
  }
  return result;
}

class OpenCvExtractor : public Extractor {
 public:
  explicit OpenCvExtractor(cv::Ptr<cv::Feature2D> algorithm) : algorithm_(std::move(algorithm)) {}

  Features extract(const Image& image) override {
    Features features{.image_width = image.width, .image_height = image.height};
    if (image.empty()) return features;
    const cv::Mat1b view(image.height, image.width, const_cast<std::uint8_t*>(image.pixels.data()));
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    algorithm_->detectAndCompute(view, cv::noArray(), keypoints, descriptors);
    if (keypoints.empty()) return features;
    for (const cv::KeyPoint& k : keypoints) {
      features.keypoints.emplace_back(k.pt.x, k.pt.y);
      features.scores.push_back(k.response);
    }
    features.descriptors = descriptors.depth() == CV_8U ? bit_rows(descriptors) : float_rows(descriptors);
    features.descriptors.rowwise().normalize();
    return features;
  }

 private:
  cv::Ptr<cv::Feature2D> algorithm_;
};

}  // namespace

std::unique_ptr<Extractor> make_orb_extractor(int max_features) {
  return std::make_unique<OpenCvExtractor>(cv::ORB::create(max_features));
}

std::unique_ptr<Extractor> make_sift_extractor(int max_features) {
  return std::make_unique<OpenCvExtractor>(cv::SIFT::create(max_features));
}

}  // namespace demslam
