#pragma once
#include <cstddef>
#include <iosfwd>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "protocol/units/outcome.hpp"

namespace probebox::command {

// The file, or the standard output, that a command writes to. What was written before a kill is in the file.
class Output {
 public:
  // Why open() would not touch the file: it is there already. Nothing when it would.
  static std::optional<std::string> objectionTo(const std::string& path, bool force);
  // "-" is `standard`. An existing file is an error unless `force`; a device or a pipe is not.
  static Outcome<Output> open(const std::string& path, bool force, std::ostream& standard);

  // False after the first failure; failure() says why.
  bool write(std::string_view text);
  bool write(std::span<const std::byte> bytes) {
    return write(std::string_view{reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
  bool flush();

  std::ostream& stream() { return *stream_; }
  const std::string& name() const { return name_; }
  std::string failure() const;

 private:
  Output(std::string name, std::unique_ptr<std::ostream> file, std::ostream* stream)
      : name_{std::move(name)}, file_{std::move(file)}, stream_{stream} {}

  std::string name_;
  std::unique_ptr<std::ostream> file_;
  std::ostream* stream_;
};

}  // namespace probebox::command
