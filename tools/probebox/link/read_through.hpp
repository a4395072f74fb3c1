#pragma once
#include <string>

#include "protocol/units/outcome.hpp"
#include "tools/link/recording.hpp"
#include "tools/probebox/cli/console.hpp"

namespace probebox::command {

struct ReadingWishes {
  bool shows_progress{};
  link::EnoughRead enough{};
};

// A recording for a command; "-" is the standard input. Trouble: it cannot be read, or Ctrl-C has ended the reading,
// and the listener has heard what came before.
Outcome<link::RecordingEnd, Trouble> readThrough(const std::string& path, link::StreamListener& listener,
                                                 Console& console, const ReadingWishes& wishes = {});

// Says what went wrong; after Ctrl-C nothing did.
ExitStatus conclude(const Trouble& trouble, Console& console);

}  // namespace probebox::command
