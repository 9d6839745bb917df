// Reads the #include lines of the whole source tree: no arrow up the floors, none sideways, and every third-party
// library only behind its own door (docs/architecture.md).
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const std::map<std::string, int> kFloor = {
    {"base", 0},       {"geometry", 0}, {"toml", 1},    {"image", 1},    {"dem", 1},    {"dataset", 2},
    {"evaluation", 2}, {"features", 3}, {"mapping", 3}, {"odometry", 4}, {"sim", 4},    {"graph", 5},
    {"anchoring", 6},  {"store", 6},    {"slam", 7},    {"config", 8},   {"report", 8}, {"experiment", 9},
};

/// Which modules may use a library, by the beginning of the header's name.
const std::map<std::string, std::set<std::string>> kDoors = {
    {"opencv2/", {"image", "features", "odometry"}},
    {"onnxruntime", {"features"}},
    {"dnnl", {"features"}},
    {"oneapi/dnnl", {"features"}},
    {"gtsam/", {"graph", "anchoring"}},
    {"gdal", {"dem"}},
    {"ogr_", {"dem"}},
    {"cpl_", {"dem"}},
    {"proj", {"dem"}},
    {"embree4/", {"sim"}},
    {"tbb/", {"dem", "features", "odometry", "sim", "graph", "experiment"}},
    {"toml++/", {"toml"}},
    {"yaml-cpp/", {"dataset"}},
    {"sqlite3", {"store"}},
    {"openssl/", {"base"}},
    {"httplib", {"features", "report"}},
    {"CLI/", {}},  // apps only
};

struct Include {
  std::string module, file, header;
};

std::vector<Include> includes() {
  static const std::regex pattern(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  std::vector<Include> found;
  const fs::path root = fs::path(DEMSLAM_SOURCE_DIR) / "src" / "demslam";
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    const fs::path& path = entry.path();
    if (path.extension() != ".h" && path.extension() != ".cpp") continue;
    std::ifstream stream(path);
    std::smatch match;
    for (std::string line; std::getline(stream, line);) {
      if (!std::regex_search(line, match, pattern)) continue;
      const fs::path relative = fs::relative(path, root);
      found.push_back({relative.begin()->string(), relative.string(), match[1]});
    }
  }
  return found;
}

std::string module_of(const std::string& header) {
  if (header.rfind("demslam/", 0) != 0) return "";
  return header.substr(8, header.find('/', 8) - 8);
}

bool may_include(const std::string& from, const std::string& to) {
  if (from == to || to == "base") return true;  // base is the ground the house stands on
  return kFloor.at(to) < kFloor.at(from);
}

/// A module's own headers, in its folder internal/: not installed, seen by no other module.
bool is_internal(const std::string& path) { return path.find("/internal/") != std::string::npos; }

bool is_test(const std::string& file) { return file.find("_test.cpp") != std::string::npos; }

TEST(Architecture, EveryFolderHasAFloor) {
  for (const auto& entry : fs::directory_iterator(fs::path(DEMSLAM_SOURCE_DIR) / "src" / "demslam")) {
    if (entry.is_directory()) {
      EXPECT_EQ(kFloor.count(entry.path().filename().string()), 1U) << entry.path();
    }
  }
}

TEST(Architecture, IncludesGoDownward) {
  int checked = 0;
  for (const Include& include : includes()) {
    const std::string to = module_of(include.header);
    if (to.empty()) continue;
    ASSERT_EQ(kFloor.count(to), 1U) << include.file << " includes " << include.header;
    EXPECT_TRUE(may_include(include.module, to))
        << include.file << " (floor " << kFloor.at(include.module) << ") includes " << include.header << " (floor "
        << kFloor.at(to) << ")";
    ++checked;
  }
  EXPECT_GT(checked, 100);
}

TEST(Architecture, LibrariesStayBehindTheirDoors) {
  for (const Include& include : includes()) {
    for (const auto& [prefix, rooms] : kDoors) {
      if (include.header.rfind(prefix, 0) != 0) continue;
      EXPECT_TRUE(rooms.count(include.module) == 1) << include.file << " includes " << include.header;
    }
  }
}

TEST(Architecture, HeadersOfTheLowerFloorsShowOnlyEigenAndStd) {
  for (const Include& include : includes()) {
    const bool header = include.file.size() > 2 && include.file.substr(include.file.size() - 2) == ".h";
    if (!header || is_internal(include.file) || kFloor.at(include.module) > 3) continue;
    if (!module_of(include.header).empty() || include.header.rfind("Eigen/", 0) == 0) continue;
    EXPECT_EQ(include.header.find_first_of("./"), std::string::npos) << include.file << " shows " << include.header;
  }
}

TEST(Architecture, InternalHeadersStayInTheirModule) {
  int checked = 0;
  for (const Include& include : includes()) {
    if (!is_internal(include.header)) continue;
    EXPECT_EQ(include.module, module_of(include.header)) << include.file << " includes " << include.header;
    ++checked;
  }
  EXPECT_GT(checked, 0);
}

TEST(Architecture, OnlyEvaluationReadsGroundTruth) {
  static const std::regex truth(R"re("(gt\.txt|poses\.txt|ground_truth[^"]*|data\.csv state_groundtruth[^"]*)")re");
  const fs::path root = fs::path(DEMSLAM_SOURCE_DIR) / "src" / "demslam";
  for (const std::string room : {"dataset", "features", "odometry", "graph", "anchoring", "slam", "store"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / room)) {
      if (!entry.is_regular_file() || is_test(entry.path().string())) continue;
      std::ifstream stream(entry.path());
      for (std::string line; std::getline(stream, line);) {
        EXPECT_FALSE(std::regex_search(line, truth)) << entry.path() << ": " << line;
      }
    }
  }
}

}  // namespace
