#include "firmware/app/cnc/text_line.hpp"

#include <array>
#include <cstdio>
#include <pthread.h>

namespace probebox::app {

TextLine::TextLine(const TextOptions& options, const board::Access& may, StateBuffer& states,
                   const CncColleagues& colleagues)
    : may_{may},
      states_{states},
      with_{colleagues},
      device_{options.line.path},
      door_{(options.face == TextOptions::Face::tape ? "tape:" : "records:") + device_},
      server_{options,
              // A tape is read once and taken whole; records are followed.
              {.snapshot =
                   [this, follows = options.face != TextOptions::Face::tape] {
                     const auto snapshot = states_.newest().snapshot;
                     return follows ? with_.served.shownTo(door_, snapshot) : snapshot;
                   },
               // Written down before it goes out.
               .serves = [this](const published::Snapshot& snapshot) { with_.served.note(snapshot, door_); },
               .take = [this](const tape::Said& said) { return with_.desk.take(said, door_, states_.newest(), may_); },
               .run = [this] { return states_.newest().snapshot.calibration_run; },
               .report = [this](const std::string& text) { warnings_.warn(time_.now(), text); },
               .reached = [this](const tape::Positions& reached) { compare(reached); },
               .round =
                   [this] {
                     warnings_.look(time_.now());
                     reached_.look(time_.now());
                   }}} {}

TextLine::~TextLine() {
  server_.stop();
  if (thread_.joinable()) thread_.join();
}

void TextLine::start() {
  thread_ = std::thread{[this] { server_.run(); }};
  pthread_setname_np(thread_.native_handle(), "cnc-text");
}

messages::CncLineStatus TextLine::status() const {
  const auto counters = server_.counters();
  return {.name = device_,
          .answered = counters.answered,
          .refused = counters.refused,
          .bad_frames = 0,
          .skipped_bytes = 0,
          .unsent = counters.unsent,
          .reopened = counters.reopened};
}

// A control's own display beside the box's encoders, in the log: they differ by the correction and by lost counts.
void TextLine::compare(const tape::Positions& reached) {
  const auto& axes = states_.newest().snapshot.axes;
  std::string text = device_ + " reports";
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (!reached.at_mm[i]) continue;
    std::array<char, 80> words{};
    std::snprintf(words.data(), words.size(), " %c %.4f (the box: %s%.4f)", "XYZ"[i], *reached.at_mm[i],
                  axes[i].referenced ? "" : "not referenced, ", axes[i].position_mm);
    text += words.data();
  }
  reached_.warn(time_.now(), text);
}

}  // namespace probebox::app
