#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/units/time.hpp"

namespace probebox::app {

// Tells whether the whole chain goes on, from source to link: a watchdog that is fed only then cannot be kept alive by
// a thread that merely answers. Every stage counts what it has done; this compares.
class ChainWatch {
 public:
  // stages: their names, in the order in which events pass through them.
  ChainWatch(std::vector<std::string> stages, MonoTime now);

  struct Finding {
    bool all_went_on{};                            // each stage has, since this was last so: the watchdog may be fed
    std::vector<std::string_view> standing_still;  // for longer than the patience; those behind the first wait for it
    bool changed{};                                // they are others than at the last look
  };
  // progress: the count of each stage, in the same order. A look that comes later than the patience found this process
  // itself stopped, and blames no stage for it.
  Finding look(std::span<const std::uint64_t> progress, MonoTime now, Nanoseconds patience);

 private:
  struct Stage {
    std::string name;
    std::uint64_t count{};
    MonoTime moved_at{};
    bool went_on{};  // since the last finding that all had
    bool stands_still{};
  };

  std::vector<Stage> stages_;
  MonoTime looked_at_;
};

}  // namespace probebox::app
