#pragma once
#include <string>
#include <vector>

#include "protocol/messages/control.hpp"

namespace probebox::tour {

// Prints the results of the tour beside the truth and decides its exit status.
class ClosingTable {
 public:
  // Adds an estimate beside the truth; it is right within 4 standard deviations.
  void estimate(const std::string& what, const messages::NamedValue& found, double truth);
  // Adds a finding that is right or wrong.
  void exact(const std::string& what, const std::string& found, bool right);

  bool allRight() const;
  void print() const;

 private:
  struct Row {
    std::string what;
    std::string found;
    std::string expected;
    bool right{};
  };
  std::vector<Row> rows_;
};

}  // namespace probebox::tour
