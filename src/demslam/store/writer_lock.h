#pragma once

#include <filesystem>

namespace demslam {

/// One writer per map: holds `<map>.lock` from construction to destruction. The system releases it when the process
/// dies, however that happens. Readers need no lock.
class WriterLock {
 public:
  /// Throws Error when another run holds it or the folder cannot be written.
  explicit WriterLock(const std::filesystem::path& map);
  ~WriterLock();
  WriterLock(WriterLock&& other) noexcept;
  WriterLock& operator=(WriterLock&&) = delete;

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
};

}  // namespace demslam
