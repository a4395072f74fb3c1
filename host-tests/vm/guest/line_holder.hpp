#pragma once
#include <string>

struct gpiod_line_request;

namespace probebox::vm {

// Somebody else who holds a line, under a name, as long as this lives.
class LineHolder {
 public:
  LineHolder(const std::string& chip, unsigned line, const char* name);
  ~LineHolder();
  LineHolder(const LineHolder&) = delete;
  LineHolder& operator=(const LineHolder&) = delete;
  bool holds() const { return held_ != nullptr; }

 private:
  gpiod_line_request* held_;
};

}  // namespace probebox::vm
