#pragma once
#include <span>
#include <vector>

#include "drivers/gpio/lines.hpp"

namespace probebox::gpio {

// Tells once, for every source that a chip carried, that the source has gone.
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
  // Before the first raise() there is nothing to tell.
  void settle() { told_ = sources_.size(); }

 private:
  std::vector<Source> sources_;
  std::size_t told_{};
};

}  // namespace probebox::gpio
