#include "demslam/image/image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "demslam/base/error.h"
#include "demslam/base/random.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

class ImageFile : public testing::Test {
 protected:
  ImageFile() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() / (std::string("demslam_image_") + info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~ImageFile() override { fs::remove_all(folder_); }

  static Image noise(int width, int height) {
    Random random(1);
    Image image(width, height);
    for (auto& pixel : image.pixels) pixel = static_cast<std::uint8_t>(random.index(256));
    return image;
  }

  void truncate(const fs::path& file, double part) const {
    fs::resize_file(file, static_cast<std::uintmax_t>(static_cast<double>(fs::file_size(file)) * part));
  }

  static void expect_refused(const fs::path& file, const std::string& reason) {
    EXPECT_THAT([&] { read_image(file); }, testing::ThrowsMessage<Error>(testing::AllOf(
                                               testing::HasSubstr(file.string()), testing::HasSubstr(reason),
                                               testing::Not(testing::HasSubstr("\n")))));
  }

  fs::path folder_;
};

TEST_F(ImageFile, PngReadsBackAsWritten) {
  const Image image = noise(31, 17);
  write_image(folder_ / "a.png", image);
  const Image back = read_image(folder_ / "a.png");
  EXPECT_EQ(back.width, 31);
  EXPECT_EQ(back.height, 17);
  EXPECT_EQ(back.pixels, image.pixels);
}

TEST_F(ImageFile, JpegKeepsTheGreyValuesNearly) {
  write_image(folder_ / "a.JPG", Image(40, 30, 77));
  EXPECT_NEAR(read_image(folder_ / "a.JPG").at(20, 15), 77, 2);
}

TEST_F(ImageFile, MissingFileIsNamed) { expect_refused(folder_ / "none.png", "does not exist"); }

TEST_F(ImageFile, FolderIsNoImage) { expect_refused(folder_, "is not a file"); }

TEST_F(ImageFile, TruncatedPngIsRefused) {
  write_image(folder_ / "a.png", noise(200, 100));
  for (const double part : {0.99, 0.5, 0.01}) {
    truncate(folder_ / "a.png", part);
    expect_refused(folder_ / "a.png", "is truncated");
  }
}

TEST_F(ImageFile, TruncatedJpegIsRefused) {
  write_image(folder_ / "a.jpg", noise(200, 100));
  for (const double part : {0.99, 0.5}) {
    truncate(folder_ / "a.jpg", part);
    expect_refused(folder_ / "a.jpg", "is truncated");
  }
}

TEST_F(ImageFile, CorruptPngIsRefused) {
  write_image(folder_ / "a.png", noise(200, 100));
  std::fstream stream(folder_ / "a.png", std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(2000);
  for (int i = 0; i < 2000; ++i) stream.put('\0');
  stream.close();
  expect_refused(folder_ / "a.png", "is damaged");
}

TEST_F(ImageFile, TextAndEmptyFilesAreRefused) {
  std::ofstream(folder_ / "text.png") << "no image at all";
  std::ofstream(folder_ / "empty.png").flush();
  expect_refused(folder_ / "text.png", "no known image format");
  expect_refused(folder_ / "empty.png", "is empty");
}

TEST_F(ImageFile, WritingSaysWhatIsWrong) {
  const Image image(4, 4, 100);
  EXPECT_THAT([&] { write_image(folder_ / "no" / "a.png", image); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("cannot create")));
  EXPECT_THAT([&] { write_image(folder_ / "a.xyz", image); },
              testing::ThrowsMessage<Error>(testing::HasSubstr(".png or .jpg")));
  EXPECT_THAT([&] { write_image(folder_ / "a.png", Image()); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("no pixels")));
}

TEST_F(ImageFile, FullDiskIsReported) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "/dev/full does not exist here";
  fs::create_symlink("/dev/full", folder_ / "a.png");
  EXPECT_THAT([&] { write_image(folder_ / "a.png", noise(300, 300)); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("is the disk full?")));
}

}  // namespace
}  // namespace demslam
