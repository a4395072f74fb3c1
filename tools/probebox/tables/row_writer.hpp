#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "tools/link/recording.hpp"

namespace probebox::command {

// Writes the rows of a table in one format.
class RowWriter {
 public:
  virtual ~RowWriter() = default;

  // Called before the first row, once the input has proved to be a recording: only now the output is opened.
  virtual void begin(const messages::Descriptor& descriptor) = 0;
  // Whether rows of a later descriptor with the same columns can follow.
  virtual bool canGoOnWith(const messages::Descriptor&) const { return true; }
  // Called before the first row of each block.
  virtual void enter(const messages::Descriptor&) {}
  virtual void row(const link::DecodedBlock& block, std::size_t k, SampleIndex sample) = 0;
  // For formats that hold more than rows: gaps and triggers, each once, in stream order.
  virtual void missing(SampleIndex /*first*/, std::uint64_t /*count*/, std::string_view /*reason*/) {}
  virtual void trigger(const messages::Trigger&) {}
  virtual bool holdsTriggers() const { return false; }
  virtual void end() = 0;
  // Why no more can be written.
  virtual const std::optional<std::string>& failure() const = 0;
};

class TipPoints;

struct TableJob {
  std::string input;  // "-" is the standard input
  std::string output;
  bool force{};
  std::string triggers{};  // where they go; empty: nowhere
  TipPoints* points{};     // for columns about the tip and the surface; nullptr: none
};

}  // namespace probebox::command
