#pragma once
#include <span>
#include <vector>

#include "drivers/gpio/lines.hpp"

namespace probebox::gpio {

// Reports once, for every source of a chip, that the source has disappeared.
class LossNotice {
 public:
  void add(Source source) {
    for (const auto known : sources_) {
      if (known == source) return;
    }
    sources_.push_back(source);
  }

  void raise() { told_ = 0; }
  bool pending() const { return told_ < sources_.size(); }

  std::size_t read(std::span<Event> into, MonoTime now) {
    std::size_t count = 0;
    while (count < into.size() && pending()) {
      into[count++] = SourceLost{sources_[told_++], LossReason::disconnected, 0, now};
    }
    return count;
  }
  // Nothing to report before the first raise().
  void settle() { told_ = sources_.size(); }

 private:
  std::vector<Source> sources_;
  std::size_t told_{};
};

}  // namespace probebox::gpio
