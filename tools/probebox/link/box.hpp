#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "protocol/units/outcome.hpp"
#include "tools/link/client.hpp"
#include "tools/link/uri.hpp"
#include "tools/probebox/cli/console.hpp"

// Connects to the box that the user named, or to the only one that can be found.
namespace probebox::command {

using std::chrono::milliseconds;

inline constexpr milliseconds kConnectPatience{3000};
inline constexpr milliseconds kAnswerPatience{5000};

// Where a box listens unless it was told otherwise.
inline constexpr const char* kUsualUri = "tcp:127.0.0.1:7627";

// A number of seconds from the command line.
milliseconds inMilliseconds(double seconds);

// given, or PROBEBOX_URI, or the only box that has announced itself here or is on USB, or the usual address.
Outcome<link::Uri, Trouble> chooseUri(const std::string& given);

// For commands about a recording: the path that they were given, or that of a file: URI.
Outcome<std::string, Trouble> chooseRecording(const std::string& path, const std::string& given);

// What a failure to open, or of the link, means for the command's exit status. After Ctrl-C everything is an
// interruption.
Trouble troubleOf(const link::OpenFailure& failure);
Trouble troubleOf(const link::Failure& failure, const Console& console);
Trouble usage(std::string what);
Trouble interruption();

// Patience that ends at Ctrl-C.
link::Wait patienceOf(const Console& console, milliseconds limit);

using Box = std::unique_ptr<link::Client>;

// Connects and shakes hands. `listener` may be null and outlives the box.
Outcome<Box, Trouble> openBox(const link::Uri& uri, const Console& console, milliseconds patience = kConnectPatience,
                              link::StreamListener* listener = nullptr, const link::ClientOptions& options = {});
// The same for what -u gave, for commands that need a box and no recording.
Outcome<Box, Trouble> openBox(const std::string& given, const Console& console);

// Sends one request and waits for its answer.
template <class Operation>
Outcome<typename Operation::Answer, Trouble> ask(link::Client& box, const Console& console,
                                                 const typename Operation::Request& request = {}) {
  auto answer = box.request<Operation>(request, patienceOf(console, kAnswerPatience));
  if (!answer) return troubleOf(answer.error(), console);
  return std::move(answer).value();
}

// Lists that come in parts end, whatever the box says: each part has to go on behind the one before it, and no box has
// more than kMostParts.
class ListWatch {
 public:
  static constexpr std::uint64_t kMostParts = 10'000;

  // first, last: numbers of what came in this part. Trouble: it will never end.
  std::optional<Trouble> part(std::uint64_t first, std::uint64_t last);

 private:
  std::uint64_t parts_{};
  std::uint64_t last_{};
};

}  // namespace probebox::command
