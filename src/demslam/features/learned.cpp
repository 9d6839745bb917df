#include "demslam/features/learned.h"

#include <algorithm>
#include <array>

#include "demslam/base/error.h"

namespace demslam {
namespace {

/// The grey image, divided by 255, `channels` times; continued to the right and below by its last pixels until both
/// sides are multiples of `multiple`.
Tensor to_tensor(const Image& image, int channels, int multiple) {
  const auto up = [multiple](int size) { return (size + multiple - 1) / multiple * multiple; };
  const int width = up(image.width), height = up(image.height);
  std::array<float, 256> shares;
  for (std::size_t grey = 0; grey < shares.size(); ++grey) shares[grey] = static_cast<float>(grey) / 255.0F;
  const std::size_t plane = static_cast<std::size_t>(width) * height;
  Tensor tensor{.shape = {1, channels, height, width}, .channels_alike = true};
  tensor.floats.resize(plane);
  for (int v = 0; v < height; ++v) {
    const std::uint8_t* from = &image.pixels[static_cast<std::size_t>(std::min(v, image.height - 1)) * image.width];
    float* to = &tensor.floats[static_cast<std::size_t>(v) * width];
    for (int u = 0; u < image.width; ++u) to[u] = shares[from[u]];
    std::fill(to + image.width, to + width, to[image.width - 1]);
  }
  return tensor;
}

class XFeatExtractor : public Extractor {
 public:
  XFeatExtractor(OpenModel model, int max_features) : model_(std::move(model)), max_features_(max_features) {}

  Features extract(const Image& image) override {
    if (image.empty()) return {.image_width = image.width, .image_height = image.height};
    const auto maps = model_.session.run({model_.info.inputs[0].name}, {to_tensor(image, 3, 32)},
                                         {"descriptors", "keypoint_logits", "reliability"}, true);
    return decode_xfeat({maps[0].floats, static_cast<int>(maps[0].shape[1]), static_cast<int>(maps[0].shape[2]),
                         static_cast<int>(maps[0].shape[3]), maps[1].floats, maps[2].floats, maps[0].channels_last,
                         maps[1].channels_last},
                        image.width, image.height, max_features_, static_cast<float>(model_.info.card.min_probability));
  }

 private:
  OpenModel model_;
  int max_features_;
};

class SuperPointExtractor : public Extractor {
 public:
  SuperPointExtractor(OpenModel model, int max_features) : model_(std::move(model)), max_features_(max_features) {}

  Features extract(const Image& image) override {
    Features features{.image_width = image.width, .image_height = image.height};
    if (std::min(image.width, image.height) < 8) return features;  // one cell of the network
    const auto out = model_.session.run({model_.info.inputs[0].name}, {to_tensor(image, 1, 1)},
                                        {"keypoints", "scores", "descriptors"});
    const auto width = out[2].shape[2];
    const std::vector<std::size_t> order = strongest(out[1].floats, max_features_);
    features.descriptors.resize(static_cast<Eigen::Index>(order.size()), width);
    for (const std::size_t i : order) {
      features.descriptors.row(static_cast<Eigen::Index>(features.size())) =
          Eigen::Map<const Eigen::RowVectorXf>(&out[2].floats[i * width], width).normalized();
      features.keypoints.emplace_back(static_cast<float>(out[0].integers[2 * i]),
                                      static_cast<float>(out[0].integers[2 * i + 1]));
      features.scores.push_back(out[1].floats[i]);
    }
    return features;
  }

 private:
  OpenModel model_;
  int max_features_;
};

/// Keypoints as LightGlue wants them: origin in the image's middle, half of the longer side is one.
Tensor centred_keypoints(const Features& features) {
  const float width = static_cast<float>(features.image_width), height = static_cast<float>(features.image_height);
  const float scale = std::max(width, height) / 2.0F;
  Tensor tensor{.shape = {1, static_cast<std::int64_t>(features.size()), 2}};
  for (const Eigen::Vector2f& k : features.keypoints) {
    tensor.floats.insert(tensor.floats.end(), {(k.x() - width / 2.0F) / scale, (k.y() - height / 2.0F) / scale});
  }
  return tensor;
}

Tensor descriptor_tensor(const Features& features) {
  const auto& rows = features.descriptors;
  return {.shape = {1, rows.rows(), rows.cols()}, .floats = {rows.data(), rows.data() + rows.size()}};
}

class LightGlueMatcher : public Matcher {
 public:
  LightGlueMatcher(OpenModel model, double min_score) : model_(std::move(model)), min_score_(min_score) {
    const bool numbered =
        std::ranges::any_of(model_.info.outputs, [](const TensorInfo& t) { return t.name == "matches0"; });
    outputs_ =
        numbered ? std::vector<std::string>{"matches0", "mscores0"} : std::vector<std::string>{"matches", "scores"};
  }

  std::vector<Match> match(const Features& query, const Features& train) override {
    if (query.size() == 0 || train.size() == 0) return {};
    check_width(query);
    check_width(train);
    const auto out = model_.session.run(
        {"kpts0", "kpts1", "desc0", "desc1"},
        {centred_keypoints(query), centred_keypoints(train), descriptor_tensor(query), descriptor_tensor(train)},
        outputs_);
    return select(out[0].integers, out[1].floats, query.size(), train.size());
  }

 private:
  void check_width(const Features& features) const {
    const int wanted = model_.info.descriptor_width;
    if (wanted < 0 || features.descriptors.cols() == wanted) return;
    throw Error(model_.info.file.string() + ": matches descriptors of width " + std::to_string(wanted) +
                ", got width " + std::to_string(features.descriptors.cols()) +
                "; use the extractor it was trained with");
  }

  /// Best first, each point once.
  std::vector<Match> select(const std::vector<std::int64_t>& pairs, const std::vector<float>& scores,
                            std::size_t queries, std::size_t trains) const {
    std::vector<bool> query_taken(queries, false), train_taken(trains, false);
    std::vector<Match> matches;
    for (const std::size_t i : strongest(scores, static_cast<int>(scores.size()))) {
      const auto query = static_cast<std::size_t>(pairs[2 * i]), train = static_cast<std::size_t>(pairs[2 * i + 1]);
      if (!(scores[i] > min_score_) || query_taken.at(query) || train_taken.at(train)) continue;
      query_taken[query] = train_taken[train] = true;
      matches.push_back({static_cast<int>(query), static_cast<int>(train), scores[i]});
    }
    return matches;
  }

  OpenModel model_;
  double min_score_;
  std::vector<std::string> outputs_;
};

[[noreturn]] void refuse(const ModelInfo& info, const std::string& wanted) {
  throw Error(info.file.string() + ": a model of contract " + to_string(info.contract) + " is no " + wanted);
}

}  // namespace

std::unique_ptr<Extractor> make_learned_extractor(OpenModel model, int max_features) {
  switch (model.info.contract) {
    case Contract::xfeat:
      return std::make_unique<XFeatExtractor>(std::move(model), max_features);
    case Contract::superpoint:
      return std::make_unique<SuperPointExtractor>(std::move(model), max_features);
    case Contract::lightglue:
      break;
  }
  refuse(model.info, "extractor");
}

std::unique_ptr<Matcher> make_learned_matcher(OpenModel model, double min_score) {
  if (model.info.contract != Contract::lightglue) refuse(model.info, "matcher");
  return std::make_unique<LightGlueMatcher>(std::move(model), min_score);
}

}  // namespace demslam
