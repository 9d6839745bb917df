// What happens to a map when the process, the disk, the file or another run misbehaves.
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>
#include <thread>

#include "demslam/base/error.h"
#include "demslam/base/sha256.h"
#include "demslam/base/text.h"
#include "demslam/dataset/test_folder.h"
#include "demslam/store/map_check.h"
#include "demslam/store/test_map.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using test::entry;
using test::make_map;
using test::same_bits;
using test::small_header;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr int kDone = 0, kRefused = 3, kOther = 4;

/// Runs `work` in a process of its own, which ends with kDone, or kRefused after an Error.
pid_t start_process(const std::function<void()>& work) {
  const pid_t child = fork();
  if (child != 0) return child;
  try {
    work();
    _exit(kDone);
  } catch (const Error&) {
    _exit(kRefused);
  } catch (...) {
    _exit(kOther);
  }
}

int wait_for(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return status;
}

int exit_code(const std::function<void()>& work) {
  const int status = wait_for(start_process(work));
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void expect_whole_keyframes(const fs::path& file, std::size_t at_least) {
  EXPECT_THAT(check_map(file).problems, testing::IsEmpty());
  const MapStore store = MapStore::open_read_only(file);
  ASSERT_GE(store.keyframe_count(), at_least);
  for (std::size_t k = 0; k < store.keyframe_count(); ++k) {
    EXPECT_TRUE(same_bits(*store.features(k), *entry(k).features)) << k;
    EXPECT_TRUE(same_bits(store.keyframe(k).T_map_body, entry(k).keyframe.T_map_body)) << k;
  }
  if (store.keyframe_count() > 0) {
    EXPECT_EQ(store.checkpoint(), entry(store.keyframe_count() - 1).checkpoint);
  }
}

void overwrite(const fs::path& file, std::int64_t offset, const std::string& bytes) {
  std::fstream stream(file, std::ios::binary | std::ios::in | std::ios::out);
  stream.seekp(offset);
  stream << bytes;
}

TEST(DamagedMap, TruncatedAnywhereIsRefusedAndLeftAsItIs) {
  const test::TestFolder folder;
  const fs::path whole = make_map(folder.path() / "whole.db", 12), cut = folder.path() / "cut.db";
  const auto size = fs::file_size(whole);
  Random random(5);
  for (int i = 0; i < 60; ++i) {
    const std::uint64_t length = i < 10 ? i * 16384 : random.index(size);
    fs::copy_file(whole, cut, fs::copy_options::overwrite_existing);
    fs::resize_file(cut, length);
    const std::string before = sha256_of_file(cut);
    EXPECT_THROW(MapStore::open(cut), Error) << length;
    EXPECT_THROW(MapStore::open_read_only(cut), Error) << length;
    EXPECT_THROW(check_map(cut), Error) << length;
    EXPECT_EQ(sha256_of_file(cut), before) << length;
  }
}

TEST(DamagedMap, OverwrittenAnywhereNeverCrashesAReader) {
  const test::TestFolder folder;
  const fs::path whole = make_map(folder.path() / "whole.db", 12), hurt = folder.path() / "hurt.db";
  Random random(6);
  int refused = 0, found = 0;
  for (int i = 0; i < 100; ++i) {
    fs::copy_file(whole, hurt, fs::copy_options::overwrite_existing);
    std::string noise(1024, '\0');
    for (char& c : noise) c = static_cast<char>(random.index(256));
    overwrite(hurt, static_cast<std::int64_t>(random.index(fs::file_size(whole) - noise.size())), noise);
    const std::string before = sha256_of_file(hurt);
    try {
      found += check_map(hurt).problems.empty() ? 0 : 1;
    } catch (const Error&) {
      ++refused;
    }
    EXPECT_EQ(sha256_of_file(hurt), before);
  }
  EXPECT_GT(refused, 0);
  EXPECT_GT(found, 0);
}

TEST(DamagedMap, AnotherFileIsNoMap) {
  const test::TestFolder folder;
  const auto refused = ThrowsMessage<Error>(HasSubstr("is not a demslam map"));
  for (const std::string& content : {std::string(), std::string("map\n"), std::string(40000, 'x')}) {
    const fs::path file = folder.text("map.db", content);
    EXPECT_THAT([&] { MapStore::open(file); }, refused) << content.size();
    EXPECT_THAT([&] { check_map(file); }, refused) << content.size();
    EXPECT_EQ(read_text(file), content);
  }
  const fs::path foreign = make_map(folder.path() / "foreign.db", 1);
  overwrite(foreign, 68, "GPKG");
  EXPECT_THAT([&] { MapStore::open(foreign); }, refused);
  EXPECT_THAT([&] { MapStore::open(folder.path() / "none.db"); }, ThrowsMessage<Error>(HasSubstr("no such map")));
  EXPECT_FALSE(fs::exists(folder.path() / "none.db"));
}

TEST(DamagedMap, ANewerSchemaIsRefusedAndLeftAsItIs) {
  const test::TestFolder folder;
  const fs::path file = make_map(folder.path() / "map.db", 2);
  overwrite(file, 60, std::string("\0\0\0\2", 4));
  const std::string before = sha256_of_file(file);
  const auto refused = ThrowsMessage<Error>(HasSubstr("newer demslam"));
  EXPECT_THAT([&] { MapStore::open(file); }, refused);
  EXPECT_THAT([&] { MapStore::open_read_only(file); }, refused);
  EXPECT_THAT([&] { check_map(file); }, refused);
  EXPECT_EQ(sha256_of_file(file), before);
}

TEST(DamagedMap, AnExistingOneIsNeverReplaced) {
  const test::TestFolder folder;
  const fs::path file = make_map(folder.path() / "map.db", 2);
  const std::string before = sha256_of_file(file);
  EXPECT_THAT([&] { MapStore::create(file, small_header()); }, ThrowsMessage<Error>(HasSubstr("exists already")));
  EXPECT_EQ(sha256_of_file(file), before);
}

TEST(TwoRuns, CannotWriteOneMap) {
  const test::TestFolder folder;
  const fs::path file = folder.path() / "map.db";
  const auto refused = ThrowsMessage<Error>(HasSubstr("in use by another run"));
  {
    MapStore first = MapStore::create(file, small_header());
    EXPECT_THAT([&] { MapStore::open(file); }, refused);
    EXPECT_THAT([&] { MapStore::create(file, small_header()); }, refused);
    EXPECT_EQ(exit_code([&] { MapStore::open(file); }), kRefused);
    first.append(entry(0));
  }
  EXPECT_EQ(exit_code([&] { MapStore::open(file).append(entry(1)); }), kDone);
  expect_whole_keyframes(file, 2);
}

TEST(KilledRun, LeavesWholeKeyframesOnly) {
  const test::TestFolder folder;
  Random random(3);
  for (int i = 0; i < 25; ++i) {
    const fs::path file = folder.path() / (std::to_string(i) + ".db");
    const pid_t child = start_process([&] {
      MapStore store = MapStore::create(file, small_header());
      for (std::size_t k = 0;; ++k) store.append(entry(k));
    });
    while (!fs::exists(file)) std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::microseconds(random.index(60'000)));
    kill(child, SIGKILL);
    wait_for(child);
    expect_whole_keyframes(file, 0);
    const std::size_t kept = MapStore::open_read_only(file).keyframe_count();
    MapStore::open(file).append(entry(kept));
    expect_whole_keyframes(file, kept + 1);
  }
}

TEST(KilledRun, LosesOnlyItsTailWhenItsLogIsCut) {
  const test::TestFolder folder;
  const fs::path file = folder.path() / "map.db", log = folder.path() / "map.db-wal";
  ASSERT_EQ(exit_code([&] {
              MapStore store = MapStore::create(file, small_header());
              for (std::size_t k = 0; k < 10; ++k) store.append(entry(k));
              _exit(kDone);  // without closing
            }),
            kDone);
  for (auto size = fs::file_size(log); size > 0; size -= std::min<std::uintmax_t>(size, 40'001)) {
    fs::resize_file(log, size);
    expect_whole_keyframes(file, 0);
  }
}

TEST(FullDisk, KeepsEveryKeyframeBefore) {
  const test::TestFolder folder;
  for (const std::size_t limit : {200'000, 500'000, 1'000'000}) {
    const fs::path file = folder.path() / std::to_string(limit);
    EXPECT_EQ(exit_code([&] {
                std::signal(SIGXFSZ, SIG_IGN);
                const rlimit bytes{limit, limit};
                setrlimit(RLIMIT_FSIZE, &bytes);
                MapStore store = MapStore::create(file, small_header());
                for (std::size_t k = 0; k < 1000; ++k) store.append(entry(k));
              }),
              kRefused);
    expect_whole_keyframes(file, 1);
  }
}

TEST(FullDisk, AFailedAppendCanBeRepeated) {
  const test::TestFolder folder;
  const fs::path file = folder.path() / "map.db";
  EXPECT_EQ(exit_code([&] {
              std::signal(SIGXFSZ, SIG_IGN);
              MapStore store = MapStore::create(file, small_header());
              store.append(entry(0));
              const rlimit full{fs::file_size(file.string() + "-wal"), RLIM_INFINITY},
                  free{RLIM_INFINITY, RLIM_INFINITY};
              setrlimit(RLIMIT_FSIZE, &full);
              EXPECT_THAT([&] { store.append(entry(1)); }, ThrowsMessage<Error>(HasSubstr("disk full")));
              setrlimit(RLIMIT_FSIZE, &free);
              store.append(entry(1));
              if (testing::Test::HasFailure()) _exit(kOther);
            }),
            kDone);
  expect_whole_keyframes(file, 2);
}

TEST(ReadOnlyFolder, IsReadButNotWritten) {
  const test::TestFolder folder;
  const fs::path home = folder.path() / "locked", file = home / "map.db";
  fs::create_directory(home);
  make_map(file, 3);
  fs::permissions(folder.path(), fs::perms(0755));
  fs::permissions(home, fs::perms(0555));
  const auto as_nobody = [](const std::function<void()>& work) {
    return exit_code([&] {
      if (geteuid() == 0 && seteuid(65534) != 0) _exit(1);  // permissions do not bind root
      work();
    });
  };
  EXPECT_EQ(as_nobody([&] { MapStore::open(file); }), kRefused);
  EXPECT_EQ(as_nobody([&] { MapStore::create(home / "new.db", small_header()); }), kRefused);
  EXPECT_EQ(as_nobody([&] {
              expect_whole_keyframes(file, 3);
              _exit(testing::Test::HasFailure() ? kOther : kDone);
            }),
            kDone);
  fs::permissions(home, fs::perms::owner_all);
}

}  // namespace
}  // namespace demslam
