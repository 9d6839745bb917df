#include "demslam/store/writer_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "demslam/base/error.h"

namespace demslam {
namespace {

/// Whether the locked file is still the one of that name: its last holder removes it.
bool is_current(int descriptor, const std::filesystem::path& file) {
  struct stat held{}, named{};
  return fstat(descriptor, &held) == 0 && stat(file.c_str(), &named) == 0 && held.st_ino == named.st_ino &&
         held.st_dev == named.st_dev;
}

int try_lock(const std::filesystem::path& map, const std::filesystem::path& file) {
  const int descriptor = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor < 0) {
    throw Error(map.string() + ": its folder cannot be written (" + std::strerror(errno) +
                "); choose another run folder");
  }
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) return descriptor;
  close(descriptor);
  throw Error(map.string() + ": is in use by another run; wait for it or choose another run folder");
}

}  // namespace

WriterLock::WriterLock(const std::filesystem::path& map) : file_(map.string() + ".lock") {
  for (descriptor_ = try_lock(map, file_); !is_current(descriptor_, file_); descriptor_ = try_lock(map, file_)) {
    close(descriptor_);
  }
}

WriterLock::WriterLock(WriterLock&& other) noexcept
    : file_(std::move(other.file_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

WriterLock::~WriterLock() {
  if (descriptor_ < 0) return;
  unlink(file_.c_str());
  close(descriptor_);
}

}  // namespace demslam
