#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace demslam {

/// A vector that only grows at its end and of which only the last element ever changes, for long histories. Copies
/// share all blocks but the last: they cost next to nothing, and one may be read in another thread while the other
/// grows.
template <class T, std::size_t block = 1024>
class SharedHistory {
 public:
  SharedHistory() = default;
  SharedHistory(const SharedHistory& other) : blocks_(other.blocks_), size_(other.size_) {
    if (!blocks_.empty()) blocks_.back() = own(*blocks_.back());
  }
  SharedHistory& operator=(SharedHistory other) noexcept {
    blocks_.swap(other.blocks_);
    std::swap(size_, other.size_);
    return *this;
  }
  SharedHistory(SharedHistory&& other) noexcept
      : blocks_(std::move(other.blocks_)), size_(std::exchange(other.size_, 0)) {}

  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  const T& operator[](std::size_t n) const { return (*blocks_[n / block])[n % block]; }
  const T& back() const { return blocks_.back()->back(); }
  T& back() { return blocks_.back()->back(); }
  void push_back(const T& element) {
    if (size_ % block == 0) blocks_.push_back(own({}));
    blocks_.back()->push_back(element);
    ++size_;
  }

 private:
  using Block = std::vector<T>;
  static std::shared_ptr<Block> own(const Block& elements) {
    auto copy = std::make_shared<Block>();
    copy->reserve(block);
    copy->assign(elements.begin(), elements.end());
    return copy;
  }

  std::vector<std::shared_ptr<Block>> blocks_;
  std::size_t size_ = 0;
};

}  // namespace demslam
