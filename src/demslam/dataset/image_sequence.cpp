#include "demslam/dataset/image_sequence.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <set>

#include "demslam/base/error.h"
#include "demslam/base/text.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

bool is_image(const fs::path& file) {
  static const std::set<std::string> kExtensions = {".png", ".jpg", ".jpeg", ".pgm", ".ppm", ".bmp", ".tif", ".tiff"};
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return kExtensions.count(extension) != 0;
}

std::string size_text(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

class ImageSequence : public StereoSequence {
 public:
  explicit ImageSequence(ImageDataset dataset) : dataset_(std::move(dataset)) {}

  std::string format() const override { return dataset_.format; }
  const StereoRig& rig() const override { return dataset_.rig; }
  std::size_t size() const override { return dataset_.pairs.size(); }
  TimestampNs stamp_ns(std::size_t index) const override { return dataset_.pairs.at(index).t_ns; }
  std::size_t unpaired() const override { return dataset_.unpaired; }
  std::optional<fs::path> dem_file() const override { return dataset_.dem_file; }
  std::optional<StartPose> start() const override { return dataset_.start; }
  std::vector<fs::path> definition_files() const override { return dataset_.definition_files; }

  StereoFrame frame(std::size_t index) const override {
    const StereoFiles& files = dataset_.pairs.at(index);
    StereoFrame frame{files.t_ns, read_image(files.left), read_image(files.right)};
    check_sizes(files, frame);
    return frame;
  }

 private:
  void check_sizes(const StereoFiles& files, const StereoFrame& frame) const {
    const std::string left = size_text(frame.left.width, frame.left.height);
    const std::string right = size_text(frame.right.width, frame.right.height);
    if (left != right) {
      throw Error(files.left.string() + " is " + left + " but " + files.right.string() + " is " + right +
                  "; the images of a pair must have the same size");
    }
    const std::string expected = size_text(dataset_.rig.left.width, dataset_.rig.left.height);
    if (left != expected) {
      throw Error(files.left.string() + " is " + left + " but the calibration is for " + expected +
                  "; use the calibration of these images");
    }
  }

  ImageDataset dataset_;
};

void check_stamps(const ImageDataset& dataset) {
  for (std::size_t i = 1; i < dataset.pairs.size(); ++i) {
    const StereoFiles &before = dataset.pairs[i - 1], &now = dataset.pairs[i];
    if (now.t_ns > before.t_ns) continue;
    throw Error(dataset.path.string() + ": the stamps do not increase: " + now.left.filename().string() + " at " +
                seconds_text(now.t_ns) + " s follows " + before.left.filename().string() + " at " +
                seconds_text(before.t_ns) + " s");
  }
}

[[noreturn]] void fail_partner(const fs::path& image, const fs::path& folder) {
  throw Error(image.string() + ": its partner in " + folder.string() + " is missing; add it or remove this image");
}

std::vector<StereoFiles> pair_by_name(const std::vector<fs::path>& left, const std::vector<fs::path>& right) {
  std::map<std::string, fs::path> partners;
  for (const fs::path& file : right) partners[file.stem().string()] = file;
  std::vector<StereoFiles> pairs;
  for (const fs::path& file : left) {
    const auto partner = partners.extract(file.stem().string());
    if (partner.empty()) fail_partner(file, right.front().parent_path());
    pairs.push_back({0, file, partner.mapped()});
  }
  if (!partners.empty()) fail_partner(partners.begin()->second, left.front().parent_path());
  return pairs;
}

bool share_a_name(const std::vector<fs::path>& left, const std::vector<fs::path>& right) {
  std::set<std::string> names;
  for (const fs::path& file : left) names.insert(file.stem().string());
  return std::any_of(right.begin(), right.end(),
                     [&](const fs::path& file) { return names.count(file.stem().string()); });
}

}  // namespace

std::unique_ptr<StereoSequence> make_sequence(ImageDataset dataset) {
  if (dataset.pairs.empty()) {
    throw Error(dataset.path.string() + ": the dataset is empty, it has no stereo pair; check the image folders");
  }
  check_stamps(dataset);
  return std::make_unique<ImageSequence>(std::move(dataset));
}

bool natural_less(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!digit(a[i]) || !digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    const auto number = [&](const std::string& text, std::size_t& at) {
      while (at < text.size() && text[at] == '0') ++at;
      const std::size_t begin = at;
      while (at < text.size() && digit(text[at])) ++at;
      return text.substr(begin, at - begin);
    };
    const std::string m = number(a, i), n = number(b, j);
    if (m != n) return m.size() != n.size() ? m.size() < n.size() : m < n;
  }
  return std::make_pair(a.size() - i, a) < std::make_pair(b.size() - j, b);
}

std::vector<fs::path> image_files(const fs::path& folder) {
  if (!fs::is_directory(folder)) throw Error(folder.string() + ": the image folder is missing");
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (is_image(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return files;
}

std::vector<StereoFiles> pair_images(const fs::path& left_folder, const fs::path& right_folder) {
  const std::vector<fs::path> left = image_files(left_folder), right = image_files(right_folder);
  if (share_a_name(left, right)) return pair_by_name(left, right);
  if (left.size() != right.size()) {
    throw Error(left_folder.string() + " has " + std::to_string(left.size()) + " images but " + right_folder.string() +
                " has " + std::to_string(right.size()) + "; every image needs its partner");
  }
  std::vector<StereoFiles> pairs;
  for (std::size_t i = 0; i < left.size(); ++i) pairs.push_back({0, left[i], right[i]});
  return pairs;
}

void stamp_pairs(std::vector<StereoFiles>& pairs, const fs::path& times_file, double frame_rate_hz) {
  if (!fs::exists(times_file)) {
    for (std::size_t i = 0; i < pairs.size(); ++i)
      pairs[i].t_ns = std::llround(1e9 * static_cast<double>(i) / frame_rate_hz);
    return;
  }
  const TextTable times = read_table(times_file);
  if (times.rows.size() != pairs.size()) {
    throw Error(times_file.string() + " has " + std::to_string(times.rows.size()) + " stamps for " +
                std::to_string(pairs.size()) + " pairs; there must be one line per pair");
  }
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto t_ns = seconds_to_ns(times.rows[i].fields.front());
    if (!t_ns) times.fail(times.rows[i], "'" + times.rows[i].fields.front() + "' is no time in seconds");
    pairs[i].t_ns = *t_ns;
  }
}

void stamp_pairs_by_name(std::vector<StereoFiles>& pairs) {
  for (StereoFiles& pair : pairs) {
    const std::string stem = pair.left.stem().string();
    const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), pair.t_ns);
    if (error == std::errc() && end == stem.data() + stem.size()) continue;
    throw Error(pair.left.string() + ": the name must be the stamp in integer nanoseconds");
  }
}

}  // namespace demslam
