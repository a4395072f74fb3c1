#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "protocol/events/event.hpp"

namespace probebox::iio {

// Reports once, for every source on a device, that the device has gone.
class LossNotice {
 public:
  void add(Source source) {
    for (const auto known : sources_)
      if (known == source) return;
    sources_.push_back(source);
    told_ = sources_.size();
  }
  void raise() { told_ = 0; }

  std::size_t read(std::span<Event> into, MonoTime now) {
    std::size_t count = 0;
    while (count < into.size() && told_ < sources_.size())
      into[count++] = SourceLost{sources_[told_++], LossReason::disconnected, 0, now};
    return count;
  }

 private:
  std::vector<Source> sources_;
  std::size_t told_{};
};

}  // namespace probebox::iio
