#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/units/time.hpp"

namespace probebox::app {

// Checks that every stage from source to link makes progress, by comparing the counts of their work. A watchdog that is
// fed only then is not kept alive by one thread that still runs.
class ChainWatch {
 public:
  // stages: their names, in the order in which events pass through them.
  ChainWatch(std::vector<std::string> stages, MonoTime now);

  struct Finding {
    bool all_went_on{};  // every stage has made progress since this was last true: feed the watchdog
    std::vector<std::string_view>
        standing_still;  // no progress for longer than the patience; later stages wait for the first one
    bool changed{};      // standing_still differs from the last call
  };
  // progress: count of each stage in the same order. A call later than `patience` after the last one means that the
  // whole process was stopped; no stage is blamed.
  Finding look(std::span<const std::uint64_t> progress, MonoTime now, Nanoseconds patience);

 private:
  struct Stage {
    std::string name;
    std::uint64_t count{};
    MonoTime moved_at{};
    bool went_on{};  // since the last finding with progress of all
    bool stands_still{};
  };

  std::vector<Stage> stages_;
  MonoTime looked_at_;
};

}  // namespace probebox::app
