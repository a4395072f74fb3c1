#pragma once
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "protocol/units/outcome.hpp"

namespace probebox::command {

// Writes the output of a command to a file or to the standard output.
class Output {
 public:
  // when_whole: finish() gives the complete file its name; until then, and after a failure, an older file stays.
  // as_it_grows: the file has its name at once and keeps what was written before a kill, for recordings of hours.
  enum class Appears : std::uint8_t { when_whole, as_it_grows };

  // Explains why open() would refuse the file (it exists already); nothing when it would not.
  static std::optional<std::string> objectionTo(const std::string& path, bool force);
  // Whether two paths name one file, which need not exist. "-" is no file.
  static bool isSameFile(const std::string& a, const std::string& b);
  // "-" is `standard`. An existing file is an error unless `force`, also one that is made before finish(); devices and
  // pipes are written directly.
  static Outcome<Output> open(const std::string& path, bool force, std::ostream& standard,
                              Appears appears = Appears::when_whole);

  Output(Output&& other) noexcept;
  Output& operator=(Output&&) = delete;
  // Removes a file that finish() has not completed.
  ~Output();

  // False after the first failure; failure() says why.
  bool write(std::string_view text);
  bool write(std::span<const std::byte> bytes) {
    return write(std::string_view{reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
  bool flush();
  // Ends the writing and gives the file its name.
  bool finish();

  std::ostream& stream() { return *stream_; }
  const std::string& name() const { return name_; }
  std::string failure() const;

 private:
  Output(std::string name, std::string written_to, std::unique_ptr<std::ostream> file, std::ostream* stream,
         bool replaces);

  std::string name_;
  std::string written_to_;  // until finish(); empty where the file has its name at once
  std::unique_ptr<std::ostream> file_;
  std::ostream* stream_;
  bool replaces_;
  bool is_late_{};  // another file of the name was made meanwhile
};

}  // namespace probebox::command
