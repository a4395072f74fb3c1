#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/link/recording.hpp"
#include "tools/probebox/console.hpp"

// A recording as a table: one row a sample that was received. Samples that are missing have no row; where they are
// missing is said.
namespace probebox::command {

// Writes rows in some format.
class RowWriter {
 public:
  virtual ~RowWriter() = default;

  // Before the first row: what is no recording overwrites no table.
  virtual void begin(const messages::Descriptor& descriptor) = 0;
  virtual void row(const link::DecodedBlock& block, std::size_t k, SampleIndex sample) = 0;
  virtual void end() = 0;
  // Why no more can be written.
  virtual const std::optional<std::string>& failure() const = 0;
};

struct TableJob {
  std::string input;  // "-" is the standard input
  std::string output;
  bool force{};
  std::string triggers{};  // where they go; empty: nowhere
};

// The column's name with its unit. "um/s" cannot stand in it and becomes um_s.
std::string columnName(const messages::ChannelDescription& channel);

// Reads the recording, has its rows written, and says what is missing.
ExitStatus writeTable(const TableJob& job, RowWriter& writer, Console& console);

}  // namespace probebox::command
