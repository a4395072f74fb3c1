#pragma once
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace probebox::app {

// The sources of events, and what keeps each of them from giving any. Any thread.
class SourceTable {
 public:
  struct Row {
    std::string name;
    std::string problem;  // empty when all is well
    std::uint64_t unusable{};
  };

  void add(std::string_view name);
  // By the order of add(). What is new is also said in the log, once.
  void tell(std::size_t row, std::string_view problem);
  void tellUnusable(std::size_t row, std::uint64_t count);

  std::vector<Row> rows() const;

 private:
  mutable std::mutex mutex_;
  std::vector<Row> rows_;
};

}  // namespace probebox::app
