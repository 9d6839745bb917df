#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <string>

/// Runs the tests of one program in a temporary folder of its own, which is the current one too, so that tests running
/// side by side never share a file.
int main(int argc, char** argv) {
  std::string folder = (std::filesystem::temp_directory_path() / "demslam_test.XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) return EXIT_FAILURE;
  std::filesystem::permissions(folder, std::filesystem::perms{0755});  // Some tests enter it as another user.
  std::filesystem::current_path(folder);
  setenv("TMPDIR", folder.c_str(), 1);
  setenv("TEST_TMPDIR", folder.c_str(), 1);
  testing::InitGoogleMock(&argc, argv);
  const int result = RUN_ALL_TESTS();
  std::error_code ignored;
  std::filesystem::current_path("/", ignored);
  std::filesystem::remove_all(folder, ignored);
  return result;
}
