#pragma once
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/io/event_source.hpp"

namespace probebox::app {

// Lists the sources of events and their problems. Any thread.
class SourceTable {
 public:
  struct Row {
    std::string name;
    std::string problem;  // empty when there is none
    std::string faults;   // likewise
    std::uint64_t unusable{};
  };

  // fault_names: those of the source; they live as long as the program.
  void add(std::string_view name, std::span<const io::SourceFault> fault_names = {});
  // Rows in the order of add(). A new problem is also logged once.
  void tell(std::size_t row, std::string_view problem);
  // Bits of the source's fault names. Does not allocate: logFaults() puts them into words.
  void tellFaults(std::size_t row, std::uint32_t faults);
  void tellUnusable(std::size_t row, std::uint64_t count);

  std::vector<Row> rows() const;
  // Logs the faults that are new since the last call.
  void logFaults();

 private:
  struct Faults {
    std::span<const io::SourceFault> names;
    std::uint32_t now{};
    std::uint32_t logged{};
    std::string inWords() const;
  };
  mutable std::mutex mutex_;  // the capture thread waits for it: sentences are written without it
  std::vector<Row> rows_;
  std::vector<Faults> faults_;
};

}  // namespace probebox::app
