#include "demslam/dataset/sequence.h"

#include <algorithm>
#include <array>

#include "demslam/base/error.h"
#include "demslam/dataset/readers.h"

namespace demslam {
namespace {

/// In the order they are tried: the more particular layout first.
const std::array kReaders = {
    &kDemslamReader,  // before LuSNAR, whose images it shares
    &kLusnarReader,   //
    &kS3liReader,     //
    &kEurocReader,    //
    &kKittiReader,    //
    &kFoldersReader,  //
};

std::string known_formats() {
  std::string text;
  for (const DatasetReader* reader : kReaders) {
    text += (text.empty() ? "" : "; ") + std::string(reader->format) + " (" + reader->looks_like + ")";
  }
  return text;
}

const DatasetReader& choose(const std::filesystem::path& path, const std::string& format) {
  const auto fits = [&](const DatasetReader* reader) {
    return format.empty() ? reader->recognises(path) : reader->format == format;
  };
  const auto found = std::find_if(kReaders.begin(), kReaders.end(), fits);
  if (found != kReaders.end()) return **found;
  const std::string problem = format.empty() ? "no dataset that is known" : "unknown dataset format '" + format + "'";
  throw Error(path.string() + ": " + problem + "; known formats: " + known_formats());
}

}  // namespace

std::unique_ptr<StereoSequence> open_dataset(const std::filesystem::path& path, const std::string& format,
                                             const std::filesystem::path& calibration) {
  if (!std::filesystem::exists(path)) throw Error(path.string() + ": there is no such dataset; check the path");
  return choose(path, format).open(path, calibration);
}

std::vector<std::string> dataset_formats() {
  std::vector<std::string> names;
  for (const DatasetReader* reader : kReaders) names.emplace_back(reader->format);
  return names;
}

}  // namespace demslam
