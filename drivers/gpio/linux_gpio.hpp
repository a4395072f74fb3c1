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

// Edges of one gpio chip, stamped by the kernel on CLOCK_MONOTONIC, through libgpiod's deep buffer (1024 edges).
class LinuxGpio final : public io::EventSource {
 public:
  // Has nothing before acquire().
  explicit LinuxGpio(ChipLines chip);
  ~LinuxGpio() override;

  // Asks for the chip and its lines, the first time or again after they were lost. Errors, each with its remedy: no
  // such chip, no such line, no rights, a line that another process holds (named).
  Outcome<bool> acquire();

  // After acquire(), first the present level of every line that is watched on both edges (a probe in contact), stamped
  // `now`, or as the first edge that came since, with the sequence number last known. When the chip goes away,
  // SourceLost comes once for every source that it carried; then nothing until acquire().
  std::size_t read(std::span<Event> into, MonoTime now) override;
  // Linux 6.1 does not make it readable when the chip goes: call read() now and then all the same.
  int descriptor() const override;
  std::string_view name() const override { return name_; }

  // Not acquired, or no more.
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
