#pragma once
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

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

  void add(std::string_view name);
  // Rows in the order of add(). A new problem is also logged once.
  void tell(std::size_t row, std::string_view problem);
  void tellFaults(std::size_t row, std::string_view faults);
  void tellUnusable(std::size_t row, std::uint64_t count);

  std::vector<Row> rows() const;

 private:
  mutable std::mutex mutex_;
  std::vector<Row> rows_;
};

}  // namespace probebox::app
