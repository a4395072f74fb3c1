#pragma once
#include <memory>
#include <string>
#include <vector>

#include "drivers/gpio/decode.hpp"
#include "drivers/gpio/lines.hpp"
#include "drivers/gpio/loss.hpp"
#include "drivers/io/event_source.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::gpio {

// Reads edges of one gpio chip, stamped by the kernel on CLOCK_MONOTONIC, with libgpiod's deep buffer (1024 edges).
class LinuxGpio final : public io::EventSource {
 public:
  // Delivers nothing before acquire().
  explicit LinuxGpio(ChipLines chip);
  ~LinuxGpio() override;

  // Requests the chip and its lines, initially or after they were lost. Errors with remedies: no such chip, no such
  // line, no permission, a line held by another process (named).
  Outcome<void> acquire();

  // After acquire(), first delivers the present level of every line watched on both edges (a probe in contact), stamped
  // `now` or as the first later edge, with the last known sequence. When the chip disappears, delivers SourceLost once
  // for each of its sources, then nothing until acquire().
  std::size_t read(std::span<Event> into, MonoTime now) override;
  // Linux 6.1 does not signal it when the chip disappears: call read() periodically.
  int descriptor() const override;
  std::string_view name() const override { return name_; }

  // True before acquire() and after a loss.
  bool lost() const { return lost_; }

  std::uint64_t unusable() const override { return decoder_ ? decoder_->unknownEdges() : 0; }

 private:
  struct Request;

  bool findLevels(Request& request);
  std::size_t readLevels(std::span<Event> into, MonoTime now);
  std::size_t readEdges(std::span<Event> into);

  ChipLines chip_;
  std::string name_;
  std::unique_ptr<Request> request_;
  std::unique_ptr<EdgeDecoder> decoder_;
  LossNotice loss_;
  std::vector<Edge> found_;  // levels when the lines were acquired
  std::size_t found_told_{};
  bool lost_{true};
};

}  // namespace probebox::gpio
