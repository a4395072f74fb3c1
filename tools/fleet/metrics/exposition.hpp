#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace probebox::fleet {

struct Label {
  std::string name;
  std::string value;
};

enum class MetricType : std::uint8_t { gauge, counter };

// Collects samples and writes them in Prometheus' text format 0.0.4
// (https://prometheus.io/docs/instrumenting/exposition_formats): a family has one HELP and one TYPE, and its samples
// stand together.
class Exposition {
 public:
  // Only the first sample of the same name and labels counts: a second one would make Prometheus refuse all of the
  // text.
  void add(const std::string& name, std::string_view help, MetricType type, const std::vector<Label>& labels,
           double value);
  std::string text() const;
  std::size_t series() const { return written_.size(); }

 private:
  std::map<std::string, std::size_t, std::less<>> known_;
  std::vector<std::string> families_;
  std::set<std::string, std::less<>> written_;
};

}  // namespace probebox::fleet
