#include "demslam/dataset/sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/dataset/test_folder.h"

namespace demslam {
namespace {

using test::TestFolder;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(OpenDataset, APathThatIsNotThereIsNamed) {
  EXPECT_THAT([] { open_dataset("/nowhere/at/all"); },
              ThrowsMessage<Error>(HasSubstr("/nowhere/at/all: there is no such")));
}

TEST(OpenDataset, AFolderThatIsNoDatasetGetsTheListOfKnownFormats) {
  const TestFolder folder;
  EXPECT_THAT(
      [&] { open_dataset(folder.path()); },
      ThrowsMessage<Error>(AllOf(HasSubstr("demslam"), HasSubstr("kitti"), HasSubstr("euroc"), HasSubstr("folders"))));
}

TEST(OpenDataset, AnUnknownFormatIsNamed) {
  const TestFolder folder;
  EXPECT_THAT([&] { open_dataset(folder.path(), "kity"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("unknown dataset format 'kity'"), HasSubstr("kitti"))));
}

TEST(OpenDataset, EveryFormatHasAName) {
  EXPECT_THAT(dataset_formats(), testing::IsSupersetOf({"demslam", "lusnar", "s3li", "kitti", "euroc", "folders"}));
}

}  // namespace
}  // namespace demslam
